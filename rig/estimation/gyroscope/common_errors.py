"""The vector model with errors common to many observations, each with a prior standard deviation.

A twist of the arm's wrist rotates the axis of every sweep beyond it; a nonlinear sensor has the same error in every
fast sweep. Each such error e (zero on average, of standard deviation 1 in its own unit) adds B e to the readings:

    m = F ω + c (+ G a) + B e,   e ~ N(0, I)

F, c, e and, with the apparent gravity a, the g-sensitivity G are estimated together (the mixed model of Henderson,
Biometrics 31 (1975) 423). The result is corrected for the part of e that sweeps and rests determine; the other part is
predicted as zero.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from rig.estimation.arrays import Array
from rig.estimation.gyroscope.vector_model import (
    VectorSolution,
    check_matrix,
    check_observations,
    design_matrix,
    fit_coefficients,
    index_coefficients,
    propagate_speed_std,
    regress,
    solve_vector_model,
)
from rig.estimation.sensor_axes import angle_jacobian, parameter_jacobian

MAX_ITERATIONS = 2  # B depends on F, and the first F is already within one percent


@dataclass(frozen=True, slots=True)
class CommonErrors:
    """The best linear unbiased prediction of P errors that are common to N mean readings.

    `sizes` (P,) are the predicted errors, each in units of its prior standard deviation, and `covariance` (P, P) is
    their posterior covariance. `readings_rad_s` (N, 3) is the predicted errors' effect on the mean readings.
    """

    sizes: Array
    covariance: Array
    readings_rad_s: Array


@dataclass(frozen=True, slots=True)
class Prediction:
    """The predicted `errors`, and arrays that depend on the gyroscope's matrix, as last estimated.

    - `patterns_rad_s` (P, N, 3): the effect of one standard deviation of each error on the readings.
    - `gain` (P, N, 3): the map from the means to the sizes of the errors.
    - `speed_noise_rad_s` (N, 3): the effect on the readings of one standard deviation of each speed.
    """

    errors: CommonErrors
    patterns_rad_s: Array
    gain: Array
    speed_noise_rad_s: Array


@dataclass(frozen=True, slots=True)
class CommonErrorModel:
    """The vector model with common errors.

    `effects` takes F (3, 3) and returns B (P, N, 3): the change of the readings, rad/s, by one standard deviation of
    each error. The other fields are arguments of `solve_vector_model`.
    """

    means_rad_s: Array
    rates_rad_s: Array
    variances_rad2_s2: Array
    effects: Callable[[Array], Array]
    speed_std_rad_s: Array
    gravity_m_s2: Array | None = None
    nominal_mounting: Array | None = None

    @property
    def design(self) -> Array:
        """The design (N, p) of the vector model."""
        return design_matrix(self.rates_rad_s, self.gravity_m_s2)

    def predict(self, shared_covariance_rad2_s2: Array | None = None) -> Prediction:
        """Return the prediction of the common errors from the means. Raise Fault as `solve_vector_model` does."""
        check_observations(
            self.design, self.means_rad_s, self.rates_rad_s, self.variances_rad2_s2, self.speed_std_rad_s
        )
        matrix = self.fit_matrix(0.0, shared_covariance_rad2_s2)
        check_matrix(matrix, self.nominal_mounting)
        prediction = self._predict(matrix, shared_covariance_rad2_s2)
        for _ in range(1, MAX_ITERATIONS):
            matrix = self.fit_matrix(prediction.errors.readings_rad_s, shared_covariance_rad2_s2)
            prediction = self._predict(matrix, shared_covariance_rad2_s2)
        return prediction

    def fit_matrix(self, effect_rad_s: Array | float, shared_covariance_rad2_s2: Array | None = None) -> Array:
        """Return the gyroscope's matrix F (3, 3) from the means minus the effect (N, 3) of common errors."""
        coefficients, *_ = fit_coefficients(
            self.design,
            self.means_rad_s - effect_rad_s,
            self.rates_rad_s,
            self.variances_rad2_s2,
            speed_std=self.speed_std_rad_s,
            shared=shared_covariance_rad2_s2,
        )
        return coefficients[:3].T

    def solve(self, shared_covariance_rad2_s2: Array | None = None) -> tuple[VectorSolution, CommonErrors]:
        """Return the solution corrected for common errors, and the estimated errors.

        The solution's `covariance`, `matrix_covariance` and `response` are due to the readings alone. Its
        `angles_covariance_rad2` also includes the undetermined part of the common errors. Raise Fault as
        `solve_vector_model` does.
        """
        prediction = self.predict(shared_covariance_rad2_s2)
        solution = solve_vector_model(
            self.means_rad_s - prediction.errors.readings_rad_s,
            self.rates_rad_s,
            self.variances_rad2_s2,
            speed_std_rad_s=self.speed_std_rad_s,
            gravity_m_s2=self.gravity_m_s2,
            nominal_mounting=self.nominal_mounting,
            shared_covariance_rad2_s2=shared_covariance_rad2_s2,
        )
        gain, patterns, speed_noise = prediction.gain, prediction.patterns_rad_s, prediction.speed_noise_rad_s
        _, inverse = regress(
            self.design, self.means_rad_s, self.variances_rad2_s2 + speed_noise**2, shared_covariance_rad2_s2
        )
        shifts = np.einsum("ipn,kni->ipk", inverse, patterns)  # changes of the coefficients, per standard deviation
        # The coefficients are inverse (m − B e), and e is gain m. So their derivative by the means m has two parts.
        total_gain = -np.einsum("ipk,knj->ipjn", shifts, gain)
        for axis in range(3):
            total_gain[axis, :, axis] += inverse[axis]
        # Prediction leaves (1 − gain B) e of the errors e.
        remaining = shifts @ (np.eye(len(patterns)) - np.einsum("kni,lni->kl", gain, patterns))
        # The errors of a sweep's speed are not in this noise: the axes share them, and `_add_covariances` adds them.
        noise = _build_noise(self.variances_rad2_s2, shared_covariance_rad2_s2)
        return _add_covariances(solution, total_gain, remaining, noise, speed_noise), prediction.errors

    def _predict(self, matrix: Array, shared: Array | None) -> Prediction:
        speed_noise = propagate_speed_std(self.rates_rad_s, self.speed_std_rad_s, matrix)
        patterns = self.effects(matrix)
        gain, covariance = _gain(self.design, patterns, _build_noise(self.variances_rad2_s2 + speed_noise**2, shared))
        # The gain applies to the means themselves, because it maps what F, c and G explain to zero.
        sizes = np.einsum("pni,ni->p", gain, self.means_rad_s)
        errors = CommonErrors(sizes, covariance, np.einsum("p,pni->ni", sizes, patterns))
        return Prediction(errors, patterns, gain, speed_noise)


