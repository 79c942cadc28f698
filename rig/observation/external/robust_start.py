"""Robust initial values of a gyroscope's F, bias and clock, from a reference's rotations from row to row.

    ∫ m dt = F φ + b Δt        from t₁ + τ to t₂ + τ

Here m are the readings, b is the bias, F (3, 3) converts rates to readings, τ is the offset of the clock, and φ is the
rotation vector from the row at t₁ to the row at t₂, Δt later. The equation holds to second order for any φ below π,
however far apart the rows are. The fit minimises the sum of the residuals' lengths (least absolute deviations by
reweighting), over a grid of τ, so a few bad rows have no effect. Long rests have no effect either, because only pairs
of rows between which the body moves determine F and τ.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig.estimation.arrays import Array, integrate_rates, interpolate, rotation_vectors
from rig.estimation.external.attitude_drift import DriftState
from rig.observation.external.reference_rows import Turning

MIN_PAIR_S = 0.1  # between the rows of a pair, or one row
MAX_PAIR_RAD, MIN_PAIR_RAD = 2.6, 0.03  # rotation of a pair: less than π, and more than the errors of most references
MIN_ROTATION_RATIO = 0.2  # to the ninth decile of rotations, below which a pair counts as a rest
PAIRS, MIN_PAIRS = 600, 12  # largest number, smallest number
MAX_OFFSET_S, COARSE_S, FINE_S = 0.5, 0.02, 0.004  # range of the search for τ on either side, and its steps
REWEIGHTINGS = 4
# Fraction of the squared rotation about all axes: if an axis has less, F remains that of an aligned sensor about it.
MIN_ROTATION_FRACTION = 1e-4
MIN_EXPLAINED = 0.5  # fraction of the readings' variance, by F


@dataclass(frozen=True, slots=True)
class RobustStart:
    """Initial values, and the fraction of the readings' rotation that they leave `unexplained`.

    The fraction is 1 if nothing fits and the values are those of an aligned sensor.
    """

    state: DriftState
    unexplained: float


@dataclass(frozen=True, slots=True)
class _Pairs:
    """Pairs of rows: their times `begin_s` and `end_s` (k,), and the rotation vectors (k, 3) between them."""

    begin_s: Array
    end_s: Array
    rotations: Array


def find_start(turning: Turning) -> RobustStart:
    """Return initial values of matrix, bias and clock; if none fit, those of an aligned sensor on the same clock."""
    aligned = RobustStart(DriftState(np.eye(3), np.zeros(3), 0.0), 1.0)
    pairs = _find_pairs(turning)
    if len(pairs.begin_s) < MIN_PAIRS:
        return aligned
    time_s, readings = turning.time_s, turning.readings_rad_s
    total = integrate_rates(time_s, readings)

    def fit(clock_s: float) -> tuple[float, Array]:
        begin_s, end_s = pairs.begin_s + clock_s, pairs.end_s + clock_s
        some = (begin_s >= time_s[0]) & (end_s <= time_s[-1])
        if some.sum() < MIN_PAIRS:
            return np.inf, np.zeros((4, 3))
        turned = interpolate(end_s[some], time_s, total) - interpolate(begin_s[some], time_s, total)
        return _fit(np.column_stack([pairs.rotations[some], (end_s - begin_s)[some]]), turned)

    best_s = min(np.arange(-MAX_OFFSET_S, MAX_OFFSET_S + COARSE_S / 2, COARSE_S), key=lambda clock_s: fit(clock_s)[0])
    best_s = min(best_s + np.arange(-COARSE_S, COARSE_S + FINE_S / 2, FINE_S), key=lambda clock_s: fit(clock_s)[0])
    unexplained, solution = fit(float(best_s))
    if unexplained > 1 - MIN_EXPLAINED:
        return aligned
    return RobustStart(
        DriftState(np.asarray(solution[:3].T, dtype=np.float64), solution[3], float(best_s)), unexplained
    )


def _find_pairs(turning: Turning) -> _Pairs:
    """Return pairs of rows in close succession: at most `PAIRS` with motion between the rows, and as many at rest."""
    middles_s = turning.rows_s.mean(axis=1)
    later = np.searchsorted(middles_s, middles_s + MIN_PAIR_S)
    later = np.maximum(later, np.arange(len(middles_s)) + 1)
    first = np.flatnonzero(later < len(middles_s))
    last = later[first]
    rotations = rotation_vectors(np.swapaxes(turning.attitudes[first], -1, -2) @ turning.attitudes[last])
    angles = np.linalg.norm(rotations, axis=1)
    usual_s = np.median(middles_s[last] - middles_s[first]) if len(first) else 0.0
    near = (middles_s[last] - middles_s[first] <= 2 * usual_s) & (angles < MAX_PAIR_RAD)
    if not near.any():
        return _Pairs(np.zeros(0), np.zeros(0), np.zeros((0, 3)))
    moving = near & (angles >= max(MIN_ROTATION_RATIO * float(np.quantile(angles[near], 0.9)), MIN_PAIR_RAD))
    chosen = np.concatenate([_select_evenly(np.flatnonzero(part)) for part in (moving, near & ~moving)])
    if moving.sum() < MIN_PAIRS:
        chosen = np.zeros(0, dtype=np.intp)
    return _Pairs(middles_s[first[chosen]], middles_s[last[chosen]], rotations[chosen])


def _select_evenly(indices: NDArray[np.intp]) -> NDArray[np.intp]:
    """Return at most `PAIRS` of the given indices, evenly spaced."""
    return indices if len(indices) <= PAIRS else indices[np.linspace(0, len(indices) - 1, PAIRS).astype(np.intp)]


def _fit(design: Array, turned: Array) -> tuple[float, Array]:
    """Return the fraction of `turned` (k, 3), without bias, that the fit `design` · X leaves unexplained, and X (4, 3).

    `design` is (k, 4). The first three rows of X are Fᵀ, and the last row is the bias b.
    """
    aligned = np.concatenate([np.eye(3), np.zeros((1, 3))])
    weight = np.ones(len(design))
    solution = aligned
    for _ in range(REWEIGHTINGS):
        weighted = design * weight[:, None]
        information = weighted.T @ design
        ridge = np.diag([MIN_ROTATION_FRACTION * float(np.trace(information[:3, :3]))] * 3 + [1e-12])
        solution = np.linalg.solve(information + ridge, weighted.T @ turned + ridge @ aligned)
        residuals = np.linalg.norm(turned - design @ solution, axis=1)
        weight = 1 / np.maximum(residuals, 0.1 * max(float(np.median(residuals)), 1e-9))
        weight /= weight.max()
    centred = np.linalg.norm(turned - design[:, 3:] @ solution[3:], axis=1).sum()
    unexplained = residuals.sum()  # pyrefly: ignore[unbound-name]  # REWEIGHTINGS > 0
    return float(unexplained / max(centred, 1e-12)), np.asarray(solution, dtype=np.float64)
