"""Weights of a mean, the same for all quantities averaged over the same samples.

A reading m at the rate ω is F ω + c plus nuisance effects. Weights w orthogonal to the columns of these effects give
wᵀ m = F wᵀ ω + c: the mean of the readings corresponds to the mean of ω with the same weights, even if the samples
cover a vibration incompletely or end at any time. In a least-squares fit of the groups' means together with
coefficients of the nuisance columns, the rows of the pseudoinverse that belong to the means are these weights (the
Frisch–Waugh–Lovell theorem).
"""

import numpy as np
from numpy.typing import NDArray

from rig.estimation.arrays import Array

TOLERANCE = 1e-2  # unit columns whose difference is smaller are collinear


def mean_weights(groups: Array, nuisance: Array) -> Array:
    """Return the weights (p, n) of the means of p groups of samples, with which the means of nuisance columns are zero.

    - groups (n, p): one if a sample belongs to a group, zero otherwise; a sample belongs to at most one group.
    - nuisance (n, k): the columns. Parts that are collinear with groups or other columns are not removed.

    Among all such weights, these have the least sum of squares, which is the variance of a mean of white noise of
    variance one. The weights of a group without samples are zero.
    """
    averages = groups.T / np.maximum(groups.sum(axis=0), 1.0)[:, None]
    if not nuisance.shape[1]:
        return np.asarray(averages, dtype=np.float64)
    means = averages @ nuisance
    sizes = np.linalg.norm(nuisance, axis=0)
    sizes = np.where(sizes > 0, sizes, np.inf)
    within = (nuisance - groups @ means) / sizes
    weights: Array = averages - (means / sizes) @ (invert_squares(within.T @ within) @ within.T)
    return weights


def invert_squares(squares: Array) -> Array:
    """Return the pseudoinverse of the products (k, k) of columns, without directions in which they are collinear.

    If there are no such directions, the pseudoinverse is the inverse, which takes a fifth of the time. To decide this,
    the ratio of the largest to the smallest singular value is bounded by the product of the norms of matrix and
    inverse.
    """
    try:
        inverse = np.linalg.inv(squares)
    except np.linalg.LinAlgError:
        inverse = np.full_like(squares, np.inf)
    if np.linalg.norm(squares) * np.linalg.norm(inverse) < TOLERANCE**-2:
        return np.asarray(inverse, dtype=np.float64)
    return np.asarray(np.linalg.pinv(squares, rcond=TOLERANCE**2, hermitian=True), dtype=np.float64)


def even_groups(part: NDArray[np.intp], parts: int) -> Array:
    """Return the groups (n, p) of `mean_weights` from the index `part` (n,) of each sample's group.

    The index is −1 for a sample that belongs to no group; `parts` is the number p of groups.
    """
    groups: Array = (part[:, None] == np.arange(parts)).astype(np.float64)
    return groups
