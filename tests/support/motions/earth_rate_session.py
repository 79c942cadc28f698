"""The Earth's rate as a gyroscope on a UR10e senses it, in sweeps and attitudes, on an arm with geometric errors.

The flange's mean rates come from differences of its attitudes along the true motion; the estimator shares with them
only the plan and the arm's own report.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cache

import numpy as np
from scipy.spatial.transform import Rotation

from rig.analysis.gyroscope.vector_inputs import WAVE_RATIO
from rig.config.procedures.attitude_sets import OPTIMAL_ATTITUDES
from rig.estimation.arrays import Array
from rig.estimation.earth import DEG_H
from rig.estimation.gyroscope.vector_fit import VectorInputs
from rig.estimation.statistics.rounding import Steps
from rig.motion.geometry import AXIS_ERRORS, axis_errors, flange_axes, flange_pose
from rig.motion.steps import Sweep
from rig.observation.statistics.mean import average_tapered
from rig.observation.statistics.tapered_weights import flank_s
from rig.observation.windows import Window
from rig.study.rate_table import GYRO_BIAS_RAD_S, GYRO_MATRIX
from support.motions.arm_attitudes import draw_true_arm, joints_rad
from support.motions.arm_sweeps import find_signed_speed, joints_at, plan_sweeps

EARTH_RAD_S = 7.292115e-5
LATITUDE_RAD = float(np.radians(38.777888))  # TRIAX, section II-A
UP = np.array([0.0, 0.0, 1.0])
HOME_RAD = np.radians([0.0, -90.0, 90.0, -90.0, -90.0, 0.0])
POINTS = 180  # of a turn
PAUSE_S = 2.0
REST_S = 3.0
VIBRATION_HZ, SAMPLES_HZ = 14.0, 250.0  # of configs/own_port/kvh1775_earth.yaml
ARM_RAD = 6e-4  # half of the limit `uncertainty.axis_deg`, as a standard deviation


@dataclass(frozen=True, slots=True)
class Part:
    """A gyroscope's angle random walk (rad/√s) and its bias drift.

    `scatter_rad_s` from one average to the next, a random walk of `walk_rad_s_sqrt_s`, and a steady `warming_rad_s_s`.
    """

    density: float
    scatter_rad_s: float
    walk_rad_s_sqrt_s: float
    warming_rad_s_s: float = 0.0


# TRIAX, table 1; scatter and walk are assumed, below the maker's bias instability of 0.05 °/h.
KVH1775 = Part(0.012 * 60 * DEG_H, 0.03 * DEG_H, 0.002 * DEG_H)
# 0.01 °/s/√Hz (PS-MPU-9250A-01, 3.1); a kelvin moves its bias by 864 °/h, and a run of minutes warms it by 0.03 K.
MPU9250 = Part(0.01 * 3600 * DEG_H, 10 * DEG_H, 1.0 * DEG_H, 0.15 * DEG_H)
LSM9DS1 = Part(0.008 * 3600 * DEG_H, 10 * DEG_H, 2.0 * DEG_H, 0.15 * DEG_H)


@dataclass(frozen=True, slots=True)
class Session:
    """The session: sweeps about `axes` axes, with rests, then dwells of `dwell_s` (none for 0).

    The arm: errors `arm_rad` of geometry and encoders, hysteresis between both directions, a timing error `timing_s` at
    each end of a turn, axes that are tilted by `leaning_rad`, drawn for each sweep, an RMS vibration about each of the
    flange's axes.
    """

    part: Part = KVH1775
    axes: int = 3
    dwell_s: float = 10.0
    arm_rad: float = ARM_RAD
    hysteresis_rad: float = 1e-4
    timing_s: float = 2e-5
    leaning_rad: float = 5e-5
    vibration_rad_s: float = 0.0
    g_sensitivity_rad_s_g: tuple[float, ...] = (0.0,) * 9
    earth_rad_s: float = EARTH_RAD_S
    wrists_deg: tuple[tuple[float, float, float], ...] = OPTIMAL_ATTITUDES


@dataclass(frozen=True, slots=True)
class Truth:
    """`earth_rad_s` (3,) in the base's frame, `heading_rad` of its x axis, c (3,) as the mean over the run."""

    earth_rad_s: Array
    heading_rad: float
    bias_rad_s: Array


