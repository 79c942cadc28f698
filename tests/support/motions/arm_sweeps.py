"""Sweeps and dwells of a UR10e that carries an accelerometer, whose readings follow from the motion of the flange.

The acceleration comes from second differences of the flange's true motion; no code is shared with the closed forms of
`rig.estimation.reference.accelerometer_model`.
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache

import numpy as np
from scipy.interpolate import CubicSpline

from rig.config.load import parse
from rig.config.procedures.procedure_sections import SixSweepsSection
from rig.estimation.arrays import Array
from rig.estimation.reference.accelerometer_model import Dwells, Sweeps
from rig.estimation.reference.sweep_harmonics import JointTurn, estimate_acceleration, evenly_turning
from rig.motion.geometry import flange_arm, flange_axes, flange_pose
from rig.motion.steps import Sweep
from rig.plans.motions.six_sweeps import plan_six_observation
from support.recordings.synthetic_run import CONFIG

Poses = Callable[[Array], Array]  # of the flange (n, 4, 4), at joint angles (n, 6)

STEP_RAD = 1e-3  # of the second differences
POINTS = 360  # of a turn
DWELL_S = 3.0
MICRO_G = 9.80665e-6


@dataclass(frozen=True, slots=True)
class Truth:
    """An accelerometer on the flange of an arm: F (3, 3), b, v_ref, r, τ."""

    matrix: Array
    bias_m_s2: Array
    reference_m_s2: Array
    lever_arm_m: Array
    delay_s: float

    def theta(self) -> Array:
        """Return the parameters (22,) in the order of `rig.estimation.reference.accelerometer_model`."""
        return np.concatenate(
            [self.matrix.ravel(), self.reference_m_s2, self.bias_m_s2, self.lever_arm_m, [self.delay_s], np.zeros(3)]
        )


@cache
def plan_sweeps(axes: int, speed_deg_s: float = 60.0) -> tuple[Sweep, ...]:
    """Return the sweeps of the procedure about three or six axes."""
    text = CONFIG.format(
        speed_deg_s=speed_deg_s, rest_s=0.0, repeats=1, part="lsm9ds1", procedure=f", axes: {axes}", uncertainty=""
    )
    config = parse(text).config
    assert isinstance(config.procedure, SixSweepsSection)
    plan = plan_six_observation(config.arm, config.procedure)
    return tuple(step for step in plan.steps if isinstance(step, Sweep))


def find_signed_speed(sweep: Sweep) -> float:
    """Return the joint's speed , rad/s."""
    return sweep.speed_rad_s if sweep.direction == "ccw" else -sweep.speed_rad_s


def joints_at(sweep: Sweep, angle_rad: Array) -> Array:
    """Return joint angles (n, 6), the swept joint turned by angles (n,) from the revolution's lower end."""
    joints = np.tile(sweep.start_q_rad, (len(angle_rad), 1))
    joints[:, sweep.joint] = sweep.revolution_rad[0] + angle_rad
    return joints


def specific_force(
    poses: Poses, sweep: Sweep, motion: tuple[Array, Array, Array], reference_m_s2: Array, lever_arm_m: Array
) -> Array:
    """Return the specific force (n, 3) in the flange's frame, by the joint's angle, speed, acceleration, each (n,)."""
    angle, speed, acceleration = motion
    before, middle, after = (poses(joints_at(sweep, angle + step)) for step in (-STEP_RAD, 0.0, STEP_RAD))
    positions = [pose[:, :3, :3] @ lever_arm_m + pose[:, :3, 3] for pose in (before, middle, after)]
    slope, bend = (
        (positions[2] - positions[0]) / (2 * STEP_RAD),
        (positions[2] - 2 * positions[1] + positions[0]) / STEP_RAD**2,
    )
    moved = acceleration[:, None] * slope + speed[:, None] ** 2 * bend
    force: Array = np.einsum("nji,nj->ni", middle[:, :3, :3], moved + reference_m_s2)
    return force


def record_sweeps(
    truth: Truth, poses: Poses, sweeps: tuple[Sweep, ...], density_ug: float, rng: np.random.Generator
) -> Sweeps:
    """Return the first harmonics of uniform sweeps, with white noise in µg/√Hz."""
    harmonics = []
    covariances = []
    angle = np.arange(POINTS) * 2 * np.pi / POINTS
    columns = np.column_stack([np.full(POINTS, 0.5), np.cos(angle), np.sin(angle)]) * 2 / POINTS
    for sweep in sweeps:
        speed = find_signed_speed(sweep)
        motion = angle - speed * truth.delay_s, np.full(POINTS, speed), np.zeros(POINTS)
        s = specific_force(poses, sweep, motion, truth.reference_m_s2, truth.lever_arm_m)
        variance = (density_ug * MICRO_G) ** 2 * sweep.speed_rad_s / (2 * np.pi) * np.repeat([1.0, 2.0, 2.0], 3)
        m = columns.T @ (s @ truth.matrix.T + truth.bias_m_s2)
        harmonics.append(m + (np.sqrt(variance) * rng.normal(size=9)).reshape(3, 3))
        covariances.append(np.diag(variance))
    return make_sweeps(np.array(harmonics), np.array(covariances), sweeps)


