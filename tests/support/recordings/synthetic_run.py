"""Recordings computed rather than recorded: data for the pure functions behind the run file.

The arm follows the rig's own plan with trapezoid ramps and a ripple locked to the joint angle; the board's clock has
its own epoch and rate; readings follow g = K (m + b) with mounting error, noise, quantisation and saturation.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from firmware_host.emulator.parts.accelerometer import STANDARD_GRAVITY_M_S2
from firmware_host.samples import SAMPLE_DTYPE
from rig.config.judging.judging_keys import SENSOR_KEYS
from rig.config.load import parse
from rig.config.procedures.procedure_sections import SixSweepsSection
from rig.config.sensors.sensor_catalogue import PARTS
from rig.data.quantity import RATE
from rig.data.recording.channel import thermometer_channel, triad_channel
from rig.data.recording.provenance import Provenance
from rig.data.recording.recorded_events import Event, RestFinished, RestStarted, SweepFinished, SweepStarted, TimedEvent
from rig.data.recording.recorded_sensor import RecordedSensor
from rig.data.recording.recorded_turner import RecordedTurner
from rig.data.recording.run_data import RunData
from rig.data.recording.settings import settings_of
from rig.estimation.arrays import Array
from rig.motion.chain import DenavitHartenberg
from rig.motion.geometry import NOMINAL, flange_rate
from rig.motion.state_rows import ARM_FIELDS, ARM_STATE_DTYPE
from rig.motion.steps import Dwell, Plan, Rest, Step, Sweep, Transfer
from rig.motion.turner_state import JOINT_NAMES
from rig.plans.motions.six_sweeps import plan_six_observation
from rig.world.site import SiteTruth
from rig.world.ur10e.motion.flange_motion import find_motion, transfer_force
from rig.world.ur10e.motion.links import links

CONFIG = """
arm: {{host: 192.0.2.1, payload_kg: 0.35}}
board: {{port: /dev/ttyACM0}}
sensors: {{gyro: {{part: {part}, serial_number: LSM9DS1-001}}}}
procedure: {{speed_deg_s: {speed_deg_s}, rest_s: {rest_s}, repeats: {repeats}{procedure}}}
limits: {{scale_deviation: 0.3, scale_std: 0.002, bias_rad_s: 0.1, bias_std_rad_s: 0.002, condition: 100}}{uncertainty}
"""
PROVENANCE = Provenance(
    started_utc="2026-11-21T00:00:00+00:00",
    rig_version="0.2.0",
    python_version="3.11.7",
    package_versions={},
    configuration_sha256="",
    arm_serial_number="2026",
    arm_software="URSoftware 5.14.0.0 (synthetic)",
    board_unique_id="0123",
    firmware_version="0.2.0",
    sensor_serial_numbers={"gyro": "LSM9DS1-001"},
    arm_maker="Universal Robots",
    turner_kind="ur",
)
UR = RecordedTurner("ur", "Universal Robots", "UR10e", JOINT_NAMES, NOMINAL, ARM_FIELDS)
SCALE = (1.1771, 1.1554, 1.1440)
BIAS_RAD_S = (0.0077, -0.0100, -0.0051)
SENSITIVITY = float(np.radians(8.75e-3))


@dataclass(frozen=True, slots=True)
class Setup:
    """The settings of a synthetic recording."""

    seed: int = 1
    speed_deg_s: float = 60.0
    rest_s: float = 3.0
    repeats: int = 1
    scale: tuple[float, ...] = SCALE
    bias_rad_s: tuple[float, ...] = BIAS_RAD_S
    noise_rad_s: float = 0.035
    noise_correlation: float = 0.0  # from sample to sample
    mounting_error_rad: tuple[float, ...] = (0.05, -0.035, 0.06)
    vibration: float = 0.003  # RMS of the rate ripple over the rate, as of the simulated arm
    orders: tuple[int, ...] = (100, 200, 400)  # how many times each part of it comes in a turn
    seen_vibration_rad_s: float = 0.0  # RMS, of each wrist, that is not locked to its turning
    seen_vibration_hz: float = 10.0
    unseen_vibration_rad_s: float = 0.0  # that no encoder sees, of `drawn_recording`: another is drawn if it has
    unseen_vibration_hz: tuple[float, ...] = ()  # no frequencies
    state_rate_hz: float = 125.0
    encoder_step_rad: float = 6e-6
    encoder_noise_rad: float = 2.4e-5
    sample_rate_hz: float = 238.0
    boot_s: float = -4321.0  # controller time at which the board's clock stood at zero
    drift: float = -35e-6  # of the controller against the board
    follows_crystal: bool | None = False  # the board's word on its clock
    kinematics: DenavitHartenberg = NOMINAL  # how the arm is made
    procedure: tuple[tuple[str, str], ...] = ()  # further keys of its section, and their values
    angle_std_deg: float | None = None  # stated for the encoders
    encoders_err: float = 1.0  # true errors relative to the stated ones
    odd_per_rad_s: float = 0.0  # of each axis
    even_per_rad_s: float = 0.0
    stated_kinematics: DenavitHartenberg | None = None  # how its controller says it is made
    g_sensitivity_rad_s_per_g: tuple[tuple[float, ...], ...] = ()  # of the sensor's axes to the sensed force
    offset_m: tuple[float, ...] = (0.0, 0.0, 0.0)  # from the flange's centre
    part: str = "lsm9ds1"  # its name; its properties are above


def truth(setup: Setup) -> Array:
    """Return the true parameters (6,) kx ky kz bx by bz."""
    return np.array([*setup.scale, *setup.bias_rad_s])


class Motion:
    """Joint angles and speeds of a planned movement with its ripple, at any controller time. Begins at time 100 s."""

    def __init__(self, setup: Setup, rng: np.random.Generator) -> None:
        self.config = CONFIG.format(
            speed_deg_s=setup.speed_deg_s,
            rest_s=setup.rest_s,
            repeats=setup.repeats,
            part=setup.part,
            procedure="".join(f", {key}: {value}" for key, value in setup.procedure),
            uncertainty=""
            if setup.angle_std_deg is None
            else f"\nuncertainty: {{angle_std_deg: {setup.angle_std_deg}}}",
        )
        config = parse(self.config).config
        assert isinstance(config.procedure, SixSweepsSection)
        self.plan: Plan = plan_six_observation(config.arm, config.procedure)
        self.settings = settings_of(config, self.plan)
        self.ends = 101.0 + np.cumsum([step.duration_s for step in self.plan.steps])
        self.cycles = np.array(setup.orders)
        self.rates = np.full(len(setup.orders), setup.vibration * np.sqrt(2 / len(setup.orders)))
        self.phases = rng.uniform(0, 2 * np.pi, len(setup.orders))
        self.seen_rad_s, self.seen_hz = setup.seen_vibration_rad_s, setup.seen_vibration_hz
        self.unseen_rad_s, self.unseen_hz = setup.unseen_vibration_rad_s, setup.unseen_vibration_hz
        self.seen_phases = rng.spawn(1)[0].uniform(0, 2 * np.pi, 3)  # later draws remain the same
        self.end_s = float(self.ends[-1]) + 1.0

    def joints(self, time_s: Array) -> tuple[Array, Array]:
        """Return q (n, 6) and its time derivative (n, 6) at increasing times (n,)."""
        pose = np.array(self.plan.home_q_rad)
        smooth, speed = np.tile(pose, (len(time_s), 1)), np.zeros((len(time_s), 6))
        places = [np.searchsorted(time_s, 101.0), *np.searchsorted(time_s, self.ends, side="right")]
        for step, end_s, inside in zip(self.plan.steps, self.ends, map(slice, places[:-1], places[1:]), strict=True):
            if isinstance(step, (Rest, Dwell)):
                smooth[inside] = pose
                continue
            fraction, rate = _trapezoid(time_s[inside] - (end_s - step.duration_s), step)
            start, target = np.array(step.start_q_rad), np.array(step.target_q_rad)
            smooth[inside] = start + fraction[:, None] * (target - start)
            speed[inside] = rate[:, None] * (target - start)
            pose = target
        q, gain = smooth.copy(), np.ones_like(smooth)
        for cycles, rate_share, phase in zip(self.cycles, self.rates, self.phases, strict=True):
            turned = cycles * smooth[:, 3:] + phase
            q[:, 3:] += rate_share / cycles * np.sin(turned)
            gain[:, 3:] += rate_share * np.cos(turned)
        qd, turn = gain * speed, 2 * np.pi * self.seen_hz
        if self.seen_rad_s:
            phase = turn * time_s[:, None] + self.seen_phases
            q[:, 3:] += np.sqrt(2) * self.seen_rad_s / turn * np.sin(phase)
            qd[:, 3:] += np.sqrt(2) * self.seen_rad_s * np.cos(phase)
        return q, qd

    def events(self) -> tuple[TimedEvent, ...]:
        """Return the events as the procedure writes them."""
        events = []
        for step, end in zip(self.plan.steps, self.ends, strict=True):
            for event, time_s in zip(_events(step), (float(end - step.duration_s), float(end)), strict=False):
                events.append(TimedEvent(event, time_s + 1e4, time_s))
        return tuple(events)


def true_rate(motion: Motion, time_s: Array, kinematics: DenavitHartenberg = NOMINAL) -> Array:
    """Return the angular velocity (n, 3) of the flange in its frame, in rad/s."""
    q, qd = motion.joints(time_s)
    return flange_rate(q, qd, kinematics)


def synthetic_run(setup: Setup) -> RunData:
    """Compute a complete recording."""
    rng = np.random.default_rng(setup.seed)
    motion = Motion(setup, rng)
    board_s, controller_s = sample_times(setup, motion)
    rate = true_rate(motion, controller_s, setup.kinematics)
    force = true_force(setup, motion, controller_s) if setup.g_sensitivity_rad_s_per_g else None
    return run_data(setup, motion, board_s, readings(setup, rate, rng, force))


def true_force(setup: Setup, motion: Motion, time_s: Array) -> Array:
    """Return the specific force (n, 3) in g at the sensor, as the simulated laboratory computes it."""
    (q, qd), step_s = motion.joints(time_s), 1e-4
    qdd = (motion.joints(time_s + step_s)[1] - motion.joints(time_s - step_s)[1]) / (2 * step_s)
    turns = [(np.cos(angle), np.sin(angle)) for angle in q.T]
    flange_motion = find_motion(
        turns, list(qd.T), list(qdd.T), links(), SiteTruth((0.0, 0.0, 0.0), (0.0, 0.0, STANDARD_GRAVITY_M_S2))
    )
    return np.column_stack(transfer_force(*flange_motion, setup.offset_m)) / STANDARD_GRAVITY_M_S2


def sample_times(setup: Setup, motion: Motion) -> tuple[Array, Array]:
    """Return board times (n,) and their controller times (n,); sampling starts and ends with the recording."""
    controller = np.arange(100.3, motion.end_s - 0.4, 1 / setup.sample_rate_hz)
    return (controller - setup.boot_s) / (1 + setup.drift), controller


def readings(setup: Setup, rate: Array, rng: np.random.Generator, force_g: Array | None = None) -> Array:
    """Return the counts (n, 3) of a sensor at the flange's rate (n, 3) and specific force."""
    mounted = rotation(np.array(setup.mounting_error_rad))
    turned = rate @ mounted.T
    turned = turned * (1 + setup.odd_per_rad_s * np.abs(turned) + setup.even_per_rad_s * turned)
    noise = rng.normal(size=turned.shape)
    if setup.noise_correlation:
        fresh = np.sqrt(1 - setup.noise_correlation**2) * noise
        for i in range(1, len(noise)):
            noise[i] = setup.noise_correlation * noise[i - 1] + fresh[i]
    m = turned / np.array(setup.scale) - np.array(setup.bias_rad_s) + setup.noise_rad_s * noise
    if force_g is not None:
        m += force_g @ mounted.T @ np.array(setup.g_sensitivity_rad_s_per_g).T
    counts: Array = np.clip(np.round(m / SENSITIVITY), -32768, 32767)
    return counts


