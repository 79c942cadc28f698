"""Runs on the simulated servo in virtual time, whose registers are accessed as by the driver.

Each run draws the encoder's phases and the noise, the errors of gear and adapter, and the sensor.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from firmware_host.samples import SAMPLE_DTYPE
from rig.config.judging.judging_keys import UncertaintySection
from rig.config.load import Loaded, parse
from rig.config.procedures.servo_procedure import ServoSixObservationSection
from rig.config.procedures.servo_section import ServoSection
from rig.config.procedures.stage_section import rotation_by
from rig.data.recording.recorded_events import Event, RestFinished, RestStarted, SweepFinished, SweepStarted, TimedEvent
from rig.data.recording.recorded_sensor import RecordedSensor
from rig.data.recording.recorded_turner import RecordedTurner
from rig.data.recording.run_data import RunData
from rig.data.recording.settings import settings_of
from rig.estimation.arrays import Array
from rig.motion.steps import Plan, Rest, Sweep, Transfer
from rig.plans.motions.servo_sweeps import plan_servo_six_observation
from rig.turners.servo.goal_profiles import move_of
from rig.turners.servo.servo_kind import SERVO
from rig.turners.servo.servo_models import find_model
from rig.turners.servo.servo_registers import DRIVE_MODE, GOAL, OPERATING_MODE, PROFILE, STATE, TORQUE, Register
from rig.turners.servo.servo_state import JOINTS, SERVO_STATE_DTYPE, decode
from rig.world.servo.servo import SimulatedServo
from rig.world.servo.shaft import Shaft
from rig.world.servo.truth import ServoTruth
from rig.world.servo.wire_format import READ, WRITE, ServoPacket
from support.paths import ROOT
from support.recordings.synthetic_run import PROVENANCE, SENSITIVITY, SENSOR

# What else is known of the part is left out: it is not drawn.
GIVEN_UNCERTAINTIES = (
    "g_sensitivity_deg_s_g=0.1", "non_orthogonality_deg=0.5", "nonlinearity_percent=0", "bias_deg_s_k=0",
    "scale_ppm_k=0", "bias_instability_deg_h=0",
)  # fmt: skip
CONFIG = (ROOT / "configs" / "servo.yaml").read_text(encoding="utf-8")
BEGINS_S, SETTLES_S = 100.0, 0.25
STAMPED_S = 0.6e-3  # half a transaction's length, which is not always alike
MISSED = 2e-3  # of the states


@dataclass(frozen=True, slots=True)
class Drawn:
    """The recordings of a run, a stage each, and the truth: scale and bias (3,) of g = K (m + b), and the shafts."""

    runs: list[RunData]
    shafts: list[Shaft]
    scale: Array
    bias_rad_s: Array


Until = tuple[float, float, float]  # when a stage ends, s, by how much the sensor's clock is off, and its noise, rad/s
# What reads a `servo` by `rows` (3, 3) in the sensor, of such scale and bias, and how a recording describes it.
Source = Callable[
    [SimulatedServo, Array, tuple[Array, Array], Until, np.random.Generator], tuple[RecordedSensor, np.ndarray]
]


class Far:
    """A servo addressed in virtual time."""

    def __init__(self, truth: ServoTruth) -> None:
        self.servo = SimulatedServo(truth, BEGINS_S - 1.0)
        self.model = find_model(truth.model.lower().replace("-", "_"))

    def write(self, time_s: float, register: Register, *values: int) -> None:
        data = register.address.to_bytes(2, "little") + register.pack(*values)
        self.servo.advance(time_s)
        self.servo.obey(ServoPacket(1, WRITE, data, True), time_s)

    def read(self, time_s: float, register: Register) -> bytes:
        request = register.address.to_bytes(2, "little") + register.size.to_bytes(2, "little")
        self.servo.advance(time_s)
        answer = self.servo.obey(ServoPacket(1, READ, request, True), time_s)
        assert answer is not None and answer[8] & 0x7F == 0
        return answer[9:-2].replace(b"\xff\xff\xfd\xfd", b"\xff\xff\xfd")


def load_servo(overrides: tuple[str, ...] = ()) -> Loaded:
    """Load configs/servo.yaml."""
    return parse(CONFIG, overrides=overrides, turners={"servo": ServoSection})


def drawn_servo(
    seed: int,
    overrides: tuple[str, ...] = (),
    *,
    mounting_deg: float = 1.0,
    adapter_deg: float = 1.0,
    noise_rad_s: float = 0.035,
    scales: tuple[float, float] = (0.9, 1.15),
    truth: ServoTruth | None = None,
    source: Source | None = None,
) -> Drawn:
    """Draw a run of configs/servo.yaml with these `overrides`, with the samples of another `source` than a board.

    `noise_rad_s`: of one reading; the scale factors lie between the `scales`. The sensor's mounting has an error of
    `mounting_deg`, the item's in each stage of `adapter_deg`, in random directions.
    """
    rng = np.random.default_rng([seed, 43])
    configuration = load_servo((*(f"uncertainty.{key}" for key in GIVEN_UNCERTAINTIES), *overrides))
    config = configuration.config
    assert isinstance(config.turner, ServoSection) and isinstance(config.procedure, ServoSixObservationSection)
    plan = plan_servo_six_observation(config.turner, config.procedure)
    settings = settings_of(config, plan)
    scale, bias = rng.uniform(*scales, 3), rng.uniform(-0.02, 0.02, 3)
    sits = _leaning(rng, config.uncertainty) @ rotation_by(np.radians(mounting_deg) * _direction(rng)).T
    g_sensitivity = np.radians(config.uncertainty.g_sensitivity_deg_s_g or 0.0) * rng.uniform(-1, 1, (3, 3))
    drift = float(rng.uniform(-3e-5, 3e-5))
    runs: list[RunData] = []
    shafts: list[Shaft] = []
    for stage, key in enumerate(plan.stages):
        gear = truth or ServoTruth(
            start_deg=float(rng.uniform(0, 360)),
            encoder_once_phase_deg=float(rng.uniform(0, 360)),
            encoder_twice_phase_deg=float(rng.uniform(0, 360)),
            seed=int(rng.integers(1 << 31)),
        )
        far = Far(gear)
        shafts.append(far.servo.shaft)
        done = frozenset[int]().union(*(other.indices for other in plan.stages if other is not key))
        own_plan = plan_servo_six_observation(config.turner, config.procedure, None, done)
        states, events, end_s = _driven(far, own_plan, 1 / config.turner.state_rate_hz, rng)
        mount = rotation_by(np.radians(adapter_deg) * _direction(rng)).T @ np.array(key.mount)
        model = scale, bias - g_sensitivity @ sits @ mount[:, 2]
        sampled = source or partial(_sample, rate_hz=config.sensors["gyro"].rate_hz)
        sensor, samples = sampled(far.servo, sits @ mount, model, (end_s, drift, noise_rad_s), rng)
        runs.append(
            RunData(
                configuration.rig_text,
                replace(settings, stage=stage),
                replace(PROVENANCE, turner_kind="servo", board_follows_crystal=False),
                RecordedTurner.build("servo", SERVO.describe_configured(config.turner), JOINTS, SERVO.fields),
                {"gyro": sensor if source else replace(sensor, part=config.sensors["gyro"].part)},
                {"gyro": samples},
                states,
                events,
            )
        )
    return Drawn(runs, shafts, scale, bias)


def _leaning(rng: np.random.Generator, uncertainty: UncertaintySection) -> Array:
    """Return unit rows (3, 3): a sensor's axes, not quite orthogonal."""
    angle = np.radians(uncertainty.non_orthogonality_deg or 0.0)
    axes = np.eye(3) + np.tril(angle * rng.uniform(-1, 1, (3, 3)), -1)
    unit: Array = axes / np.linalg.norm(axes, axis=1, keepdims=True)
    return unit


