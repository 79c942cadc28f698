"""The checks of readings in a constant reference against themselves: dwells and sweeps against one model.

The calibration (`rig.estimation.reference.accelerometer_model`) must explain the readings within their noise, the arm's
attitude error δ and stated errors. A magnetometer has dwells only. Every alternative is tested by a likelihood ratio,
in which δ is re-estimated, so that a fault does not mask itself.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rig.analysis.consistency.reference_alternatives import (
    FAULT_MODES,
    ReferenceModel,
    alternatives,
    bias_drift_columns,
    segment_columns,
)
from rig.analysis.consistency.residual_tests import (
    Statistic,
    TestResults,
    find_outliers,
    minimal_detectable_size,
    orthonormal_basis,
    remaining_directions,
    test_alternatives,
)
from rig.estimation.arrays import Array
from rig.estimation.reference.accelerometer_model import effects, predicted
from rig.estimation.reference.attitude_error import maximise_likelihood
from rig.estimation.reference.imu_fit import slopes
from rig.estimation.reference.reading_errors import noise
from rig.estimation.reference.shared_errors import decorrelate, information


@dataclass(frozen=True, slots=True)
class WhitenedReference:
    """Residuals (n,) and `model` columns (n, q), in coordinates in which all errors are independent.

    Noise has variance 1 in these coordinates, and `rotation` (n, n) maps readings to them. If the arm's attitudes err
    by the standard deviation δ, the variances of the residuals are 1 + δ² `growth` (n,)
    (`rig.estimation.reference.shared_errors`).
    """

    residuals: Array
    model: Array
    rotation: Array
    growth: Array

    def chi_square_of(self, alternatives: Sequence[Array], nuisance: Sequence[Array]) -> list[float]:
        """Return the χ² of each alternative, as `WhitenedModel` defines it.

        The arm's attitude error is estimated after the likeliest alternative is added to the model, because otherwise
        a fault would look like a large attitude error.
        """
        model = self._extend_model(nuisance)
        rotated = [self.rotation @ columns for columns in alternatives]
        delta_rad = self._estimate_delta(model)
        worst = rotated[int(np.argmax([self._chi_square_drop(model, columns, delta_rad) for columns in rotated]))]
        delta_rad = self._estimate_delta(
            np.column_stack([model, remaining_directions(orthonormal_basis(model), worst)])
        )
        return [self._chi_square_drop(model, columns, delta_rad) for columns in rotated]

    def test(
        self, columns: Array | None, nuisance: Sequence[Array], false_alarm_probability: float
    ) -> Statistic | None:
        """Return the likelihood-ratio statistic of the columns, and its critical value.

        The statistic is twice the logarithm of the ratio of the likelihoods with and without the columns; each
        likelihood has its own restricted maximum-likelihood estimate of the arm's attitude error δ (Welham and
        Thompson, J. R. Stat. Soc. B 59 (1997) 701). If `columns` is None, the statistic is the χ² of all residuals.
        Return None if the model already explains all that the columns can.
        """
        from scipy.special import chdtri

        model = self._extend_model(nuisance)
        delta_rad, base_likelihood = maximise_likelihood(self.growth, self.residuals, model)
        if columns is None:
            dof = len(self.residuals) - model.shape[1]
            residuals = self._whiten_residuals(model, delta_rad)[1]
            return (float(residuals @ residuals), float(chdtri(dof, false_alarm_probability))) if dof else None
        new = remaining_directions(orthonormal_basis(model), self.rotation @ columns)
        if not new.shape[1]:
            return None
        _, extended_likelihood = maximise_likelihood(self.growth, self.residuals, model, new)
        return 2 * (base_likelihood - extended_likelihood), self._limit(model, new, delta_rad, false_alarm_probability)

    def minimal_detectable_size(
        self, fault_patterns: Array, alternatives: Sequence[Array], false_alarm_probability: float
    ) -> float:
        """Return the smallest fault, in units of `fault_patterns` (n, k), that one of the `alternatives` detects."""
        model = self._extend_model(())
        delta_rad = self._estimate_delta(model)
        size = np.sqrt(1 + delta_rad**2 * self.growth)[:, None]
        rotated = [self.rotation @ columns for columns in alternatives]
        new_parts = [(columns, remaining_directions(orthonormal_basis(model), columns)) for columns in rotated]
        limits = [
            (columns, self._limit(model, new, delta_rad, false_alarm_probability))
            for columns, new in new_parts
            if new.shape[1]
        ]
        whitened = [(columns / size, lambda _, limit=limit: limit) for columns, limit in limits]
        return minimal_detectable_size(orthonormal_basis(model / size), self.rotation @ fault_patterns / size, whitened)

    def _limit(self, model: Array, new: Array, delta_rad: float, false_alarm_probability: float) -> float:
        """Return the critical value of the test for the orthonormal columns `new`, which the model does not contain."""
        from scipy.special import chdtri, fdtri

        # With δ known, the statistic is χ²; with δ estimated from few residuals, it follows from an F variable. The
        # critical value lies between the two, in proportion to the part of the variance that is due to δ.
        count = new.shape[1]
        chi_square_limit, dof = (
            float(chdtri(count, false_alarm_probability)),
            max(self._delta_dof(model, delta_rad), count + 1.0),
        )
        projections = count / (dof - count) * fdtri(count, dof - count, 1 - false_alarm_probability)
        f_limit, fraction = dof * float(np.log1p(projections)), self._delta_fraction(model, new, delta_rad)
        return float(chi_square_limit + fraction * max(f_limit - chi_square_limit, 0.0))

    def _extend_model(self, nuisance: Sequence[Array]) -> Array:
        """Return an orthonormal basis of the model and the nuisance columns."""
        return orthonormal_basis(np.column_stack([self.model, *(self.rotation @ columns for columns in nuisance)]))

    def _estimate_delta(self, model: Array) -> float:
        """Return the arm's attitude error, rad, from the residuals of the model."""
        return maximise_likelihood(self.growth, self.residuals, model)[0]

    def _whiten_residuals(self, model: Array, delta_rad: float) -> tuple[Array, Array]:
        """Return the model's basis and residuals, both whitened for attitude errors of std `delta_rad`."""
        size = np.sqrt(1 + delta_rad**2 * self.growth)
        model_basis, residuals = orthonormal_basis(model / size[:, None]), self.residuals / size
        return model_basis, residuals - model_basis @ (model_basis.T @ residuals)

    def _chi_square_drop(self, model: Array, columns: Array, delta_rad: float) -> float:
        """Return the χ² that columns explain in addition to the model, with attitude errors of `delta_rad` (std)."""
        model_basis, residuals = self._whiten_residuals(model, delta_rad)
        projections = (
            remaining_directions(model_basis, columns / np.sqrt(1 + delta_rad**2 * self.growth)[:, None]).T @ residuals
        )
        return float(projections @ projections)

    def _delta_dof(self, model: Array, delta_rad: float) -> float:
        """Return the effective dof of the estimated square of the attitude error, from its expected information."""
        return 2 * information(self.growth, delta_rad, model) * delta_rad**4

    def _delta_fraction(self, model: Array, columns: Array, delta_rad: float) -> float:
        """Return the fraction (0 to 1) of the variance of the residuals, along the columns, due to attitude errors."""
        variance = 1 + delta_rad**2 * self.growth
        model_basis, _ = self._whiten_residuals(model, delta_rad)
        projections = remaining_directions(model_basis, columns / np.sqrt(variance)[:, None])
        return float(np.mean(np.sum((1 - 1 / variance)[:, None] * projections**2, axis=0)))