def sizes_of(parts: Mapping[str, str]) -> dict[str, dict[str, float]]:
    """Return the defaults of `uncertainty` for sensors of these parts, by name."""
    return {what: {name: float(getattr(PARTS[part], what)) for name, part in parts.items()} for what in SENSOR_KEYS}


def run_data(setup: Setup, motion: Motion, board_s: Array, counts: Array) -> RunData:
    """Return the recording of given readings."""
    samples = np.zeros(len(board_s), SAMPLE_DTYPE)
    samples["sequence"] = 1000 + np.arange(len(board_s))
    samples["board_time_us"] = np.round(board_s * 1e6)
    samples["host_time_s"] = 1e4 + np.arange(len(board_s))
    samples["counts"] = counts
    samples["temperature_counts"] = -48  # 22 °C
    times = np.arange(100.0, motion.end_s, 1 / setup.state_rate_hz)
    arm = np.zeros(len(times), ARM_STATE_DTYPE)
    q, qd = motion.joints(times)
    arm["time_s"], arm["host_time_s"] = times, times + 1e4
    arm["q_rad"], arm["qd_rad_s"] = encoder_angles(setup, q), qd
    arm["target_speed_fraction"] = arm["speed_scaling"] = 1.0
    arm["robot_mode"], arm["safety_mode"], arm["runtime_state"] = 7, 1, 2
    provenance = replace(
        PROVENANCE, arm_kinematics=setup.stated_kinematics, board_follows_crystal=setup.follows_crystal
    )
    return RunData(
        motion.config,
        motion.settings,
        provenance,
        replace(UR, geometry=provenance.arm_kinematics or NOMINAL),
        {"gyro": replace(SENSOR, part=setup.part)},
        {"gyro": samples},
        arm,
        motion.events(),
    )


