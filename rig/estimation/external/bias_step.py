"""A step of a gyroscope's bias between two rows of stated motion: a mean-shift test.

    m_j = F ω_j + c + h [j > r] + noise

One step r at a time is added to the least-squares fit of all rows, and its F-test compares the sums of squares with and
without it (Quandt, J. Am. Stat. Assoc. 55 (1960) 324). Errors of the stated rates count as noise, in proportion to the
rate.
"""

from dataclasses import dataclass

import numpy as np

from rig.estimation.arrays import Array

FALSE_ALARM = 1e-5  # of recordings without a step
STATED = 1e-3  # relative error of a stated rate, beside the noise of its mean
EITHER_SIDE = 2  # rows at least: a single row that differs is a wrong row
MAX_CONDITION = 1e3


@dataclass(frozen=True, slots=True)
class SteppedBias:
    """A step by `size_rad_s` (3,) before the row of index `row`."""

    row: int
    size_rad_s: Array


def find_bias_step(means: Array, variances: Array, rates_rad_s: Array) -> SteppedBias | None:
    """Return the bias step that rows in the order of time show, or None.

    `means` (N, 3) of the readings, their `variances` (N, 3) and the stated rates (N, 3), zero at rest.
    """
    from scipy.special import fdtrc

    count = len(means)
    dof = 3 * (count - 5)
    if dof <= 0:
        return None
    speeds = np.linalg.norm(rates_rad_s, axis=1)
    std = np.sqrt(variances.mean(axis=1) + (STATED * speeds) ** 2)
    design = np.column_stack([rates_rad_s, np.ones(count)]) / std[:, None]
    observed = means / std[:, None]
    without = _sum_of_squares(design, observed)[0]
    best, step = FALSE_ALARM / count, None
    for row in range(EITHER_SIDE, count - EITHER_SIDE + 1):
        widened = np.column_stack([design, (np.arange(count) >= row) / std])
        sizes = np.linalg.norm(widened, axis=0)
        if not sizes.all() or np.linalg.cond(widened / sizes) > MAX_CONDITION:
            continue
        squares, fitted = _sum_of_squares(widened, observed)
        probability = float(fdtrc(3, dof, (without - squares) / 3 / max(squares / dof, np.finfo(float).tiny)))
        if probability < best:
            best, step = probability, SteppedBias(row, fitted[-1])
    return step


def _sum_of_squares(design: Array, observed: Array) -> tuple[float, Array]:
    """Return the sum of squared residuals of a least-squares fit, and its coefficients (p, 3)."""
    fitted = np.linalg.lstsq(design, observed, rcond=None)[0]
    return float(np.sum((observed - design @ fitted) ** 2)), np.asarray(fitted, dtype=np.float64)