def make_sweeps(harmonics: Array, covariances: Array, sweeps: tuple[Sweep, ...]) -> Sweeps:
    """Return the sweeps as the arm reports them."""
    joints = np.array([joints_at(sweep, np.zeros(1))[0] for sweep in sweeps])
    places = np.arange(len(sweeps)), slice(None), [sweep.joint for sweep in sweeps]
    poses = flange_pose(joints)
    return Sweeps(
        harmonics_m_s2=harmonics,
        swayed_m_s2=np.zeros_like(harmonics),
        covariances_m2_s4=covariances,
        axes_flange=flange_axes(joints)[places],
        speeds_rad_s=np.array([find_signed_speed(sweep) for sweep in sweeps]),
        turning_rad2_s2=np.array([evenly_turning(sweep.speed_rad_s) for sweep in sweeps]),
        attitudes=poses[:, :3, :3],
        arms_m=np.array([flange_arm(q, sweep.joint) for q, sweep in zip(joints, sweeps, strict=True)]),
        stations=np.unique(np.round(joints, 3), axis=0, return_inverse=True)[1],
    )


def record_dwells(truth: Truth, poses: Poses, joints: Array, density_ug: float, rng: np.random.Generator) -> Dwells:
    """Return rests at joint angles (N, 6), with white noise in µg/√Hz."""
    std = density_ug * MICRO_G / np.sqrt(DWELL_S)
    forces = np.einsum("nji,j->ni", poses(joints)[:, :3, :3], truth.reference_m_s2)
    readings = forces @ truth.matrix.T + truth.bias_m_s2
    attitudes = flange_pose(joints)[:, :3, :3]
    return Dwells(readings + std * rng.normal(size=readings.shape), np.full_like(readings, std**2), attitudes)


@dataclass(frozen=True, slots=True)
class Sampling:
    """The sampling of a revolution, with its imperfections.

    Each sample has the noise `noise_m_s2`; the servo's ripple is the fraction `vibration` of the rate, with `cycles`
    per turn; the arm's states come `state_rate_hz` times a second with angles in steps of `encoder_step_rad`; the
    samples' times, on the arm's clock, are late by `clock_error_s`.
    """

    noise_m_s2: float
    rate_hz: float = 238.0
    state_rate_hz: float = 125.0
    vibration: float = 0.05
    cycles: tuple[float, ...] = (18, 31, 50)
    encoder_step_rad: float = 6e-6
    clock_error_s: float = 2e-4


@dataclass(frozen=True, slots=True)
class Samples:
    """Samples of one revolution: time (n,), readings (n, 3), and the joint's motion by the arm's states."""

    time_s: Array
    readings_m_s2: Array
    turn: JointTurn


def record_samples(truth: Truth, poses: Poses, sweep: Sweep, sampling: Sampling, rng: np.random.Generator) -> Samples:
    """Return one recorded revolution."""
    phases, speed = rng.uniform(0, 2 * np.pi, len(sampling.cycles)), find_signed_speed(sweep)

    def motion(time_s: Array) -> tuple[Array, Array, Array]:
        """Return the joint's angle, speed and acceleration, with a ripple locked to the commanded angle."""
        smooth, share = np.pi + speed * time_s, sampling.vibration * np.sqrt(2 / len(sampling.cycles))
        waves = [(cycles, cycles * smooth + phase) for cycles, phase in zip(sampling.cycles, phases, strict=True)]
        none = np.zeros_like(smooth)
        return (
            smooth + sum((share / cycles * np.sin(wave) for cycles, wave in waves), none),
            speed * (1 + sum((share * np.cos(wave) for _, wave in waves), none)),
            -(speed**2) * sum((share * cycles * np.sin(wave) for cycles, wave in waves), none),
        )

    half_s = np.pi / sweep.speed_rad_s
    states_s = np.arange(-half_s - 0.5, half_s + 0.5, 1 / sampling.state_rate_hz)
    step = sampling.encoder_step_rad
    spline = CubicSpline(states_s, np.round(motion(states_s)[0] / step) * step)
    true_s = np.arange(-half_s - 0.1, half_s + 0.1, 1 / sampling.rate_hz)
    time_s = true_s + sampling.clock_error_s
    inside = (spline(time_s) >= 0) & (spline(time_s) < 2 * np.pi)
    forces = specific_force(
        poses, sweep, motion(true_s[inside] - truth.delay_s), truth.reference_m_s2, truth.lever_arm_m
    )
    readings = forces @ truth.matrix.T + truth.bias_m_s2 + sampling.noise_m_s2 * rng.normal(size=forces.shape)
    time_s = time_s[inside]
    acceleration = estimate_acceleration(spline, time_s, sweep.speed_rad_s)
    order = np.argsort(spline(states_s))
    ends_s = np.interp([0.0, 2 * np.pi], spline(states_s)[order], states_s[order])
    return Samples(time_s, readings, JointTurn(2 * np.pi / np.diff(ends_s)[0], spline(time_s), acceleration))