def _build_noise(variances: Array, shared: Array | None) -> Array:
    """Return the covariances (3, N, N) of each axis' means, from variances (N, 3) and a `shared` covariance (N, N)."""
    noise = np.array([np.diag(axis) for axis in variances.T])
    return noise if shared is None else noise + shared


def _gain(design: Array, effects: Array, noise: Array) -> tuple[Array, Array]:
    """Return the gain (P, N, 3) from readings with `noise` (3, N, N) to errors, and the errors' covariance (P, P)."""
    weights = np.linalg.inv(noise)
    weighted = weights @ design
    # The weights after removing what F, c and G explain (Frisch and Waugh, Econometrica 1 (1933) 387; Lovell 1963).
    reduced = weights - weighted @ np.linalg.solve(design.T @ weighted, np.swapaxes(weighted, -1, -2))
    patterns = np.moveaxis(effects, 2, 0)
    projected = patterns @ reduced  # (3, P, N)
    covariance = np.linalg.inv(np.eye(len(effects)) + np.sum(projected @ np.swapaxes(patterns, 1, 2), axis=0))
    return np.moveaxis(covariance @ projected, 0, 2), covariance


def _add_covariances(
    solution: VectorSolution, gain: Array, remaining: Array, noise: Array, speed_noise: Array
) -> VectorSolution:
    """Return the solution with the covariances and the response of all coefficients and errors, estimated together.

    `gain` (3, p, 3, N) maps readings to the coefficients; `remaining` (3, p, P) is the coefficients' error due to the
    unresolved part of the common errors. `noise` (3, N, N) excludes `speed_noise` (N, 3), which the three axes share.
    """
    columns = gain.shape[1]
    of_speed = np.einsum("ipjn,nj->ipn", gain, speed_noise).reshape(3 * columns, -1)
    by_axis = np.moveaxis(gain.reshape(3 * columns, 3, -1), 1, 0)
    raw = np.sum(by_axis @ noise @ np.swapaxes(by_axis, 1, 2), axis=0) + of_speed @ of_speed.T
    of_matrix, of_gravity = index_coefficients(columns)
    matrix_covariance = raw[of_matrix[:, None], of_matrix]
    to_parameters = parameter_jacobian(solution.matrix, solution.scale)
    to_angles = angle_jacobian(solution.scale[:, None] * solution.matrix, solution.scale, solution.mounting)
    of_errors = to_angles @ remaining[:, :3].reshape(9, -1)
    response = np.einsum("qr,rin->qni", to_parameters, gain.reshape(3 * columns, 3, -1)[of_matrix])
    return replace(
        solution,
        covariance=to_parameters @ matrix_covariance @ to_parameters.T,
        matrix_covariance=matrix_covariance,
        angles_covariance_rad2=to_angles @ matrix_covariance[:9, :9] @ to_angles.T + of_errors @ of_errors.T,
        g_sensitivity_covariance=raw[of_gravity[:, None], of_gravity] if columns > 4 else None,
        response=response,
    )
