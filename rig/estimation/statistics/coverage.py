"""Coverage: by what a standard uncertainty u is multiplied, so that value ± U holds the true value 95.45 times in 100.

An uncertainty that is itself known from few readings needs more than two of it: U = k u with k of Student's t for the
effective degrees of freedom ν (JCGM 100, G.3 and G.6.4; EA-4/02 M:2022, annex E). 95.45 % is what two standard
deviations of a normal distribution hold, so that k goes to 2 where ν has no end.
"""

import math
from statistics import NormalDist

import numpy as np
from numpy.typing import ArrayLike

from rig.estimation.arrays import Array

COVERAGE_FACTOR = 2.0  # for ν → ∞, and where nobody counts ν
PROBABILITY = math.erf(COVERAGE_FACTOR / math.sqrt(2))
ROUNDING = 1e-9  # of ν, which may be a whole number but for the arithmetic


def coverage_factors(freedom: ArrayLike) -> Array:
    """k for degrees of freedom of any shape, infinite ones among them."""
    whole, factors = _whole(freedom), np.full(np.shape(freedom), COVERAGE_FACTOR)
    if np.isfinite(whole).any():
        from scipy.special import stdtrit

        known = np.isfinite(whole)
        factors[known] = stdtrit(whole[known], (1 + PROBABILITY) / 2)
    return factors


def covered(factors: ArrayLike, freedom: ArrayLike) -> Array:
    """The probability that value ± k u holds the true value, for k and ν of one shape."""
    return 1 - 2 * beyond(factors, freedom)


def beyond(distances: ArrayLike, freedom: ArrayLike) -> Array:
    """The probability that the true value lies farther than this on one side, in standard uncertainties."""
    away, whole = np.broadcast_arrays(np.asarray(distances, dtype=np.float64), _whole(freedom))
    found = np.array([math.erfc(each / math.sqrt(2)) / 2 for each in away.ravel()]).reshape(away.shape)
    if np.isfinite(whole).any():
        from scipy.special import stdtr

        known = np.isfinite(whole)
        found[known] = stdtr(whole[known], -away[known])
    return found


def false_alarm_of_each(of_all: float, tests: int) -> float:
    """Return the rate of false alarms of each of so many `tests`, so that one of them at least is rarer than `of_all`.

    Bonferroni's inequality: it holds however the tests depend on each other.
    """
    return of_all / tests


def joint_factors(values: int, freedom: ArrayLike, probability: float) -> Array:
    """Return the simultaneous coverage factor: k so that all of `values` intervals ± k u hold their true values.

    With a probability of 95.45 % at least, by Bonferroni's inequality. `freedom`: degrees of freedom of any shape; for
    one value k is that of `coverage_factors`.
    """
    whole, tail = _whole(freedom), false_alarm_of_each(1 - probability, values) / 2
    factors = np.full(np.shape(freedom), -NormalDist().inv_cdf(tail))
    if np.isfinite(whole).any():
        from scipy.special import stdtrit

        known = np.isfinite(whole)
        factors[known] = -stdtrit(whole[known], tail)
    return factors


def freedom_of(factor: float) -> float:
    """Return the whole number of degrees of freedom whose coverage factor this is: infinite for 2."""
    if factor <= COVERAGE_FACTOR:
        return math.inf
    from scipy.special import stdtridf

    return float(round(stdtridf((1 + PROBABILITY) / 2, factor)))


def effective_freedom(variances: ArrayLike, freedom: ArrayLike) -> Array:
    """ν (…) of sums of independent `variances` (n, …), each known with `freedom` (n, …): Welch–Satterthwaite.

    JCGM 100, G.4.1; infinite where all are known.
    """
    parts, known = np.asarray(variances, dtype=np.float64), np.asarray(freedom, dtype=np.float64)
    with np.errstate(divide="ignore", invalid="ignore"):
        found = parts.sum(axis=0) ** 2 / np.sum(parts**2 / known, axis=0)
    freedom_of_sums: Array = np.where(np.isnan(found), np.inf, found)  # of nothing at all
    return freedom_of_sums


def _whole(freedom: ArrayLike) -> Array:
    """ν as a table has it: the next lower whole number (JCGM 100, G.6.4), one at least."""
    whole: Array = np.floor(np.maximum(np.asarray(freedom, dtype=np.float64) * (1 + ROUNDING), 1.0))
    return whole
