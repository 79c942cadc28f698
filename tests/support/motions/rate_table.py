"""Attitudes and noise for the tri-axial estimators; the published numbers stand in `rig.study.rate_table`."""

import numpy as np
from scipy.spatial.transform import Rotation

from rig.estimation.arrays import Array


def attitudes(count: int, seed: int = 1) -> Array:
    """(count, 3, 3) rotations body → table, spread over all there are."""
    matrices: Array = Rotation.random(count, random_state=seed).as_matrix()
    return matrices


def noisy(readings: Array, variances: Array, runs: int | None = None, seed: int = 1) -> Array:
    """Readings with Gaussian noise; (runs, …) of them if asked for."""
    shape = readings.shape if runs is None else (runs, *readings.shape)
    result: Array = readings + np.random.default_rng(seed).normal(size=shape) * np.sqrt(variances)
    return result
