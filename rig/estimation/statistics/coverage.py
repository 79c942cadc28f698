"""Coverage: the factor k of a standard uncertainty u for which value ± k u contains the true value 95.45 times in 100.

If u is itself determined by few readings, k exceeds two: U = k u with k by Student's t for the effective degrees of
freedom ν (JCGM 100, G.3 and G.6.4; EA-4/02 M:2022, annex E). 95.45 % is the probability within two standard deviations
of a normal distribution, so k → 2 for ν → ∞.
"""

import math
from statistics import NormalDist

import numpy as np
from numpy.typing import ArrayLike

from rig.estimation.arrays import Array

COVERAGE_FACTOR = 2.0  # for ν → ∞, and if ν is not given
PROBABILITY = math.erf(COVERAGE_FACTOR / math.sqrt(2))
ELLIPSOID_PROBABILITY = 0.95
DOF_TOLERANCE = 1e-9  # ν would be an integer without rounding


def coverage_factors(dof: ArrayLike) -> Array:
    """Return the coverage factor k for degrees of freedom of any shape; they may be infinite."""
    whole_dof, factors = _round_down(dof), np.full(np.shape(dof), COVERAGE_FACTOR)
    if np.isfinite(whole_dof).any():
        from scipy.special import stdtrit

        finite = np.isfinite(whole_dof)
        factors[finite] = stdtrit(whole_dof[finite], (1 + PROBABILITY) / 2)
    return factors


def coverage_probability(factors: ArrayLike, dof: ArrayLike) -> Array:
    """Return the probability that value ± `factors` × u contains the true value; `dof` has the shape of `factors`."""
    return 1 - 2 * tail_probability(factors, dof)


def tail_probability(distances: ArrayLike, dof: ArrayLike) -> Array:
    """Return the one-sided probability that the true value is more than `distances` standard uncertainties away."""
    distance, whole_dof = np.broadcast_arrays(np.asarray(distances, dtype=np.float64), _round_down(dof))
    tails = np.array([math.erfc(value / math.sqrt(2)) / 2 for value in distance.ravel()]).reshape(distance.shape)
    if np.isfinite(whole_dof).any():
        from scipy.special import stdtr

        finite = np.isfinite(whole_dof)
        tails[finite] = stdtr(whole_dof[finite], -distance[finite])
    return tails


def false_alarm_of_each(of_all: float, tests: int) -> float:
    """Return the false-alarm probability of each of `tests` tests, if that of all tests together is to be `of_all`.

    Bonferroni's inequality also holds for dependent tests.
    """
    return of_all / tests


def joint_factors(values: int, dof: ArrayLike, probability: float) -> Array:
    """Return the simultaneous coverage factor k, by which all of `values` intervals ± k u contain their true values.

    The intervals do so with at least the given `probability`, by Bonferroni's inequality. `dof`: degrees of freedom of
    any shape. For one value and `PROBABILITY` the factor is that of `coverage_factors`.
    """
    whole_dof, tail = _round_down(dof), false_alarm_of_each(1 - probability, values) / 2
    factors = np.full(np.shape(dof), -NormalDist().inv_cdf(tail))
    if np.isfinite(whole_dof).any():
        from scipy.special import stdtrit

        finite = np.isfinite(whole_dof)
        factors[finite] = -stdtrit(whole_dof[finite], tail)
    return factors


def find_ellipsoid_factor(values: int, dof: ArrayLike) -> float:
    """Return the factor of the joint 95 % ellipsoid of `values` values, at the smallest of `dof`.

    For p values with a multivariate t distribution the factor is the root of p times the quantile of the F distribution
    for p and `dof` degrees of freedom; for a normal distribution it is the root of the quantile of χ² (JCGM 102, 6.5).
    """
    fewest = float(np.min(_round_down(dof)))
    if math.isinf(fewest):
        from scipy.special import chdtri

        return float(np.sqrt(chdtri(values, 1 - ELLIPSOID_PROBABILITY)))
    from scipy.special import fdtri

    return float(np.sqrt(values * fdtri(values, fewest, ELLIPSOID_PROBABILITY)))


def find_dof_by_factor(factor: float) -> float:
    """Return the integer degrees of freedom whose coverage factor is `factor`: infinite for 2."""
    if factor <= COVERAGE_FACTOR:
        return math.inf
    from scipy.special import stdtridf

    return float(round(stdtridf((1 + PROBABILITY) / 2, factor)))


def effective_dof(variances: ArrayLike, dof: ArrayLike) -> Array:
    """Return the dof (…) of sums of independent `variances` (n, …), by Welch–Satterthwaite (JCGM 100, G.4)."""
    parts, degrees = np.asarray(variances, dtype=np.float64), np.asarray(dof, dtype=np.float64)
    with np.errstate(divide="ignore", invalid="ignore"):
        effective = parts.sum(axis=0) ** 2 / np.sum(parts**2 / degrees, axis=0)
    dof_of_sums: Array = np.where(np.isnan(effective), np.inf, effective)  # 0/0 without variances
    return dof_of_sums


def _round_down(dof: ArrayLike) -> Array:
    """Return degrees of freedom as tabulated: the next lower whole number (JCGM 100, G.6.4), at least one."""
    rounded: Array = np.floor(np.maximum(np.asarray(dof, dtype=np.float64) * (1 + DOF_TOLERANCE), 1.0))
    return rounded