@dataclass(frozen=True, slots=True)
class Stretch:
    """A sweep or a rest.

    Duration, true mean rate against the room, mean attitude, true and as reported, and the arm's report of the turn
    with the effect of its own errors.
    """

    duration_s: float
    rate_rad_s: Array
    attitude: Array
    reported_attitude: Array
    turn_rad_s: Array
    axis_errors_rad_s: Array
    joint: str | None


def record(session: Session, seed: int) -> tuple[VectorInputs, Truth]:
    """Return the rig's averages of one session of an arm and a gyroscope drawn by `seed`, sweeps first."""
    rng = np.random.default_rng(seed)
    poses = draw_true_arm(session.arm_rad, rng)
    heading = rng.uniform(0, 2 * np.pi)
    north = np.array([np.cos(heading), np.sin(heading), 0.0])
    earth = session.earth_rad_s * (np.cos(LATITUDE_RAD) * north + np.sin(LATITUDE_RAD) * UP)
    sweeps = list(_sweeps(session, poses, rng))
    rests = list(_rests(session, poses, rng))
    stretches = [*sweeps, *rests]

    lengths = np.array([stretch.duration_s for stretch in stretches])
    turns = len(sweeps)
    places = [index for pair in zip(range(turns), range(turns, 2 * turns), strict=True) for index in pair]
    places += range(2 * turns, len(stretches))  # a rest after each sweep, then dwells
    starts = np.zeros(len(stretches))
    starts[places] = np.cumsum([0.0, *(lengths[places[:-1]] + PAUSE_S)])
    windows = np.column_stack([starts, starts + lengths])

    attitudes = np.array([stretch.attitude for stretch in stretches])
    reported = np.array([stretch.reported_attitude for stretch in stretches])
    wandered, whole = _draw_drift(session.part, windows, rng)
    rates = np.array([stretch.rate_rad_s for stretch in stretches]) + attitudes @ earth
    pulled = attitudes @ -UP @ np.reshape(session.g_sensitivity_rad_s_g, (3, 3)).T
    means = rates @ GYRO_MATRIX.T + pulled + GYRO_BIAS_RAD_S + wandered
    variances = np.repeat((session.part.density**2 / lengths)[:, None], 3, axis=1)
    std = ARM_RAD * np.array([1.0 if name.startswith(("twist", "zero")) else WAVE_RATIO for name in AXIS_ERRORS])
    if session.vibration_rad_s:
        noise, variances, windows = _vibrating(session, windows, turns, rng)
    else:
        noise = np.sqrt(variances) * rng.normal(size=means.shape)
    inputs = VectorInputs(
        means_rad_s=means + noise,
        variances_rad2_s2=variances,
        turns_rad_s=np.array([stretch.turn_rad_s for stretch in stretches]),
        earth_rate_rad_s=np.zeros(3),
        speed_std_rad_s=np.zeros(len(means)),
        attitudes=reported,
        gravity_m_s2=9.80665 * reported @ -UP,
        windows_s=windows,
        joints=tuple(stretch.joint for stretch in stretches),
        axis_errors_rad_s=std[:, None, None] * np.stack([stretch.axis_errors_rad_s for stretch in stretches], axis=1),
    )
    return inputs, Truth(earth, heading, GYRO_BIAS_RAD_S + whole)


@cache
def _turns(axes: int) -> tuple[tuple[Sweep, float, Array, Array, Array], ...]:
    """Return each sweep's signed speed, joint angles (POINTS + 1, 6), axis and mean attitude by the arm's report."""
    angles = np.linspace(0, 2 * np.pi, POINTS + 1)
    turns = []
    for sweep in plan_sweeps(axes):
        joints = joints_at(sweep, angles)
        attitude = np.swapaxes(flange_pose(joints[:-1])[:, :3, :3], -1, -2).mean(axis=0)
        turns.append((sweep, find_signed_speed(sweep), joints, flange_axes(joints[:1])[0, :, sweep.joint], attitude))
    return tuple(turns)


