"""Segments of a recording and their model, whitened by all modelled errors."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from rig.analysis.consistency.alternatives import normalise_time, repeat_per_axis
from rig.analysis.consistency.residual_tests import (
    MIN_INDEPENDENT_PART,
    Alternative,
    Statistic,
    chi_square_of,
    minimal_detectable_size,
    orthonormal_basis,
)
from rig.analysis.gyroscope.segment_table import Segments
from rig.estimation.arrays import Array
from rig.estimation.statistics.bias_process import BiasProcess


@dataclass(frozen=True, slots=True)
class Scatter:
    """The errors of N means.

    - variances_rad2_s2 (N, 3): the variances of errors that are independent in every mean.
    - shared_rad_s (P, N, 3): the effects of P independent errors that means share, one standard deviation each.
    - instability_rad_s: the least Allan deviation of the bias, from which drift is computed; 0 if unknown.
    """

    variances_rad2_s2: Array
    shared_rad_s: Array
    instability_rad_s: float = 0.0

    @property
    def common_rad2_s2(self) -> Array:
        """The covariance (3, N, N) of each axis' means that is due to the shared errors."""
        by_axis = np.moveaxis(self.shared_rad_s, -1, 0)
        return np.asarray(np.swapaxes(by_axis, 1, 2) @ by_axis, dtype=np.float64)


@dataclass(frozen=True, eq=False)
class WhitenedSegments:
    """Whitened segments: the `whitener` (3 N, 3 N), readings (3 N,) and model columns (3 N, k)."""

    whitener: Array
    readings: Array
    model: Array

    @cached_property
    def basis(self) -> Array:
        """An orthonormal basis (3 N, p) of the model."""
        return orthonormal_basis(self.model)

    def chi_square_of(self, alternatives: Sequence[Array], nuisance: Sequence[Array]) -> list[float]:
        """Return the χ² of each alternative (3, N, k), with the columns `nuisance` added to the model."""
        basis = self._extend_basis(nuisance)
        return [
            chi_square_of(self.readings, basis, apply_whitener(self.whitener, columns))[0] for columns in alternatives
        ]

    def test(
        self, columns: Array | None, nuisance: Sequence[Array], false_alarm_probability: float
    ) -> Statistic | None:
        """Return the χ² that columns explain, and its critical value; None if the model spans the columns.

        The model is extended by the columns `nuisance`. If `columns` is None, the χ² is that of all residuals.
        """
        whitened = None if columns is None else apply_whitener(self.whitener, columns)
        value, dof = chi_square_of(self.readings, self._extend_basis(nuisance), whitened)
        return (value, critical_value(false_alarm_probability)(dof)) if dof else None

    def test_single_columns(self, columns: Array, false_alarm_probability: float) -> Statistic | None:
        """Return the largest χ² of a single column (3, N, k) and its critical value; None if all lie in the model."""
        columns = self._independent_columns(columns)
        if not columns.shape[1]:
            return None
        projections = columns.T @ (self.readings - self.basis @ (self.basis.T @ self.readings))
        return float(np.max(projections**2)), critical_value(false_alarm_probability / columns.shape[1])(1)

    def minimal_detectable_size(self, patterns: Array, alternatives: Iterable[Alternative]) -> float:
        """Return the smallest size of a fault that a test of one of the `alternatives` detects.

        `patterns` (k, N, 3) are the changes of the means by one unit of the fault. An alternative is a pair of columns
        (3, N, c) and the critical value of their test.
        """
        whitened = ((apply_whitener(self.whitener, columns), limit) for columns, limit in alternatives)
        return minimal_detectable_size(
            self.basis,
            apply_whitener(self.whitener, np.moveaxis(patterns, 0, -1).swapaxes(0, 1)),
            whitened,
        )

    def single_column_alternatives(self, columns: Array, false_alarm_probability: float) -> Iterator[Alternative]:
        """Yield the alternatives that `test_single_columns` tests: every single column (3, N, 1), and its limit."""
        limit = critical_value(false_alarm_probability / max(self._independent_columns(columns).shape[1], 1))
        yield from ((column[..., None], limit) for column in np.moveaxis(columns, -1, 0))

    def _independent_columns(self, columns: Array) -> Array:
        """Return the parts outside the model of whitened columns, as unit columns (3 N, k); zero parts are dropped."""
        new = apply_whitener(self.whitener, columns)
        sizes = np.linalg.norm(new, axis=0)
        new = new - self.basis @ (self.basis.T @ new)
        lengths = np.linalg.norm(new, axis=0)
        independent = lengths > MIN_INDEPENDENT_PART * sizes
        return np.asarray(new[:, independent] / lengths[independent], dtype=np.float64)

    def _extend_basis(self, nuisance: Sequence[Array]) -> Array:
        """Return an orthonormal basis of the model and the nuisance columns."""
        if not nuisance:
            return self.basis
        whitened = (apply_whitener(self.whitener, columns) for columns in nuisance)
        return orthonormal_basis(np.concatenate([self.model, *whitened], axis=1))


