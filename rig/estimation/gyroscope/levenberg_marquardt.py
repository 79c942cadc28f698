"""The six-observation model solved by Levenberg–Marquardt, with which the paper SIX compares its Algorithm 1.

The residuals are ω² − ‖K (m + b)‖², Eqs. (2)–(4), weighted if weights are given. The unknowns are the six parameters
themselves, without β0. With six sweeps the solution equals that of `closed_form`, except for rounding.
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from rig.errors import Fault
from rig.estimation import refusals
from rig.estimation.arrays import Array
from rig.estimation.gyroscope.six_observation import design, negative_square

MAX_CONDITION = 40.0  # above `accumulator`'s 30: directions that contain only noise are excluded before
MIN_SCALE_RATIO = 0.05  # to the largest scale factor: below it, the fit would take a negative square
REMEDY = "Sweep every wrist in both directions; a second sweep in one direction cannot replace the other direction"


@dataclass(frozen=True, slots=True)
class LevenbergMarquardtSolution:
    """A solution of rate = scale × (reading + bias_rad_s); covariance (6, 6) of scale (3,), then bias_rad_s (3,).

    `iterations` counts evaluations of the model. `rank` and `condition` belong to the scaled design.
    """

    scale: Array
    bias_rad_s: Array
    covariance: Array
    observations: int
    rank: int
    condition: float
    iterations: int
    warnings: tuple[str, ...]
    estimator: Literal["levenberg_marquardt"] = "levenberg_marquardt"


def solve_levenberg_marquardt(
    means_rad_s: ArrayLike,
    speeds_rad_s: ArrayLike,
    variances_rad2_s2: ArrayLike,
    *,
    speed_std_rad_s: ArrayLike | None = None,
    weighted: bool = True,
) -> LevenbergMarquardtSolution:
    """Return the six-observation solution by `scipy.optimize.least_squares(method="lm")` with the exact Jacobian.

    The search begins at unit scale factors and, as the bias, the negative mean of the readings.

    `means_rad_s`, `variances_rad2_s2` (N, 3): mean readings of N ≥ 6 sweeps and the variances of these means;
    `speeds_rad_s`, `speed_std_rad_s` (N,). If `weighted`, the weights are the inverse variances of the residuals for
    unit scale factors; otherwise they are equal, as in the paper SIX.

    Raise Fault `too_few_observations`, `not_finite`, `bad_variance`, `bad_speed`, `zero_reading`,
    `duplicated_observation`, `lm_did_not_converge`, `rank_deficient`, `ill_conditioned`, `wrong_unit`,
    `negative_square`.
    """
    from scipy.optimize import least_squares

    means, speeds, variances = (np.asarray(a, dtype=np.float64) for a in (means_rad_s, speeds_rad_s, variances_rad2_s2))
    speed_std = np.zeros(len(means)) if speed_std_rad_s is None else np.asarray(speed_std_rad_s, dtype=np.float64)
    refusals.check_revolutions(means, speeds, variances, speed_std)
    refusals.check_count(len(means), 6, 6)
    refusals.check_duplicates(means)
    centred = means - means.mean(axis=0)
    length = float(np.sqrt(np.mean(np.sum(centred**2, axis=1))))
    conditioning = _conditioning(centred / length, float(np.sqrt(variances.max())) / length)
    refusals.check_conditioning(conditioning, 6, MAX_CONDITION, "scale or bias", REMEDY)
    refusals.check_unit(np.full(3, np.sqrt(np.mean(speeds**2)) / length))
    by_speed = (2 * speeds * speed_std) ** 2
    std = np.sqrt(4 * speeds**2 * variances.mean(axis=1) + by_speed) if weighted else np.ones(len(means))

    def residual(theta: Array) -> Array:
        return (speeds**2 - compute_squared_rate(theta, means)) / std

    def slope(theta: Array) -> Array:
        return -compute_squared_rate_jacobian(theta, means) / std[:, None]

    # From b = 0 the search diverges if the bias is about as large as the speed.
    start = np.concatenate([np.ones(3), -means.mean(axis=0)])
    minimum = least_squares(
        residual, start, slope, method="lm", x_scale="jac", ftol=1e-15, xtol=1e-15, gtol=1e-15, max_nfev=1000
    )
    if not minimum.success:
        raise Fault(
            "lm_did_not_converge",
            "Levenberg–Marquardt did not find a minimum",
            "Use the estimator newton; check that the readings fit the speeds",
        )
    theta = np.concatenate([np.abs(minimum.x[:3]), minimum.x[3:]])  # only k² is identifiable
    weakest = int(np.argmin(theta[:3]))
    if theta[weakest] < MIN_SCALE_RATIO * theta[:3].max():
        raise negative_square(weakest)  # the best k² is negative, so the fit ends at its bound k = 0
    refusals.check_unit(theta[:3])
    weighted_jacobian = slope(theta)
    gain = np.linalg.solve(weighted_jacobian.T @ weighted_jacobian, weighted_jacobian.T) / std
    variance = compute_squared_rate_variance(theta, means, variances) + by_speed
    residuals = speeds**2 - compute_squared_rate(theta, means)
    return LevenbergMarquardtSolution(
        scale=theta[:3],
        bias_rad_s=theta[3:],
        covariance=(gain * variance) @ gain.T,
        observations=len(means),
        rank=conditioning.rank,
        condition=conditioning.condition,
        iterations=int(minimum.nfev),
        warnings=refusals.warn_of_residuals(residuals, variance, len(means) - 6),
    )


def _conditioning(unit_means: Array, noise: float) -> refusals.Conditioning:
    """Return the conditioning of the design of Eq. (7) for centred readings of RMS length 1 with this `noise`."""
    # The square of a reading of length 1 has twice the noise of the reading.
    return refusals.condition_of(design(unit_means), 6, 2 * noise * float(np.sqrt(len(unit_means))))


def compute_squared_rate(theta: Array, means: Array) -> Array:
    """Return ‖K (m + b)‖² (N,) of mean readings m (N, 3) for `theta` = [k b] and K = diag(k); Eqs. (1), (2) of SIX."""
    return np.asarray(np.sum((theta[:3] * (means + theta[3:])) ** 2, axis=-1), dtype=np.float64)


def compute_squared_rate_jacobian(theta: Array, means: Array) -> Array:
    """Return the derivative (N, 6) of `compute_squared_rate` with respect to `theta`."""
    k, shifted = theta[:3], means + theta[3:]
    return np.concatenate([2 * k * shifted**2, 2 * k**2 * shifted], axis=-1)


def compute_squared_rate_variance(theta: Array, means: Array, variances: Array) -> Array:
    """Propagate the variances (N, 3) of the mean readings to the variance (N,) of the squared rate, to first order."""
    k, shifted = theta[:3], means + theta[3:]
    return np.asarray(np.sum(4 * k**4 * shifted**2 * variances, axis=-1), dtype=np.float64)
