"""Six-observation estimates of many runs at once, for studies: the equations of `six_observation`, vectorised.

Runs are along the first axis. If a run has no solution, its values are NaN and it is not marked as converged.
`Accumulator.solve` solves one run and raises named faults.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rig.estimation.arrays import Array
from rig.estimation.gyroscope.six_observation import ALGORITHM_1_LIMIT, ALGORITHM_1_TOLERANCE, NEWTON_LIMIT, design


@dataclass(frozen=True, slots=True)
class BatchSolution:
    """The solutions of R runs: `scale` and `bias_rad_s` (R, 3), number of `iterations` (R,), and `converged` (R,)."""

    scale: Array
    bias_rad_s: Array
    iterations: NDArray[np.int64]
    converged: NDArray[np.bool_]


def newton_batch(means_rad_s: ArrayLike, speeds_rad_s: ArrayLike) -> BatchSolution:
    """Return the solutions of all runs: the closed form, then Newton steps if speeds differ (`solve_by_newton`).

    The means are (R, N, 3), the speeds (N,) or (R, N).
    """
    means = np.asarray(means_rad_s, dtype=np.float64)
    centre = means.mean(axis=1)
    p, q, square = _responses(means - centre[:, None], speeds_rad_s)
    with np.errstate(all="ignore"):
        total = np.sum(q[:, 3:] ** 2 / (4 * q[:, :3]), axis=1)
        gamma = square * total / (1 + total)  # the closed form, exact if all speeds are equal
        step = np.full(len(gamma), np.inf)
        steps = np.zeros(len(gamma), dtype=np.int64)
        for _ in range(NEWTON_LIMIT):
            active = np.abs(step) > 1e-13 * square
            if not active.any():
                break
            beta = p - gamma[:, None] * q
            bias = beta[:, 3:] / (2 * beta[:, :3])
            value = np.sum(beta[:, :3] * bias**2, axis=1) - gamma  # Γ(β) − γ
            slope = np.sum(bias * (bias * q[:, :3] - q[:, 3:]), axis=1) - 1  # its derivative by γ
            step = np.where(active, value / slope, step)
            gamma = np.where(active, gamma - step, gamma)
            steps += active
        converged = np.abs(step) <= 1e-13 * square
        return _solution(p - gamma[:, None] * q, centre, steps, converged)


def algorithm_1_batch(means_rad_s: ArrayLike, speeds_rad_s: ArrayLike) -> BatchSolution:
    """Return the solutions of all runs by the paper's Algorithm 1; passes count as in `solve_by_algorithm_1`.

    The means are (R, N, 3), the speeds (N,) or (R, N).
    """
    means = np.asarray(means_rad_s, dtype=np.float64)
    p, q, _ = _responses(means, speeds_rad_s)
    beta, last_change = p.copy(), np.full(len(p), np.inf)
    passes = np.ones(len(p), dtype=np.int64)
    active, converged = np.ones(len(p), dtype=np.bool_), np.zeros(len(p), dtype=np.bool_)
    with np.errstate(all="ignore"):
        for _ in range(2, ALGORITHM_1_LIMIT):
            rows = np.flatnonzero(active)
            if not len(rows):
                break
            gamma = np.sum(beta[rows, 3:] ** 2 / (4 * beta[rows, :3]), axis=1)
            improved = p[rows] - gamma[:, None] * q[rows]
            change = np.sum(np.abs(improved - beta[rows]), axis=1)
            done = change <= ALGORITHM_1_TOLERANCE
            growing = ~done & ~(change < last_change[rows])  # these runs diverge
            beta[rows], last_change[rows] = improved, change
            passes[rows] += 1
            converged[rows[done]] = True
            active[rows[done | growing]] = False
        return _solution(beta, np.zeros((len(p), 3)), passes, converged)


def _responses(means: Array, speeds_rad_s: ArrayLike) -> tuple[Array, Array, Array]:
    """Return p and q of `six_observation`, (R, 6) each, and the mean squared speed (R,)."""
    runs, count, _ = means.shape
    x = design(means)
    square = np.broadcast_to(np.asarray(speeds_rad_s, dtype=np.float64) ** 2, (runs, count))
    right_sides = np.stack([square, np.ones((runs, count))], axis=-1)
    if count > 6:
        transposed = np.swapaxes(x, -1, -2)
        x, right_sides = transposed @ x, transposed @ right_sides
    solutions = _solve(x, right_sides)
    return solutions[..., 0], solutions[..., 1], square.mean(axis=1)


def _solve(matrices: Array, right: Array) -> Array:
    """Return the solutions (R, 6, 2) of linear systems for two right-hand sides each, NaN for a singular matrix."""
    try:
        return np.asarray(np.linalg.solve(matrices, right), dtype=np.float64)
    except np.linalg.LinAlgError:
        usable = np.flatnonzero(np.isfinite(matrices).all(axis=(1, 2)))
        usable = usable[np.linalg.matrix_rank(matrices[usable]) == 6]
        solutions = np.full_like(right, np.nan)
        solutions[usable] = np.linalg.solve(matrices[usable], right[usable])
        return solutions


def _solution(beta: Array, centre: Array, steps: NDArray[np.int64], solved: NDArray[np.bool_]) -> BatchSolution:
    squares = beta[:, :3]
    valid = solved & np.all(squares > 0, axis=1)
    beta = np.where(valid[:, None], beta, np.nan)
    return BatchSolution(np.sqrt(beta[:, :3]), beta[:, 3:] / (2 * beta[:, :3]) - centre, steps, valid)
