"""A simulated rate table with the numbers of TRIAX: attitudes, motion and the KVH 1775 as published."""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

Array = NDArray[np.float64]

DEG_H = np.radians(1.0) / 3600
MILLI_G = 9.80061e-3  # m/s²

GYRO_MATRIX = np.array([[1.0004, 0.0007, 0.0007], [-0.0006, 1.0013, -0.0042], [-0.0013, 0.0044, 0.9997]])
EARTH_RATE = np.array([-1.0755, -11.5266, -10.1612]) * DEG_H
GYRO_BIAS = np.array([-0.5434, 0.1925, -0.0279]) * DEG_H
GYRO_RANDOM_WALK = np.radians(0.012) / 60  # 0.012 °/√h in rad/√s

ACCELEROMETER_MATRIX = np.array(
    [[1.000427, 0.000121, 0.001002], [-0.000196, 1.000291, -0.004034], [-0.001121, 0.004356, 1.000529]]
)
SECOND_ORDER = 1e-4 * np.array([0.0972, -0.9478, -0.1764])
ACCELEROMETER_BIAS = np.array([0.9664, -0.4173, 0.8803]) * MILLI_G
GRAVITY = np.array([0.015499, -0.004079, 9.800597])
ACCELEROMETER_RANDOM_WALK = 0.0701 / 60  # m/s/√h in m/s/√s
AVERAGING_S = 360.0  # of each static attitude


def attitudes(count: int, seed: int = 1) -> Array:
    """(count, 3, 3) rotations body → table, spread over all there are."""
    matrices: Array = Rotation.random(count, random_state=seed).as_matrix()
    return matrices


def turning(samples: int, rate_hz: float = 25.0) -> tuple[Array, Array]:
    """Attitudes (samples, 3, 3) and body rates (samples, 3) of a table whose three axes swing, as in TRIAX, Fig. 2."""
    time_s = np.arange(samples) / rate_hz
    amplitude, pulse, phase = np.array([0.5, 0.4, 0.6]), np.array([0.31, 0.23, 0.17]), np.array([0.3, 1.1, 2.0])
    angles = amplitude / pulse * np.sin(pulse * time_s[:, None] + phase)
    speeds = amplitude * np.cos(pulse * time_s[:, None] + phase)
    turns = [Rotation.from_rotvec(angles[:, [i]] * np.eye(3)[i]) for i in range(3)]
    table = turns[2] * turns[1] * turns[0]  # yaw, pitch, roll: the outer axis first
    # Each axis is carried by the ones outside it; in body coordinates the inner ones turn the outer ones' rates.
    rates = speeds[:, [0]] * np.eye(3)[0]
    rates = rates + turns[0].inv().apply(speeds[:, [1]] * np.eye(3)[1])
    rates = rates + (turns[1] * turns[0]).inv().apply(speeds[:, [2]] * np.eye(3)[2])
    return table.as_matrix(), rates


def noisy(readings: Array, variances: Array, runs: int | None = None, seed: int = 1) -> Array:
    """Readings with Gaussian noise; (runs, …) of them if asked for."""
    shape = readings.shape if runs is None else (runs, *readings.shape)
    result: Array = readings + np.random.default_rng(seed).normal(size=shape) * np.sqrt(variances)
    return result