def critical_value(false_alarm_probability: float) -> Callable[[int], float]:
    """Return the critical value of χ² as a function of its degrees of freedom, for this false-alarm probability."""
    from scipy.special import chdtri

    return lambda dof: float(chdtri(dof, false_alarm_probability))


def whiten_segments(segments: Segments, scatter: Scatter, bias: BiasProcess) -> WhitenedSegments:
    """Return the means of segments and the columns of their model, whitened by the scatter and the bias drift."""
    whitener = build_whitener(segments, scatter, bias)
    readings = apply_whitener(whitener, segments.means_rad_s.T[:, :, None])[:, 0]
    return WhitenedSegments(whitener, readings, apply_whitener(whitener, repeat_per_axis(_model_columns(segments))))


def _model_columns(segments: Segments) -> Array:
    """Return the columns (N, 8) of the model, which are the same for each axis: rates, bias, gravity, steady drift."""
    ones = np.ones(len(segments.sweep))
    return np.column_stack([segments.rates_rad_s, ones, segments.gravity_m_s2, normalise_time(segments)])


def build_whitener(segments: Segments, scatter: Scatter, bias: BiasProcess) -> Array:
    """Return the whitener W (3 N, 3 N), which makes the means' errors independent with variance 1.

    Noise and bias drift of each axis are whitened first, then the shared errors. Shared errors may be 10⁵ times the
    noise (a free nonlinearity), so one decomposition of both would lose the noise to rounding.
    """
    count, bias_covariance = len(segments.sweep), bias.covariance(segments.times_s)
    noise_whitener, least = np.zeros((3, count, 3, count)), segments.variances_rad2_s2.min()
    for axis, noise in enumerate(scatter.variances_rad2_s2.T):
        # If a clock was set back, windows overlap, and the drift's matrix is no covariance: its variances are limited.
        variances, directions = np.linalg.eigh(np.diag(noise) + bias_covariance)
        noise_whitener[axis, :, axis] = directions.T / np.sqrt(np.maximum(variances, least))[:, None]
    whitener = noise_whitener.reshape(3 * count, 3 * count)
    shared = apply_whitener(whitener, np.moveaxis(scatter.shared_rad_s, 0, -1).swapaxes(0, 1))
    directions, sizes, _ = np.linalg.svd(shared, full_matrices=False)
    kept = 1 / np.hypot(1.0, sizes)
    return np.asarray(whitener - directions @ ((1 - kept)[:, None] * (directions.T @ whitener)), dtype=np.float64)


def apply_whitener(whitener: Array, columns: Array) -> Array:
    """Return whitened columns, from (3, N, k) to (3 N, k)."""
    return np.asarray(whitener @ columns.reshape(len(whitener), -1), dtype=np.float64)