def encoder_angles(setup: Setup, q_rad: Array) -> Array:
    """Return the encoders' angles (n, 6), with their noise and steps."""
    noise = np.random.default_rng([setup.seed, 24]).standard_normal(q_rad.shape)
    return np.round((q_rad + setup.encoder_noise_rad * noise) / setup.encoder_step_rad) * setup.encoder_step_rad


SENSOR = RecordedSensor(
    part="lsm9ds1",
    serial_number="LSM9DS1-001",
    rate_hz=238.0,
    channels=(triad_channel(RATE, SENSITIVITY, 32767, float(np.radians(245))), thermometer_channel(1 / 16, 25.0)),
    mounting=((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)),
)


def _events(step: Step) -> tuple[Event, ...]:
    """Return the events at the beginning and at the end of a step."""
    if isinstance(step, Sweep):
        return SweepStarted(step), SweepFinished(step)
    return (RestStarted(), RestFinished()) if isinstance(step, Rest) else ()


def _trapezoid(since_s: Array, step: Sweep | Transfer) -> tuple[Array, Array]:
    """Return the fraction of the motion (n,) and its derivative (n,) in 1/s."""
    distance = float(np.max(np.abs(np.array(step.target_q_rad) - np.array(step.start_q_rad))))
    ramp = min(step.speed_rad_s / step.acceleration_rad_s2, step.duration_s / 2)
    top = step.acceleration_rad_s2 * ramp
    remaining_s = np.minimum(since_s, step.duration_s - since_s)
    rate = np.minimum(remaining_s / ramp, 1.0) * top
    ramped = 0.5 * top * np.minimum(remaining_s, ramp) ** 2 / ramp
    half = ramped + top * np.maximum(remaining_s - ramp, 0)
    return np.where(since_s < step.duration_s / 2, half, distance - half) / distance, rate / distance


def rotation(vector: Array) -> Array:
    angle = float(np.linalg.norm(vector))
    if angle == 0:
        return np.eye(3)
    x, y, z = vector / angle
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    rotation: Array = np.eye(3) + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross
    return rotation
