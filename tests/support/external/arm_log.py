"""A six-axis arm that reports its attitudes slowly, late and with errors, and readings of a gyroscope on its flange.

The arm's error is a function of its joint angles, the same at each visit. No code is shared with the rig.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation

from rig.estimation.arrays import Array
from rig.observation.external.reference_rows import Turning
from support.external.csv_tables import write_table

Form = Literal["joint zeros", "joint gains", "rough", "wide", "body", "table"]
FORMS: tuple[Form, ...] = ("joint zeros", "joint gains", "rough", "wide", "body", "table")
JOINTS = np.array([[0, 0, 1], [0, 1, 0], [0, 1, 0], [1, 0, 0], [0, 1, 0], [1, 0, 0]], dtype=float)  # at zero
# random walk rad/√s, bias walk rad/s/√s, g-sensitivity rad/s per m/s²
NOISES = ((3e-5, 1e-6, 0.0), (1e-4, 5e-6, 1e-6), (4e-4, 2e-5, 1e-5), (2e-3, 1e-4, 3e-5))
EARTH_RAD_S = 7.292e-5 * np.array([0.5, 0.2, 0.84])
TRUE_HZ = 1000.0
GRAVITY = np.array([0, 0, 9.8])


@dataclass(frozen=True)
class ArmLog:
    """An arm that visits `stops` attitudes, `visits` times each, and rests for once to twice `rests_s`, or never.

    - `poses_hz`, `latency_s`, `jitter_s`: of the reports, which are valid `latency_s` later than stamped.
    - `error_rad` with its `form`: RMS of the attitude error as a function of the joints; `report_rad`: new each time.
    - `noise`: a class of `NOISES`; `readings_hz`; `gaps`: of a tenth of a second each; `reading_jitter_s`.
    - `axes`: the joints that move, `one_by_one` or together; `fastest_rad_s` of a joint.
    """

    stops: int = 10
    visits: int = 2
    rests_s: float = 1.0
    poses_hz: float = 14.0
    latency_s: float = 0.08
    jitter_s: float = 0.003
    error_rad: float = 0.02
    form: Form = "joint zeros"
    report_rad: float = 2e-5
    noise: int = 1
    readings_hz: float = 100.0
    reading_jitter_s: float = 0.0
    gaps: int = 0
    fastest_rad_s: float = 2.0
    axes: tuple[int, ...] = (3, 4, 5)
    scale_error: float = 0.03
    one_by_one: bool = False


@dataclass(frozen=True)
class Recorded:
    """Readings (n, 3) at `time_s` (n,), the reports `attitudes` (k, 3, 3) stamped `stamps_s` (k,), and the truth."""

    time_s: Array
    readings: Array
    stamps_s: Array
    attitudes: Array
    matrix: Array
    bias: Array
    clock_s: float


def draw(seed: int) -> ArmLog:
    """Return a log of the kinds that real arms write."""
    rng = np.random.default_rng([seed, 51])
    return ArmLog(
        stops=int(rng.integers(6, 16)),
        visits=int(rng.integers(1, 4)),
        rests_s=float(rng.choice([0.0, 0.7, 1.0, 1.5])),
        poses_hz=float(np.exp(rng.uniform(np.log(4), np.log(125)))),
        latency_s=float(rng.uniform(-0.15, 0.15)),
        jitter_s=float(rng.uniform(0, 0.01)),
        error_rad=float(np.radians(rng.uniform(0, 2))),
        form=FORMS[int(rng.integers(len(FORMS)))],
        report_rad=float(10 ** rng.uniform(-5, -3.5)),
        noise=int(rng.integers(len(NOISES))),
        readings_hz=float(rng.choice([50, 100, 119, 200, 400])),
        gaps=int(rng.choice([0, 0, 0, 1, 3])),
        fastest_rad_s=float(np.exp(rng.uniform(np.log(0.5), np.log(4)))),
        axes=((3, 4, 5), (0, 3, 4, 5), (0, 1, 2, 3, 4, 5))[int(rng.integers(3))],
        scale_error=float(rng.choice([0.01, 0.05])),
    )


def record(log: ArmLog, seed: int) -> Recorded:
    rng = np.random.default_rng(seed)
    joints, time_s = _joints(log, rng)
    attitudes = _forward(joints)
    steps = (attitudes[:-1].inv() * attitudes[1:]).as_rotvec() * TRUE_HZ
    rates = CubicSpline(time_s[:-1] + 0.5 / TRUE_HZ, steps)(time_s)
    matrix = np.eye(3) + log.scale_error * rng.normal(size=(3, 3)) * (0.3 + 0.7 * np.eye(3))
    bias = 0.03 * rng.normal(size=3)
    walk_rad, bias_walk, g_sensitivity = NOISES[log.noise]
    taken_s = np.arange(0.2, time_s[-1] - 0.2, 1 / log.readings_hz)
    indices = np.interp(taken_s, time_s, np.arange(len(time_s))).round().astype(int)
    body = attitudes[indices]
    readings = (rates[indices] + body.inv().apply(EARTH_RAD_S)) @ matrix.T + bias
    wander = np.cumsum(rng.normal(size=readings.shape), axis=0) * bias_walk / np.sqrt(log.readings_hz)
    wander += body.inv().apply(GRAVITY) @ (g_sensitivity * rng.normal(size=(3, 3))).T
    readings += wander + rng.normal(size=readings.shape) * walk_rad * np.sqrt(log.readings_hz)
    kept = np.ones(len(taken_s), dtype=bool)
    for start in rng.uniform(2, taken_s[-1] - 2, size=log.gaps):
        kept &= (taken_s < start) | (taken_s > start + 0.1)
    stamped_s = np.sort(taken_s + log.reading_jitter_s * rng.uniform(-1, 1, size=len(taken_s)))
    stamps_s, reported = _reports(log, time_s, joints, attitudes, rng)
    return Recorded(
        stamped_s[kept], readings[kept], stamps_s, reported, matrix, bias + wander.mean(axis=0), log.latency_s
    )


def _joints(log: ArmLog, rng: np.random.Generator) -> tuple[Array, Array]:
    """Return joint angles (n, 6) at `TRUE_HZ`, and the times."""
    home = np.array([0.0, -0.6, 0.9, 0.0, 0.8, 0.0])
    wide = np.array([1.0, 0.5, 0.5, 2.2, 1.0, 2.5])
    targets = np.tile(home, (log.stops, 1))
    moved = list(log.axes)
    targets[:, moved] += rng.uniform(-1, 1, size=(log.stops, len(moved))) * wide[moved]
    order = np.concatenate([rng.permutation(log.stops) for _ in range(log.visits)])
    points = targets[order]
    if log.one_by_one:
        points = np.tile(home, (len(order), 1))
        points[1:-1:2] = (
            home
            + wide
            * rng.choice([-1, 1], size=(len(points[1:-1:2]), 1))
            * np.eye(6)[np.resize(moved, len(points[1:-1:2]))]
        )
    moves = np.abs(np.diff(points, axis=0)).max(axis=1)
    lasts_s = np.maximum(1.9 * moves / log.fastest_rad_s, 0.4)
    if log.rests_s == 0:
        knots = np.concatenate([[0], np.cumsum(lasts_s)]) + 1.0
        spline = CubicSpline(knots, points, bc_type="clamped")
        time_s = np.arange(0, knots[-1] + 1.0, 1 / TRUE_HZ)
        return spline(np.clip(time_s, knots[0], knots[-1])), time_s
    rests_s = log.rests_s * rng.uniform(1, 2, size=len(points))
    begins = np.cumsum(rests_s[:-1] + np.append(0, lasts_s[:-1])) + 0.3
    time_s = np.arange(0, begins[-1] + lasts_s[-1] + rests_s[-1], 1 / TRUE_HZ)
    joints = np.tile(points[0], (len(time_s), 1))
    for begin, last, one, other in zip(begins, lasts_s, points[:-1], points[1:], strict=True):
        x = np.clip((time_s - begin) / last, 0, 1)[:, None]
        joints += (10 * x**3 - 15 * x**4 + 6 * x**5) * (other - one)
    return joints, time_s


def _forward(joints: Array) -> Rotation:
    whole = Rotation.from_rotvec(joints[:, :1] * JOINTS[0])
    for joint in range(1, 6):
        whole = whole * Rotation.from_rotvec(joints[:, joint : joint + 1] * JOINTS[joint])
    return whole


def _reports(
    log: ArmLog, time_s: Array, joints: Array, attitudes: Rotation, rng: np.random.Generator
) -> tuple[Array, Array]:
    phase = rng.uniform(0, 1)
    taken_s = np.arange(0.5 + phase / log.poses_hz, time_s[-1] - 0.5, 1 / log.poses_hz)
    indices: NDArray[np.intp] = (taken_s * TRUE_HZ).round().astype(int)
    stamps_s = taken_s - log.latency_s + log.jitter_s * rng.normal(size=len(taken_s))
    stamps_s = np.maximum.accumulate(stamps_s)  # a report that overtakes another waits for it
    waiting = np.concatenate([[False], np.diff(stamps_s) <= 0])
    first = np.maximum.accumulate(np.where(waiting, 0, np.arange(len(stamps_s))))
    stamps_s = stamps_s + 1e-5 * (np.arange(len(stamps_s)) - first).astype(np.float64)
    reported = _compute_reported(log, joints, attitudes, indices, rng)
    return stamps_s, np.asarray(
        (Rotation.from_rotvec(rng.normal(size=(len(indices), 3)) * log.report_rad) * reported).as_matrix()
    )


def _compute_reported(
    log: ArmLog, joints: Array, attitudes: Rotation, indices: NDArray[np.intp], rng: np.random.Generator
) -> Rotation:
    """Return the reported attitudes, whose errors without their common part have the RMS `error_rad`."""
    true = attitudes[indices]
    if log.form in ("joint zeros", "joint gains"):
        sizes = rng.normal(size=6)

        def report(scale: float) -> Rotation:
            wrong = scale * sizes if log.form == "joint zeros" else joints[indices] * scale * sizes / 3
            return _forward(joints[indices] + wrong)
    else:
        lengths = {"rough": 0.7, "wide": 2.0, "body": 1.0, "table": 1.0}[log.form]
        matrices = true.as_matrix().reshape(-1, 9)
        weights = rng.normal(size=(9, 40)) / lengths
        shape = np.cos(matrices @ weights + rng.uniform(0, 2 * np.pi, size=40)) @ rng.normal(size=(40, 3))

        def report(scale: float) -> Rotation:
            error = Rotation.from_rotvec(0.2 * scale * shape)
            return true * error if log.form in ("body", "rough") else error * true

    if log.error_rad == 0:
        return true
    small = 1e-3
    for _ in range(3):
        wrong = report(small)
        field = (wrong * true.inv()).as_rotvec()
        mean = field.mean(axis=0)
        small *= log.error_rad / float(np.sqrt(np.mean(np.sum((field - mean) ** 2, axis=1))))
    return report(small)


def turning(recorded: Recorded) -> Turning:
    """Return the rig's input, with rows as short as the interval of the reports."""
    half_s = min(float(np.diff(recorded.stamps_s).min()) / 2.1, 0.005)
    rows_s = np.column_stack([recorded.stamps_s - half_s, recorded.stamps_s + half_s])
    return Turning(recorded.time_s, recorded.readings, rows_s, recorded.attitudes)


def write(folder: Path, recorded: Recorded) -> list[Path]:
    """Write the files of `rig solve --attitudes`."""
    read = ["time_s", "x_rad_s", "y_rad_s", "z_rad_s"]
    samples = write_table(folder / "samples.csv", read, recorded.time_s, recorded.readings)
    columns = ["start_s", "end_s", "qw", "qx", "qy", "qz"]
    rows_s = turning(recorded).rows_s
    quaternions = Rotation.from_matrix(recorded.attitudes).as_quat()[:, [3, 0, 1, 2]]
    return [samples, write_table(folder / "attitudes.csv", columns, rows_s, quaternions)]
