"""Recordings of complete sensors on complete arms, drawn within a configuration's statements on both, and undamaged.

Errors that the arm's encoders do not see lie within `uncertainty.*`, those of the sensor within its data sheet. The
p-values of checks that use exactly this knowledge are uniform.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from scipy.interpolate import CubicSpline

from rig.config.sensors.sensor_catalogue import PARTS
from rig.data.quantity import RATE
from rig.data.recording.channel import thermometer_channel, triad_channel
from rig.data.recording.recorded_sensor import RecordedSensor
from rig.data.recording.run_data import RunData
from rig.data.recording.settings import Uncertainty
from rig.estimation.arrays import Array
from rig.estimation.earth import EARTH_RATE_RAD_S, STANDARD_GRAVITY_M_S2
from rig.estimation.gyroscope.nonlinearity import CUBE_DEVIATION
from rig.motion.chain import DenavitHartenberg
from rig.motion.geometry import NOMINAL, flange_attitude, flange_pose, flange_rate
from rig.motion.steps import Sweep, Transfer
from support.recordings.drawn_ripple import Ripple
from support.recordings.synthetic_run import (
    SENSOR,
    Motion,
    Setup,
    encoder_angles,
    rotation,
    run_data,
    sample_times,
    sizes_of,
)

WRISTS = (3, 4, 5)
WAVE_SHARE = 0.3  # as the solver has it
ROUGH_ORDERS, MEASURED_TO_ROUGH = (18, 31, 50), 0.16  # of a ripple of at most 5 %, and of one of at most 0.8 %
OUTWARDS_S = 0.1  # in which a joint that begins to move comes to where its friction holds it
ARC_WAVES = np.arange(1, 5)  # of encoders: at ends 90°, 180° and 270° apart they err independently of each other
OCTAVES_S = (0.5, 2.0, 8.0, 32.0, 128.0)


@dataclass(frozen=True, slots=True)
class Kind:
    """A kind of sensor: the recorded one, and standard deviations of its noise.

    `sent`: converts rates (n, 3) to the sent ones, for sources that do not round to counts.
    """

    sensor: RecordedSensor
    noise_rad_s: float
    flicker_rad_s: float
    walk_rad_s_sqrt_s: float
    sent: Callable[[Array], Array] = lambda rates: rates


ADIS16465 = replace(
    SENSOR,
    part="adis16465",
    serial_number="ADIS16465-001",
    rate_hz=200.0,
    channels=(  # of its 32 bits, but for the last six
        triad_channel(RATE, float(np.radians(0.025)) / 2**10, 500 * 40 * 2**10, float(np.radians(500))),
        thermometer_channel(1 / 16, 25.0),
    ),
)
MPU9250 = replace(
    SENSOR,
    part="mpu9250",
    serial_number="MPU9250-001",
    rate_hz=200.0,
    channels=(
        triad_channel(RATE, float(np.radians(250)) / 2**15, 32767, float(np.radians(250))),
        thermometer_channel(1 / 333.87, 21.0),
    ),
)
KVH1775 = replace(
    SENSOR,
    part="kvh1775",
    serial_number="1775-0042",
    rate_hz=250.0,
    channels=(
        triad_channel(RATE, float(np.radians(490)) / 2**30, 2**30, float(np.radians(490))),
        thermometer_channel(0.01, 0.0),
    ),
    clock="gyro",
)
KINDS = {
    "noisy LSM9DS1": Kind(SENSOR, 0.035, 4.8e-5, 1e-5),
    "quiet LSM9DS1": Kind(SENSOR, 0.002, 4.8e-5, 1e-5),
    "ADIS16465": Kind(ADIS16465, 0.00045, 9.7e-6, 3e-7),
    "MPU-9250": Kind(MPU9250, 0.002, 4.8e-5, 1e-5),
    "KVH 1775": Kind(KVH1775, 5.5e-5, 2.4e-7, 1e-8),  # 0.012 °/√h at 250 Hz, 0.05 °/h
}


@dataclass(frozen=True, slots=True)
class Drawn:
    """A recording, and data for planting damage: the controller's time of each sample, and the sensed rates.

    The truth: `scale` (3,) at the sweeps' speed, either way, and the reading at each time without rotation.
    """

    run: RunData
    time_s: Array
    sensed_rad_s: Array
    scale: Array
    bias_rad_s: Array


def drawn(
    seed: int, kind: Kind, setup: Setup | None = None, ripple: Ripple | None = None, *, vibrates: bool = True
) -> Drawn:
    """Draw a recording. The movement is that of `setup`; its ripple is `ripple`, by default drawn."""
    rng = np.random.default_rng(seed)
    generator = rng.spawn(1)[0]
    is_rough = seed % 4 == 0  # as no arm was seen to be; the others ripple as logged ones
    setup = Setup() if setup is None else setup
    setup = replace(
        setup,
        seed=seed,
        sample_rate_hz=kind.sensor.rate_hz,
        vibration=vibrates * float(rng.uniform(0.0, 0.05)) * (1.0 if is_rough else MEASURED_TO_ROUGH),
        orders=ROUGH_ORDERS if is_rough else setup.orders,
        seen_vibration_rad_s=vibrates * float(generator.uniform(0.0, 0.002)),
        seen_vibration_hz=float(generator.uniform(8.0, 30.0)),
        boot_s=float(rng.uniform(-1e4, 0.0)),
        drift=float(rng.uniform(-5e-5, 5e-5)),
    )
    if ripple is not None:
        setup = replace(
            setup,
            vibration=ripple.fraction,
            orders=tuple(ripple.orders),
            seen_vibration_rad_s=ripple.seen_rad_s,
            seen_vibration_hz=ripple.seen_hz,
            unseen_vibration_rad_s=ripple.unseen_rad_s,
            unseen_vibration_hz=tuple(ripple.unseen_hz),
        )
    motion = Motion(setup, rng)
    uncertainty = motion.settings.uncertainty
    assert uncertainty is not None
    board_s, time_s = sample_times(setup, motion)
    q_rad, qd_rad_s, arm = _draw_true_motion(motion, time_s, uncertainty, rng, setup.encoders_err, vibrates=vibrates)
    to_flange = flange_attitude(q_rad, arm)
    place_m = CubicSpline(time_s, flange_pose(q_rad, arm)[:, :3, 3])
    pull = np.einsum("nij,nj->ni", to_flange, [0.0, 0.0, -STANDARD_GRAVITY_M_S2] - place_m(time_s, 2))
    room = EARTH_RATE_RAD_S * rng.uniform(-1, 1, 3)
    turned = flange_rate(q_rad, qd_rad_s, arm) + to_flange @ room
    rates, scale = _sense(turned, pull, kind, rng, np.radians(setup.speed_deg_s))
    bias = rng.uniform(-0.02, 0.02, 3) + _draw_drift(len(time_s), kind, rng)
    read = rates + bias + kind.noise_rad_s * rng.standard_normal(rates.shape)
    run = _delay_encoders(run_data(setup, motion, board_s, _counts(read, kind)), motion, setup, rng)
    settings = replace(run.settings, uncertainty=uncertainty.model_copy(update=sizes_of({"gyro": kind.sensor.part})))
    return Drawn(replace(run, sensors={"gyro": kind.sensor}, settings=settings), time_s, rates, scale, bias)


def add_readings(recording: Drawn, kind: Kind, by_rad_s: Array) -> RunData:
    """Return the recording with this (n, 3) added to the readings."""
    samples = recording.run.samples["gyro"].copy()
    samples["counts"] += np.round(by_rad_s / kind.sensor.channel(RATE).unit_per_count).astype(samples["counts"].dtype)
    return replace(recording.run, samples={"gyro": samples})


def _counts(read: Array, kind: Kind) -> Array:
    full = kind.sensor.channel(RATE).full_scale_counts
    assert full is not None
    counts: Array = np.clip(np.round(kind.sent(read) / kind.sensor.channel(RATE).unit_per_count), -full, full)
    return counts


def _draw_true_motion(
    motion: Motion,
    time_s: Array,
    uncertainty: Uncertainty,
    rng: np.random.Generator,
    encoders_err: float,
    *,
    vibrates: bool = True,
) -> tuple[Array, Array, DenavitHartenberg]:
    """Return true angles, true speeds and the arm's true geometry, none of which the encoders see."""
    q, qd = motion.joints(time_s)
    axis_rad, again_rad = np.radians([uncertainty.axis_deg, uncertainty.repeatability_deg])
    true, speed = q.copy(), qd.copy()
    once, twice = WAVE_SHARE * axis_rad / np.sqrt(3) * rng.standard_normal((2, 2, 6))
    encoders = rng.spawn(1)[0].standard_normal((len(ARC_WAVES), 2, 6))  # drawn in addition to the rest
    if motion.settings.has_arcs:
        encoders *= encoders_err * uncertainty.angle_std_rad / np.sqrt(len(ARC_WAVES))
        once, twice = np.zeros((2, 2, 6))  # are among them
        for joint in WRISTS:
            angle, home = np.outer(q[:, joint], ARC_WAVES), motion.plan.home_q_rad[joint] * ARC_WAVES
            cos, sin = encoders[:, :, joint].T
            true[:, joint] += (np.cos(angle) - np.cos(home)) @ cos + (np.sin(angle) - np.sin(home)) @ sin
            speed[:, joint] *= 1 + (np.cos(angle) * ARC_WAVES) @ sin - (np.sin(angle) * ARC_WAVES) @ cos
    for joint in WRISTS:
        e = q[:, joint]
        (a, b), (c, d) = once[:, joint], twice[:, joint]
        true[:, joint] += a * np.cos(e) + b * np.sin(e) + c * np.cos(2 * e) + d * np.sin(2 * e)
        speed[:, joint] *= 1 - a * np.sin(e) + b * np.cos(e) - 2 * c * np.sin(2 * e) + 2 * d * np.cos(2 * e)
        true[:, joint] += axis_rad * rng.uniform(-1, 1)
    errors = np.zeros(6)
    for step, end in zip(motion.plan.steps, motion.ends, strict=True):
        if not isinstance(step, (Sweep, Transfer)):
            continue
        moves = np.not_equal(step.start_q_rad, step.target_q_rad)
        then = np.where(moves, again_rad * rng.uniform(-1, 1, 6), errors)
        share = np.clip((time_s - (end - step.duration_s)) / OUTWARDS_S, 0, 1)
        true += share[:, None] * (then - errors)
        speed += ((share > 0) & (share < 1))[:, None] * (then - errors) / OUTWARDS_S
        errors = then
    vibration, hertz = vibrates * rng.uniform(0, 0.004), rng.uniform(8, 30)
    lines_hz = [hertz]
    if motion.unseen_hz:
        vibration, lines_hz = motion.unseen_rad_s, list(motion.unseen_hz)
    for line_hz in lines_hz:
        wave = np.cos(2 * np.pi * line_hz * time_s[:, None] + rng.uniform(0, 6, 3))
        speed[:, WRISTS] += vibration * np.sqrt(2 / len(lines_hz)) * wave
    twist = np.zeros(6)
    twist[list(WRISTS)] = axis_rad * rng.uniform(-1, 1, 3)
    alpha = tuple((np.array(NOMINAL.alpha_rad) + twist).tolist())
    return true, speed, replace(NOMINAL, alpha_rad=alpha)


