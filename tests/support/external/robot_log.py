"""Synthetic logs of a robot that carries a low-cost IMU, such as docs/examples/robot_log.txt and robot_poses.csv.

The computer stamps readings when they arrive, four at once, in whole milliseconds, 80 ms after the poses. The robot
reports its pose 14 times a second, by quaternions that take room to body coordinates, with errors of up to a degree
that are a smooth function of the attitude (joint zeros). Write them by

    PYTHONPATH=tests python -m support.external.robot_log docs/examples
"""

import sys
from dataclasses import dataclass
from functools import cache
from itertools import pairwise
from pathlib import Path

import numpy as np
from scipy.spatial.transform import Rotation, Slerp

SEED = 20261128
RATE_HZ, POSE_HZ, LATE_S, BURST = 40.0, 14.0, 0.080, 4
REST_S, MOVE_S, MOVES = 1.6, 3.2, 12
MATRIX = np.array([[1.042, 0.013, -0.009], [-0.011, 0.966, 0.016], [0.008, -0.014, 1.021]])  # true rate to reading
BIAS_DEG_S = np.array([1.30, -0.85, 0.55])
NOISE_DEG_S, NOISE_G, POSE_NOISE_RAD = 0.08, 0.004, 2e-5
ATTITUDE_ERROR_RAD = 0.008  # standard deviation of each coefficient of the smooth error
GRAVITY_G = np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True)
class RobotLog:
    """Readings (n, 3) in °/s and g at times of arrival (n,) in ms, and poses (k, 4) at times (k,) in s.

    `attitudes` are the true ones at the true times `time_s` of the readings; `rests_s` (r, 2) on that clock.
    """

    time_ms: np.ndarray
    rates_deg_s: np.ndarray
    forces_g: np.ndarray
    pose_s: np.ndarray
    poses: np.ndarray
    time_s: np.ndarray
    attitudes: Rotation
    rests_s: np.ndarray


@cache  # nobody writes into one
def make_log(seed: int = SEED) -> RobotLog:
    """Draw a log."""
    rng = np.random.default_rng(seed)
    stops = [Rotation.identity()]
    for move in range(MOVES):
        axis = np.eye(3)[move % 3] * (1 if move % 6 < 3 else -1) + rng.normal(0, 0.35, 3)
        turn = Rotation.from_rotvec(axis / np.linalg.norm(axis) * rng.uniform(1.2, 2.1))
        stops.append(stops[-1] * turn)
    starts_s = np.arange(MOVES + 1) * (REST_S + MOVE_S)
    end_s = starts_s[-1] + REST_S
    fine_s = np.arange(0.0, end_s, 1e-3)
    true = attitudes_at(fine_s, starts_s, Rotation.concatenate(stops))
    rates = (true[:-1].inv() * true[1:]).as_rotvec() / 1e-3
    time_s = np.arange(0.1, end_s - 0.1, 1 / RATE_HZ)
    sensed = np.degrees(np.column_stack([np.interp(time_s, fine_s[:-1] + 5e-4, axis) for axis in rates.T]))
    attitudes = true[np.rint(time_s / 1e-3).astype(int)]
    readings = sensed @ MATRIX.T + BIAS_DEG_S + rng.normal(0, NOISE_DEG_S, sensed.shape)
    forces = attitudes.inv().apply(GRAVITY_G) + rng.normal(0, NOISE_G, sensed.shape)
    last = np.minimum((np.arange(len(time_s)) // BURST + 1) * BURST - 1, len(time_s) - 1)
    arrived_s = time_s[last] + LATE_S + rng.uniform(0, 0.004, len(time_s) // BURST + 1)[np.arange(len(time_s)) // BURST]
    time_ms = np.floor(1e3 * arrived_s) + np.arange(len(time_s)) % BURST
    pose_s = np.arange(0.03, end_s - 0.03, 1 / POSE_HZ)
    posed = true[np.rint(pose_s / 1e-3).astype(int)]
    coefficients = rng.normal(0, ATTITUDE_ERROR_RAD, (9, 3))
    errors = posed.as_matrix().reshape(-1, 9) @ coefficients / 3
    noise = rng.normal(0, POSE_NOISE_RAD, errors.shape)
    reported = Rotation.from_rotvec(errors + noise) * posed
    x, y, z, w = reported.inv().as_quat().T
    rests_s = np.column_stack([starts_s, starts_s + REST_S])
    return RobotLog(time_ms, readings, forces, pose_s, np.column_stack([w, x, y, z]), time_s, attitudes, rests_s)


def attitudes_at(time_s: np.ndarray, starts_s: np.ndarray, stops: Rotation) -> Rotation:
    """Return the attitudes of a body that moves from stop to stop, with smooth starts and ends."""
    index = np.clip(np.searchsorted(starts_s, time_s, "right") - 1, 0, len(starts_s) - 2)
    part = np.clip((time_s - starts_s[index] - REST_S) / MOVE_S, 0, 1)
    smooth = part**3 * (10 - 15 * part + 6 * part**2)
    return Slerp(np.arange(len(stops)), stops)(index + smooth)


def write_log(log: RobotLog, folder: Path) -> None:
    """Write the two files."""
    lines = ["# logger 2.1, IMU on the tool flange", "time_ms  gx[dps]  gy[dps]  gz[dps]  ax  ay  az"]
    lines += [
        f"{time:.0f} " + " ".join(f"{rate:.2f}" for rate in rates) + " " + " ".join(f"{force:.3f}" for force in forces)
        for time, rates, forces in zip(log.time_ms, log.rates_deg_s, log.forces_g, strict=True)
    ]
    (folder / "robot_log.txt").write_text("\n".join(lines) + "\n", encoding="utf-8")
    rows = ["time;q1;q2;q3;q4"]
    rows += [
        f"{time:.3f};" + ";".join(f"{part:.5f}" for part in pose)
        for time, pose in zip(log.pose_s, log.poses, strict=True)
    ]
    (folder / "robot_poses.csv").write_text("\n".join(rows) + "\n", encoding="utf-8")


def compose(steps: Rotation) -> Rotation:
    """Return the product of rotations in their order, by pairs: one by one takes a hundred times as long."""
    while len(steps) > 1:
        if len(steps) % 2:
            steps = Rotation.concatenate([steps, Rotation.identity(1)])
        steps = steps[::2] * steps[1::2]
    return steps[0]


def orientation_errors_deg(log: RobotLog, rates_rad_s: np.ndarray) -> np.ndarray:
    """Return the errors of integrated rates (n, 3) for each move from rest to rest, degrees.

    The best constant rotation between sensor and body, the mounting, is removed first.
    """
    index = [int(np.argmin(np.abs(log.time_s - middle_s))) for middle_s in log.rests_s.mean(axis=1)]
    steps = Rotation.from_rotvec((rates_rad_s[1:] + rates_rad_s[:-1]) / 2 / RATE_HZ)
    turned = []
    true = []
    for first, last in pairwise(index):
        turned.append(compose(steps[first:last]))
        true.append(log.attitudes[first].inv() * log.attitudes[last])
    measured, expected = Rotation.concatenate(turned), Rotation.concatenate(true)
    mounting = Rotation.align_vectors(measured.as_rotvec(), expected.as_rotvec())[0]
    return np.degrees(((mounting * expected * mounting.inv()).inv() * measured).magnitude())


if __name__ == "__main__":
    write_log(make_log(), Path(sys.argv[1]))
