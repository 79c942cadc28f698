"""Six-observation estimates of many runs at once, for studies: the equations of `six_observation`, vectorised.

Runs stand along the first axis. What cannot be solved is NaN and not marked as converged, so one bad run does not stop
fifteen thousand; the gates with names stand in `Accumulator.solve`, which does one run.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rig.estimation.arrays import Array
from rig.estimation.gyroscope.six_observation import ALGORITHM_1_LIMIT, ALGORITHM_1_TOLERANCE, NEWTON_LIMIT, design


@dataclass(frozen=True, slots=True)
class BatchSolution:
    """Scale (R, 3), bias_rad_s (R, 3), iterations (R,) and whether each run converged (R,)."""

    scale: Array
    bias_rad_s: Array
    iterations: NDArray[np.int64]
    converged: NDArray[np.bool_]


def newton_batch(means_rad_s: ArrayLike, speeds_rad_s: ArrayLike) -> BatchSolution:
    """The closed form, with Newton steps on γ where speeds differ: `by_newton` for every run.

    `means_rad_s` (R, N, 3); `speeds_rad_s` (N,) or (R, N).
    """
    means = np.asarray(means_rad_s, dtype=np.float64)
    centre = means.mean(axis=1)
    p, q, square = _responses(means - centre[:, None], speeds_rad_s)
    with np.errstate(all="ignore"):
        total = np.sum(q[:, 3:] ** 2 / (4 * q[:, :3]), axis=1)
        gamma = square * total / (1 + total)
        step = np.full(len(gamma), np.inf)
        steps = np.zeros(len(gamma), dtype=np.int64)
        for _ in range(NEWTON_LIMIT):
            active = np.abs(step) > 1e-13 * square
            if not active.any():
                break
            beta = p - gamma[:, None] * q
            bias = beta[:, 3:] / (2 * beta[:, :3])
            value = np.sum(beta[:, :3] * bias**2, axis=1) - gamma
            slope = np.sum(bias * (bias * q[:, :3] - q[:, 3:]), axis=1) - 1
            step = np.where(active, value / slope, step)
            gamma = np.where(active, gamma - step, gamma)
            steps += active
        found = np.abs(step) <= 1e-13 * square
        return _solution(p - gamma[:, None] * q, centre, steps, found)


def algorithm_1_batch(means_rad_s: ArrayLike, speeds_rad_s: ArrayLike) -> BatchSolution:
    """SIX, Algorithm 1, as published, for every run; `iterations` counts as `by_algorithm_1` does.

    Shapes as in `newton_batch`: `means_rad_s` (R, N, 3), `speeds_rad_s` (N,) or (R, N).
    """
    means = np.asarray(means_rad_s, dtype=np.float64)
    p, q, _ = _responses(means, speeds_rad_s)
    beta, last_change = p.copy(), np.full(len(p), np.inf)
    passes = np.ones(len(p), dtype=np.int64)
    active, converged = np.ones(len(p), dtype=np.bool_), np.zeros(len(p), dtype=np.bool_)
    with np.errstate(all="ignore"):
        for _ in range(2, ALGORITHM_1_LIMIT):
            at = np.flatnonzero(active)
            if not len(at):
                break
            gamma = np.sum(beta[at, 3:] ** 2 / (4 * beta[at, :3]), axis=1)
            improved = p[at] - gamma[:, None] * q[at]
            change = np.sum(np.abs(improved - beta[at]), axis=1)
            done = change <= ALGORITHM_1_TOLERANCE
            growing = ~done & ~(change < last_change[at])
            beta[at], last_change[at] = improved, change
            passes[at] += 1
            converged[at[done]] = True
            active[at[done | growing]] = False
        return _solution(beta, np.zeros((len(p), 3)), passes, converged)


def _responses(means: Array, speeds_rad_s: ArrayLike) -> tuple[Array, Array, Array]:
    """p = X⁺ω² and q = X⁺1, (R, 6) each, and the mean squared speed (R,)."""
    runs, count, _ = means.shape
    x = design(means)
    square = np.broadcast_to(np.asarray(speeds_rad_s, dtype=np.float64) ** 2, (runs, count))
    both = np.stack([square, np.ones((runs, count))], axis=-1)
    if count > 6:
        transposed = np.swapaxes(x, -1, -2)
        x, both = transposed @ x, transposed @ both
    answers = _solve(x, both)
    return answers[..., 0], answers[..., 1], square.mean(axis=1)


def _solve(matrices: Array, right: Array) -> Array:
    """(R, 6, 2), NaN for a singular matrix."""
    try:
        return np.asarray(np.linalg.solve(matrices, right), dtype=np.float64)
    except np.linalg.LinAlgError:
        usable = np.flatnonzero(np.isfinite(matrices).all(axis=(1, 2)))
        usable = usable[np.linalg.matrix_rank(matrices[usable]) == 6]
        answers = np.full_like(right, np.nan)
        answers[usable] = np.linalg.solve(matrices[usable], right[usable])
        return answers


def _solution(beta: Array, centre: Array, steps: NDArray[np.int64], solved: NDArray[np.bool_]) -> BatchSolution:
    squares = beta[:, :3]
    good = solved & np.all(squares > 0, axis=1)
    kept = np.where(good[:, None], beta, np.nan)
    return BatchSolution(np.sqrt(kept[:, :3]), kept[:, 3:] / (2 * kept[:, :3]) - centre, steps, good)