def _direction(rng: np.random.Generator) -> Array:
    vector: Array = rng.normal(size=3)
    unit: Array = vector / np.linalg.norm(vector)
    return unit


def _driven(
    far: Far, plan: Plan, period_s: float, rng: np.random.Generator
) -> tuple[np.ndarray, tuple[TimedEvent, ...], float]:
    """Return the states of a stage, its events, and the time of its end."""
    time_s = BEGINS_S
    home = round(plan.home_q_rad[0] / (2 * np.pi) * 4096)
    for register, values in ((DRIVE_MODE, (4,)), (OPERATING_MODE, (4,)), (TORQUE, (1,)), (PROFILE, (500, 1500))):
        far.write(time_s - 0.9, register, *values)
    far.write(time_s - 0.8, GOAL, home)
    events = list[TimedEvent]()
    rows = []
    next_s = time_s

    def poll(until_s: float) -> None:
        nonlocal next_s
        while next_s < until_s:
            if rng.random() > MISSED:
                half_s = 1.2e-3 + STAMPED_S * rng.uniform(0, 1)
                at_s = next_s + rng.uniform(0, 2 * half_s)
                data = far.read(at_s, STATE)
                window = next_s, next_s + 2 * half_s
                rows.append(decode(data, far.model, window, window[1] + 1e4, 0).to_record())
            next_s += period_s

    def note(event: Event) -> None:
        newest = rows[-1][0]
        assert isinstance(newest, float)
        events.append(TimedEvent(event, newest + 1e4, newest))

    poll(time_s + 1.5)
    for step in plan.steps:
        if isinstance(step, Rest):
            note(RestStarted())
            poll(next_s + step.duration_s)
            note(RestFinished())
            continue
        assert isinstance(step, Sweep | Transfer)
        if isinstance(step, Sweep):
            note(SweepStarted(step))
        move = move_of(step)
        far.write(next_s, PROFILE, move.ramp_ms, move.total_ms)
        far.write(next_s + 0.001, GOAL, move.goal)
        poll(next_s + step.duration_s + SETTLES_S)
        if isinstance(step, Sweep):
            note(SweepFinished(step))
    poll(next_s + 1.0)
    return np.array(rows, SERVO_STATE_DTYPE), tuple(events), next_s


def _sample(
    servo: SimulatedServo,
    rows: Array,
    model: tuple[Array, Array],
    until: Until,
    rng: np.random.Generator,
    *,
    rate_hz: float,
) -> tuple[RecordedSensor, np.ndarray]:
    """Return the samples of a gyroscope mounted by `rows` (3, 3) on the shaft until `until`, by a drifting clock."""
    (scale, bias), (end_s, drift, noise_rad_s) = model, until
    time_s = np.arange(BEGINS_S + 0.2, end_s - 0.2, 1 / rate_hz)
    rates = np.array([servo.rate_at(moment_s) for moment_s in time_s.tolist()])
    read = np.outer(rates, rows[:, 2]) / scale - bias + noise_rad_s * rng.normal(size=(len(time_s), 3))
    samples = np.zeros(len(time_s), SAMPLE_DTYPE)
    samples["sequence"] = np.arange(len(time_s))
    samples["board_time_us"] = np.round((time_s + 777.0) * (1 - drift) * 1e6)
    samples["host_time_s"] = time_s + 1e4
    samples["counts"] = np.round(read / SENSITIVITY)
    samples["temperature_counts"] = -48
    return replace(SENSOR, rate_hz=rate_hz), samples
