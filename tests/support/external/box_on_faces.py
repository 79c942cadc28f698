"""A box with an accelerometer that a hand lays down on its faces; no code is shared with the rig."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation

from rig.estimation.arrays import Array
from support.external.csv_tables import write_table

GRAVITY_M_S2 = 9.81
FACES = Rotation.from_euler(
    "xyz", [(0, 0, 0), (180, 0, 0), (90, 0, 0), (-90, 0, 0), (0, 90, 0), (0, -90, 0)], degrees=True
)
REST_S, MOVE_S = 4.0, 1.0


@dataclass(frozen=True)
class Box:
    """A box that lies on its six faces `rounds` times; the rig gets the first `named` rests.

    A placement tilts it by `tilt_rad` about each axis and changes each reading by `changes_m_s2`.
    """

    rounds: int = 1
    named: int = 6
    tilt_rad: float = 2e-3
    changes_m_s2: float = 4e-3
    noise_m_s2: float = 0.01
    rate_hz: float = 50.0


@dataclass(frozen=True)
class Laid:
    """Readings (n, 3) at `time_s` (n,), rows [start_s, end_s, qw, qx, qy, qz] of the named rests, and the truth."""

    time_s: Array
    readings: Array
    rows: Array
    matrix: Array
    bias: Array


def lay_down(box: Box, seed: int) -> Laid:
    rng = np.random.default_rng(seed)
    matrix, bias = np.eye(3) + 0.02 * rng.normal(size=(3, 3)), 0.3 * rng.normal(size=3)
    count = 6 * box.rounds
    time_s = np.arange(round(count * (REST_S + MOVE_S) * box.rate_hz)) / box.rate_hz
    where, since_s = np.divmod(time_s, REST_S + MOVE_S)
    faces = [FACES[face % 6] * Rotation.from_rotvec(box.tilt_rad * rng.normal(size=3)) for face in range(count)]
    forces = np.array([face.inv().apply([0, 0, GRAVITY_M_S2]) for face in faces])[where.astype(int)]
    changed = box.changes_m_s2 * rng.normal(size=(count, 3))[where.astype(int)]
    moving = (since_s > REST_S)[:, None] * 6 * rng.normal(size=forces.shape)
    readings = (forces + moving) @ matrix.T + bias + changed + box.noise_m_s2 * rng.normal(size=forces.shape)
    start_s = np.arange(box.named, dtype=np.float64) * (REST_S + MOVE_S)
    quaternions = FACES[np.arange(box.named) % 6].as_quat()[:, [3, 0, 1, 2]]
    rows = np.column_stack([start_s + 0.3, start_s + REST_S - 0.3, quaternions])
    return Laid(time_s, readings, rows, matrix, bias)


def write(folder: Path, laid: Laid) -> tuple[Path, Path]:
    """Write the two files of `rig solve --attitudes`."""
    columns = ("time_s", "x_m_s2", "y_m_s2", "z_m_s2")
    samples = write_table(folder / "samples.csv", columns, laid.time_s, laid.readings)
    return samples, write_table(folder / "attitudes.csv", ("start_s", "end_s", "qw", "qx", "qy", "qz"), laid.rows)
