"""Example files of docs/how-to/without-an-arm/known-attitudes.md: TRIAX's table and sensor as published.

python tests/support/external/rate_table_files.py DIR     # writes them again
"""

import sys
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from rig.estimation.arrays import Array
from rig.study.rate_table import (
    ACCELEROMETER_BIAS_M_S2,
    ACCELEROMETER_MATRIX,
    ACCELEROMETER_RANDOM_WALK,
    ACCELEROMETER_REFERENCE_M_S2,
    ACCELEROMETER_SECOND_ORDER,
    GYRO_BIAS_RAD_S,
    GYRO_MATRIX,
    GYRO_RANDOM_WALK,
    GYRO_REFERENCE_RAD_S,
    RATE_HZ,
    draw_attitudes,
    simulate_oscillation,
)

STILL, DWELL_S, BETWEEN_S = 16, 4.0, 1.0
SWINGING_S = 24.0
FIELD_T = 1e-6 * np.array([21.0, -3.5, 43.0])  # north, east, down
FIELD_MATRIX = np.array([[1.021, 0.004, -0.013], [0.011, 0.987, 0.006], [-0.002, 0.009, 1.034]])
FIELD_BIAS_T = 1e-6 * np.array([4.2, -7.9, 1.3])
FIELD_NOISE_T = 2e-7


def write_all(folder: Path) -> None:
    """Write both pairs of files."""
    rng = np.random.default_rng(2019)
    _still(folder, rng)
    _swinging(folder, rng)


def _still(folder: Path, rng: np.random.Generator) -> None:
    """Write sixteen attitudes at rest, for accelerometer and magnetometer."""
    turned = draw_attitudes(STILL)
    time_s = np.arange(round(STILL * (DWELL_S + BETWEEN_S) * RATE_HZ)) / RATE_HZ
    where = turned[(time_s // (DWELL_S + BETWEEN_S)).astype(int)]
    sensed = ACCELEROMETER_REFERENCE_M_S2 @ where
    sensed = (sensed + ACCELEROMETER_SECOND_ORDER * sensed**2) @ ACCELEROMETER_MATRIX.T + ACCELEROMETER_BIAS_M_S2
    sensed += ACCELEROMETER_RANDOM_WALK * np.sqrt(RATE_HZ) * rng.normal(size=sensed.shape)
    field = (FIELD_T @ where) @ FIELD_MATRIX.T + FIELD_BIAS_T + FIELD_NOISE_T * rng.normal(size=sensed.shape)
    columns = ["time_s", "x_m_s2", "y_m_s2", "z_m_s2", "x_t", "y_t", "z_t"]
    _write(folder / "still_samples.csv", columns, np.column_stack([time_s, sensed, field]))
    start_s = np.arange(STILL, dtype=np.float64) * (DWELL_S + BETWEEN_S)
    rows = np.column_stack([start_s, start_s + DWELL_S, _quaternions(turned)])
    _write(folder / "still_attitudes.csv", ["start_s", "end_s", "qw", "qx", "qy", "qz"], rows)


def _swinging(folder: Path, rng: np.random.Generator) -> None:
    """Write an attitude and a rate for every sample of the gyroscope, while all three axes oscillate."""
    turned, rates = simulate_oscillation(SWINGING_S)
    sensed = (GYRO_REFERENCE_RAD_S @ turned + rates) @ GYRO_MATRIX.T + GYRO_BIAS_RAD_S
    sensed += GYRO_RANDOM_WALK * np.sqrt(RATE_HZ) * rng.normal(size=sensed.shape)
    time_s = np.arange(len(sensed)) / RATE_HZ
    _write(
        folder / "swinging_samples.csv", ["time_s", "x_rad_s", "y_rad_s", "z_rad_s"], np.column_stack([time_s, sensed])
    )
    half_s = 0.5 / RATE_HZ
    columns = ["start_s", "end_s", "qw", "qx", "qy", "qz", "rate_x_rad_s", "rate_y_rad_s", "rate_z_rad_s"]
    rows = np.column_stack([time_s - half_s, time_s + half_s, _quaternions(turned), rates])
    _write(folder / "swinging_attitudes.csv", columns, rows)


def _quaternions(turned: Array) -> Array:
    """Return quaternions (N, 4) qw qx qy qz."""
    quaternions: Array = Rotation.from_matrix(turned).as_quat()[:, [3, 0, 1, 2]]
    return quaternions


def _write(path: Path, columns: list[str], rows: Array) -> None:
    lines = [",".join(columns), *(",".join(f"{number:.9g}" for number in row) for row in rows.tolist())]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


if __name__ == "__main__":
    write_all(Path(sys.argv[1]))
