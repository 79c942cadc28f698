"""Weights that make a mean: one linear functional for whatever is averaged over the same samples.

A reading is F ω + c beside what nobody wants in its mean. The weights w of a mean that is free of such nuisance columns
N are orthogonal to them, so wᵀ m = F wᵀ ω + c: the reference of the mean of readings is the mean of ω under the very
same weights, whatever the samples miss of a vibration and wherever they end. Least squares by groups and nuisance
columns together has these weights in its rows (the Frisch–Waugh–Lovell theorem).
"""

import numpy as np

from rig.estimation.arrays import Array

ALIKE = 1e-2  # unit columns that differ by less are one


def mean_weights(groups: Array, nuisance: Array) -> Array:
    """Return the weights (p, n) of the means of p groups of n samples that are free of nuisance columns.

    groups (n, p): one where a sample belongs to a group, zero elsewhere; each sample belongs to one at most.
    nuisance (n, k): the columns. What is not told from the groups and from the other columns is left as it is. Of all
    such weights these have the least sum of squares, which is the variance of a mean of white noise of variance one. A
    group without samples has no weights.
    """
    averages = groups.T / np.maximum(groups.sum(axis=0), 1.0)[:, None]
    means = averages @ nuisance
    sizes = np.linalg.norm(nuisance, axis=0)
    sizes = np.where(sizes > 0, sizes, np.inf)
    within = (nuisance - groups @ means) / sizes
    inverse = np.linalg.pinv(within.T @ within, rcond=ALIKE**2, hermitian=True)
    weights: Array = averages - (means / sizes) @ (inverse @ within.T)
    return weights


def even_groups(part: Array, parts: int) -> Array:
    """Return groups (n, p) as of `mean_weights` of samples that are numbered by their part (n,), −1 for none."""
    groups: Array = (part[:, None] == np.arange(parts)).astype(np.float64)
    return groups