def _sense(turned: Array, pull: Array, kind: Kind, rng: np.random.Generator, speed_rad_s: float) -> tuple[Array, Array]:
    """Return the rates (n, 3) of a misaligned, non-orthogonal, nonlinear sensor that senses gravity, and its scale
    (3,).
    """
    part = PARTS[kind.sensor.part]
    rates = turned @ rotation(rng.normal(0, np.radians(2), 3)).T
    most_rad = np.radians(part.non_orthogonality_deg) / 2  # the other axis of an angle may be tilted as far
    leaning = np.eye(3) + np.clip(rng.normal(0, np.sqrt(2) / 3 * most_rad, (3, 3)), -most_rad, most_rad)
    rates = rates @ leaning
    cube = part.nonlinearity_percent / 100 / CUBE_DEVIATION / kind.sensor.range_rad_s**2 * rng.uniform(-1, 1, 3)
    to_gravity = np.radians(part.g_sensitivity_deg_s_g) / STANDARD_GRAVITY_M_S2 * rng.uniform(-1, 1, (3, 3))
    scale = rng.uniform(0.9, 1.1, 3)
    even = part.asymmetry_percent / 100 / kind.sensor.range_rad_s * rng.uniform(-1, 1, 3)
    readings: Array = rates * (1 + cube * rates**2 + even * rates) / scale + pull @ to_gravity.T
    whole = np.linalg.norm(leaning, axis=0)
    return readings, scale / (whole * (1 + cube * (whole * speed_rad_s) ** 2))