def _sweeps(session: Session, poses: Callable[[Array], Array], rng: np.random.Generator) -> Iterator[Stretch]:
    for sweep, speed, told_way, axis, mean_attitude in _turns(session.axes):
        joints, forwards = told_way.copy(), 1 if speed > 0 else -1
        joints[:, sweep.joint] += forwards * session.hysteresis_rad / 2
        rotations = poses(joints)[::forwards, :3, :3]
        steps = Rotation.from_matrix(np.swapaxes(rotations[:-1], -1, -2) @ rotations[1:])
        halfway = rotations[:-1] @ (steps**0.5).as_matrix()
        duration = 2 * np.pi / abs(speed)
        rate = steps.as_rotvec().sum(axis=0) / duration
        rate = rate + np.cross(session.leaning_rad * rng.normal(size=3), rate)
        late = np.sqrt(2) * session.timing_s / duration * rng.normal()
        errors = speed * axis_errors(told_way[0], sweep.joint)
        attitude = np.swapaxes(halfway, -1, -2).mean(axis=0)
        yield Stretch(duration, rate * (1 + late), attitude, mean_attitude, speed * axis, errors, sweep.joint_name)


def _rests(session: Session, poses: Callable[[Array], Array], rng: np.random.Generator) -> Iterator[Stretch]:
    dwells = joints_rad(session.wrists_deg) if session.dwell_s else np.zeros((0, 6))
    home = [(HOME_RAD, REST_S)] * len(_turns(session.axes))
    for angles, duration in [*home, *((dwell, session.dwell_s) for dwell in dwells)]:
        stands = angles + np.r_[np.zeros(3), rng.choice([-0.5, 0.5], 3)] * session.hysteresis_rad
        attitude, reported = (pose[0, :3, :3].T for pose in (poses(stands[None]), flange_pose(angles[None])))
        yield Stretch(duration, np.zeros(3), attitude, reported, np.zeros(3), np.zeros((len(AXIS_ERRORS), 3)), None)


def _vibrating(session: Session, windows_s: Array, turns: int, rng: np.random.Generator) -> tuple[Array, Array, Array]:
    """Return the errors (N, 3) of each average by noise and vibration, their variances (N, 3), and the windows (N, 2).

    Whole turns are averaged evenly, others as the rig averages rests.
    """
    windows = windows_s.copy()
    noises = []
    variances = []
    for index, (start, end) in enumerate(windows_s):
        edges = np.linspace(start, end, round((end - start) * SAMPLES_HZ) + 1)
        turn = 2 * np.pi * VIBRATION_HZ
        swing = np.sqrt(2) * session.vibration_rad_s / turn * np.sin(turn * edges[:, None] + rng.uniform(0, 7, 3))
        sampled = session.part.density * np.sqrt(SAMPLES_HZ) * rng.normal(size=(len(edges) - 1, 3))
        readings = np.diff(swing, axis=0) * SAMPLES_HZ + sampled
        if index < turns:
            noises.append(readings.mean(axis=0))
            variances.append(np.full(3, session.part.density**2 / (end - start)))
        else:
            mean = average_tapered(readings, (edges[1:] + edges[:-1]) / 2, Window(start, end), Steps(1e-12))
            noises.append(mean.mean)
            variances.append(mean.variance)
            windows[index] += np.array([0.5, -0.5]) * flank_s(end - start)
    return np.array(noises), np.array(variances), windows


def _draw_drift(part: Part, windows_s: Array, rng: np.random.Generator) -> tuple[Array, Array]:
    """Return the bias error of each average (N, 3), and its mean (3,) over the whole time."""
    times = np.arange(0.0, windows_s.max(), 0.1)
    walk = np.cumsum(part.walk_rad_s_sqrt_s * np.sqrt(0.1) * rng.normal(size=(len(times), 3)), axis=0)
    walk += part.warming_rad_s_s * times[:, None] * rng.choice([-1.0, 1.0], 3)
    means = np.array([walk[(times >= start) & (times < end)].mean(axis=0) for start, end in windows_s])
    return means + part.scatter_rad_s * rng.normal(size=means.shape), walk.mean(axis=0)
