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
    """Scatter of means beside a bias that wanders: `variances_rad2_s2` (N, 3) each for itself, and what they have
    in common, `common_rad2_s2` (3 N, 3 N); `instability_rad_s` is that of the bias, as far as it is known."""

    variances_rad2_s2: Array
    common_rad2_s2: Array
    instability_rad_s: float = 0.0


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
    white = whitening(covariance_of(segments, scatter, bias), segments.variances_rad2_s2.min())
    seen = whiten(white, segments.means_rad_s.T[:, :, None])[:, 0]
    return WhitenedSegments(white, seen, whiten(white, each_axis(_known(segments))))


def covariance_of(segments: Segments, scatter: Scatter, bias: BiasProcess) -> Array:
    """(3 N, 3 N) covariance of the segments' means, axis by axis: their scatter, and a bias that wanders."""
    each, count = np.arange(3), len(segments.sweep)
    covariance = scatter.common_rad2_s2.reshape(3, count, 3, count).copy()
    noise = np.array([np.diag(each) for each in scatter.variances_rad2_s2.T])
    covariance[each, :, each] += noise + bias.covariance(segments.times_s)
    return covariance.reshape(3 * count, 3 * count)


def together(off: Array) -> Array:
    """(3 N, 3 N) covariance of independent patterns (P, N, 3)."""
    columns = np.moveaxis(off, 0, -1).swapaxes(0, 1).reshape(-1, len(off))
    return np.asarray(columns @ columns.T, dtype=np.float64)


def _known(segments: Segments) -> Array:
    """(N, 8) columns of the model, for each axis alike."""
    ones = np.ones(len(segments.sweep))
    return np.column_stack([segments.rates_rad_s, ones, segments.gravity_m_s2, in_time(segments)])


def whitening(covariance: Array, least: float) -> Array:
    """(3 N, 3 N) what makes noise of that covariance one and independent; no variance is below `least`.

    Windows overlap when a computer's clock was put back between two recordings, and what is computed is no covariance.
    """
    variances, directions = np.linalg.eigh(covariance)
    return np.asarray(directions.T / np.sqrt(np.maximum(variances, least))[:, None], dtype=np.float64)


def whiten(white: Array, columns: Array) -> Array:
    """(3 N, k) columns (3, N, k) as `white` makes them."""
    return np.asarray(white @ columns.reshape(len(white), -1), dtype=np.float64)
