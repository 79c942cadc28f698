"""Segments of a recording held against their model, whitened by all that is known of both."""

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from rig.analysis.consistency.alternatives import each_axis, in_time
from rig.analysis.consistency.residual_tests import TOLD, Statistic, Suspected, basis, explained, told_from
from rig.analysis.gyroscope.segments import Segments
from rig.estimation.arrays import Array
from rig.estimation.statistics.bias_process import BiasProcess


@dataclass(frozen=True, slots=True)
class Scatter:
    """Scatter of means beside a bias that wanders: `variances_rad2_s2` (N, 3) each for itself, and the errors that
    they share, independent patterns `shared_rad_s` (P, N, 3); `instability_rad_s` is that of the bias, if known."""

    variances_rad2_s2: Array
    shared_rad_s: Array
    instability_rad_s: float = 0.0

    @property
    def common_rad2_s2(self) -> Array:
        """(3, N, N) covariance of each axis' means by the errors that they share."""
        by_axis = np.moveaxis(self.shared_rad_s, -1, 0)
        return np.asarray(np.swapaxes(by_axis, 1, 2) @ by_axis, dtype=np.float64)


@dataclass(frozen=True, slots=True)
class WhitenedSegments:
    """Readings (3 N,) and the columns of the model (3 N, k) as `white` (3 N, 3 N) makes them."""

    white: Array
    seen: Array
    base: Array

    def explained(self, suspicions: Sequence[Array], beside: Sequence[Array]) -> list[float]:
        """How much better columns (3, N, k) explain the means: see `Held`."""
        return [self._told(columns, beside)[0] for columns in suspicions]

    def judged(self, columns: Array | None, beside: Sequence[Array], rate: float) -> Statistic | None:
        """The statistic of what columns explain, with its limit: see `Held`."""
        value, freedom = self._told(columns, beside)
        return (value, beyond_chance(rate)(freedom)) if freedom else None

    def most_by_one(self, columns: Array, rate: float) -> Statistic | None:
        """What the one of columns (3, N, k) explains that explains most; None where all of them are in the model."""
        alone = self._alone(columns)
        if not alone.shape[1]:
            return None
        known = basis(self.base)
        most = alone.T @ (self.seen - known @ (known.T @ self.seen))
        return float(np.max(most**2)), beyond_chance(rate / alone.shape[1])(1)

    def told_from(self, patterns: Array, suspected: Iterable[Suspected]) -> float:
        """The size from which on patterns (k, N, 3) are told by columns (3, N, c): see `suspicion`."""
        whitened = ((whiten(self.white, columns), limit) for columns, limit in suspected)
        return told_from(basis(self.base), whiten(self.white, np.moveaxis(patterns, 0, -1).swapaxes(0, 1)), whitened)

    def each_alone(self, columns: Array, rate: float) -> Iterator[Suspected]:
        """What `most_by_one` holds against each other, columns (3, N, 1) each."""
        limit = beyond_chance(rate / max(self._alone(columns).shape[1], 1))
        yield from ((column[..., None], limit) for column in np.moveaxis(columns, -1, 0))

    def _alone(self, columns: Array) -> Array:
        """(3 N, k) unit columns, each for itself less what the model holds of it; those that it holds are left out."""
        known, new = basis(self.base), whiten(self.white, columns)
        sizes = np.linalg.norm(new, axis=0)
        new = new - known @ (known.T @ new)
        left = np.linalg.norm(new, axis=0)
        told = left > TOLD * sizes
        return np.asarray(new[:, told] / left[told], dtype=np.float64)

    def _told(self, columns: Array | None, beside: Sequence[Array]) -> tuple[float, int]:
        base = np.concatenate([self.base, *(whiten(self.white, each) for each in beside)], axis=1)
        return explained(self.seen, base, None if columns is None else whiten(self.white, columns))


def beyond_chance(rate: float) -> Callable[[int], float]:
    """The limit that χ² with so many degrees of freedom exceeds in a share `rate` of recordings."""
    from scipy.special import chdtri

    return lambda freedom: float(chdtri(freedom, rate))


def whiten_segments(segments: Segments, scatter: Scatter, bias: BiasProcess) -> WhitenedSegments:
    white = whitening(segments, scatter, bias)
    seen = whiten(white, segments.means_rad_s.T[:, :, None])[:, 0]
    return WhitenedSegments(white, seen, whiten(white, each_axis(_known(segments))))


def _known(segments: Segments) -> Array:
    """(N, 8) columns of the model, for each axis alike."""
    ones = np.ones(len(segments.sweep))
    return np.column_stack([segments.rates_rad_s, ones, segments.gravity_m_s2, in_time(segments)])


def whitening(segments: Segments, scatter: Scatter, bias: BiasProcess) -> Array:
    """Return W (3 N, 3 N), which makes the means' errors independent and of variance 1, axis by axis.

    First the noise of each axis and a bias that wanders, then the errors that means share. These may be 10⁵ times the
    noise (a curve that is free on the ways), and one decomposition of both would lose the noise to rounding. No
    variance of the former is below the smallest noise: windows overlap when a computer's clock was put back between two
    recordings, and what is computed is no covariance.
    """
    count, wandering = len(segments.sweep), bias.covariance(segments.times_s)
    own, least = np.zeros((3, count, 3, count)), segments.variances_rad2_s2.min()
    for axis, noise in enumerate(scatter.variances_rad2_s2.T):
        variances, directions = np.linalg.eigh(np.diag(noise) + wandering)
        own[axis, :, axis] = directions.T / np.sqrt(np.maximum(variances, least))[:, None]
    white = own.reshape(3 * count, 3 * count)
    shared = whiten(white, np.moveaxis(scatter.shared_rad_s, 0, -1).swapaxes(0, 1))
    directions, sizes, _ = np.linalg.svd(shared, full_matrices=False)
    kept = 1 / np.hypot(1.0, sizes)
    return np.asarray(white - directions @ ((1 - kept)[:, None] * (directions.T @ white)), dtype=np.float64)


def whiten(white: Array, columns: Array) -> Array:
    """(3 N, k) columns (3, N, k) as `white` makes them."""
    return np.asarray(white @ columns.reshape(len(white), -1), dtype=np.float64)