def check_reference(readings: ReferenceModel, false_alarm_probability: float, *, drifting: bool = False) -> TestResults:
    """Return every statistic with its critical value; if `drifting`, a steady drift of the bias is no fault."""
    whitened, columns_by_name = _whiten_readings(readings, drifting=drifting), alternatives(readings)
    segments = range(readings.dwells + readings.sweeps)
    ranked = find_outliers(
        whitened, segments, lambda segment: segment_columns(readings, segment), false_alarm_probability
    )
    return TestResults(
        test_alternatives(whitened, columns_by_name, false_alarm_probability),
        ranked[0][1],
        {segment: statistic for segment, statistic in ranked if statistic[0] > statistic[1]},
        _detection_limits(whitened, readings, false_alarm_probability),
    )


def predict_detection_limits(readings: ReferenceModel, false_alarm_probability: float) -> dict[str, float]:
    """Return the minimal detectable size of every fault mode."""
    return _detection_limits(_whiten_readings(readings, drifting=False), readings, false_alarm_probability)


def _detection_limits(
    whitened: WhitenedReference, readings: ReferenceModel, false_alarm_probability: float
) -> dict[str, float]:
    """Return the minimal detectable size of every fault mode that a check detects."""
    segments = readings.dwells + readings.sweeps
    tests = {
        name: ([columns], false_alarm_probability)
        for name, columns in alternatives(readings).items()
        if columns is not None
    }
    tests["disturbed_dwell"] = (
        [segment_columns(readings, dwell) for dwell in range(readings.dwells)],
        false_alarm_probability / segments,
    )
    sizes = {
        fault_mode.what: whitened.minimal_detectable_size(fault_mode.patterns(readings), *tests[fault_mode.check])
        for fault_mode in FAULT_MODES
        if fault_mode.check in tests
    }
    return {what: size for what, size in sizes.items() if np.isfinite(size)}


def _whiten_readings(readings: ReferenceModel, *, drifting: bool) -> WhitenedReference:
    """Return residuals and model columns with unit noise, in coordinates in which all errors are independent.

    The independent errors are noise with the known errors, and the effects of the arm's attitude errors, whose variance
    δ² is not known: `growth` is the variance of each coordinate at δ = 1. If `drifting`, the model includes a drift of
    the bias.
    """
    theta, movement = readings.theta, readings.movement
    decoupled = decorrelate(
        noise(theta, movement) + readings.error_patterns.T @ readings.error_patterns, effects(theta, movement)
    )
    model = slopes(theta, movement, second_order=readings.second_order)
    if drifting:
        model = np.column_stack([model, bias_drift_columns(readings)])
    residuals = (movement.readings() - predicted(theta, movement)).ravel()
    whitener = decoupled.transform
    return WhitenedReference(whitener @ residuals, whitener @ model, whitener, decoupled.growth)