def _draw_drift(count: int, kind: Kind, rng: np.random.Generator) -> Array:
    """Return the bias drift (n, 3): a random walk, and processes whose time constants are an octave or two apart."""
    from scipy.signal import lfilter

    step_s = 1 / kind.sensor.rate_hz
    walk = rng.uniform(0.5, 3) * kind.walk_rad_s_sqrt_s * np.sqrt(step_s)
    wandered = np.cumsum(walk * rng.standard_normal((count, 3)), axis=0)
    size = rng.uniform(0.5, 1.5) * kind.flicker_rad_s  # two octaves of flicker make its Allan deviation
    for octave_s in OCTAVES_S:
        memory = np.exp(-step_s / octave_s)
        steps = size * np.sqrt(1 - memory**2) * rng.standard_normal((count, 3))
        steps[0] = size * rng.standard_normal(3)
        wandered += lfilter([1.0], [1.0, -memory], steps, axis=0)
    return wandered


def _delay_encoders(run: RunData, motion: Motion, setup: Setup, rng: np.random.Generator) -> RunData:
    """Read the encoders slightly after the time of a state."""
    arm = run.states.copy()
    late_s = rng.uniform(0, 1e-4) * rng.standard_normal(len(arm))
    q_rad, _ = motion.joints(arm["time_s"] + late_s)
    arm["q_rad"] = encoder_angles(setup, q_rad)
    return replace(run, states=arm)
