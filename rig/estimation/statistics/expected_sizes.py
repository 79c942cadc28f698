"""What only the readings tell the size of, beside errors that they share: expected, not likeliest.

How far an arm is off, how far a bias walks, and what disturbed one dwell alone: as
`rig.estimation.statistics.bias_process` and `rig.estimation.reference.shared_errors`, together. Few readings tell any;
the likeliest would by chance be none at all in one run and too large in the next, and so would be every uncertainty.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from rig.estimation.arrays import Array

WALKS = 12  # on their grid
SPAN = 100.0  # largest walk over the smallest
SMALLEST_RAD, LARGEST_RAD, SIZES = 1e-5, 0.03, 25  # of δ: no arm is better than the first

OWN_SHARES = (0.001, 0.01, 0.1, 0.5)  # of δ²: an arm's errors may nearly all come back, or half of them
LOUDEST, VOLUMES = 30.0, 8  # of a disturbance, in standard deviations of the noise


@dataclass(frozen=True, slots=True)
class Scattered:
    """What a fit leaves (n,) of readings, its columns `slopes` (n, q), and what is known of their errors.

    `known` (n, n) is the covariance without arm and walk, `effects(share)` (n, P) what the arm's errors do of which
    that share is new in each dwell, `walk` (n, n) the covariance of a walk of rate 1; `noise` (n,) the variances of the
    readings' own, by which a walk's order of magnitude is reckoned.
    """

    left: Array
    slopes: Array
    known: Array
    effects: Callable[[float], Array]
    walk: Array
    noise: Array


@dataclass(frozen=True, slots=True)
class Sizes:
    """What readings tell: what the bias walks in a second, δ, and which share of δ² is new in each dwell."""

    walk: float
    std_rad: float
    own_share: float


def expected_sizes(seen: Scattered, shares: Sequence[float]) -> Sizes:
    """Mean squares over all sizes, each as likely as it makes the readings.

    Before, the walk was as likely to be there as not, it and δ were of any order of magnitude, and each of the `shares`
    was as likely as the others.
    """
    standing = np.diag(seen.walk) > 0
    typical = np.sqrt(np.median(seen.noise[standing]) / np.median(np.diag(seen.walk)[standing]))
    walks = np.concatenate([[0.0], typical * np.geomspace(SPAN**-0.5, SPAN**0.5, WALKS)])
    sizes = np.geomspace(SMALLEST_RAD, LARGEST_RAD, SIZES)
    columns = seen.slopes.shape[1]
    free = np.linalg.qr(seen.slopes, mode="complete")[0][:, columns:].T  # to which the columns are nothing
    left, known, walk = free @ seen.left, free @ seen.known @ free.T, free @ seen.walk @ free.T
    whites = [np.linalg.inv(np.linalg.cholesky(known + rate**2 * walk)) for rate in walks]
    of_arm = [free @ seen.effects(share) for share in shares]
    belief = np.array([[_likelihood(left, white, effects, sizes) for white in whites] for effects in of_arm])
    belief[:, 1:] -= np.log(WALKS)
    weights = np.exp(belief - belief.max())
    weights /= weights.sum()
    walked, turned = weights.sum(axis=(0, 2)) @ walks**2, weights.sum(axis=1) @ sizes**2
    new = turned @ shares / turned.sum()
    return Sizes(float(np.sqrt(walked)), float(np.sqrt(turned.sum())), float(new))


def expected_disturbances(seen: Scattered, sizes: Sizes, causes: Sequence[Array], odds: Sequence[float]) -> Array:
    """(k,) variance of each of the `causes`, of which (n, …) are the columns by one standard deviation.

    Before, each was there by these `odds` (k,) against none, by any order of magnitude.
    """
    effects = sizes.std_rad * seen.effects(sizes.own_share)
    white = np.linalg.inv(np.linalg.cholesky(seen.known + sizes.walk**2 * seen.walk + effects @ effects.T))
    basis = np.linalg.qr(white @ seen.slopes)[0]
    left = white @ seen.left
    left = left - basis @ (basis.T @ left)
    volumes = np.geomspace(1.0, LOUDEST, VOLUMES) ** 2
    belief = np.zeros((len(causes), VOLUMES))
    for place, columns in enumerate(causes):
        told = white @ columns
        told = told - basis @ (basis.T @ told)
        growth, directions = np.linalg.eigh(told.T @ told)
        along = np.square(directions.T @ (told.T @ left))
        grown = 1 + volumes[:, None] * growth.clip(min=0.0)
        told_of_it = 0.5 * np.sum(volumes[:, None] * along / grown - np.log(grown), axis=1)
        belief[place] = np.log(odds[place] / VOLUMES) + told_of_it
    most = max(float(belief.max()), 0.0)
    weights = np.exp(belief - most)
    expected: Array = weights @ volumes / (weights.sum() + np.exp(-most))
    return expected


def _likelihood(left: Array, white: Array, effects: Array, sizes: Array) -> Array:
    """(k,) logarithms of the likelihood of what is left (n,), up to a constant, for `sizes` (k,) of δ.

    `white` (n, n), triangular, leaves white all that is known beside the `effects` (n, P) of the arm.
    """
    spread = white @ effects
    growth, directions = np.linalg.eigh(spread @ spread.T)
    squares = np.square(white @ left @ directions)
    variance = 1 + np.square(sizes)[:, None] * growth.clip(min=0.0)
    lost = np.sum(np.log(variance) + squares / variance, axis=1)
    return np.asarray(np.log(np.diag(white)).sum() - lost / 2, dtype=np.float64)
