"""Attitudes and noise for the tri-axial estimators; the published numbers are in `rig.study.rate_table`."""

import numpy as np
from scipy.spatial.transform import Rotation

from rig.estimation.arrays import Array


def attitudes(count: int, seed: int = 1) -> Array:
    """Return rotations (count, 3, 3) from body to table, distributed over all rotations."""
    matrices: Array = Rotation.random(count, random_state=seed).as_matrix()
    return matrices


def noisy(readings: Array, variances: Array, runs: int | None = None, seed: int = 1) -> Array:
    """Return readings with Gaussian noise; (runs, …) of them if `runs` is given."""
    shape = readings.shape if runs is None else (runs, *readings.shape)
    result: Array = readings + np.random.default_rng(seed).normal(size=shape) * np.sqrt(variances)
    return result
