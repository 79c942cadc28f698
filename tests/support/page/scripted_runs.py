"""Events of invented runs for the page: the plan of demo.yaml, an arm that follows it, and readings."""

import math
from collections.abc import Iterator
from pathlib import Path

from firmware_host.answers import BoardObservation
from rig.analysis.check import Check, fitness
from rig.commands.configured import load_configured
from rig.data.meaning import Meaning
from rig.data.recording.recorded_events import BoardNotObserved, BoardObserved
from rig.motion.steps import Plan, Sweep, Transfer, travel
from rig.motion.turner_state import ArmState, Joints, RobotMode, RuntimeState, SafetyMode
from rig.page.about import About
from rig.page.rows import Look
from rig.station.events import (
    ArmConnected,
    ArmSeen,
    Checked,
    DocumentWritten,
    PhaseStarted,
    PreflightPassed,
    Progress,
    RunEvent,
    SamplesTaken,
    SamplingStarted,
    SensorSamples,
    StepFinished,
    StepStarted,
    VerdictReached,
)
from rig.turners.servo.servo_models import MODELS
from rig.turners.servo.servo_state import ServoReport, ServoState
from rig.turners.ur.arm_report import ArmReport
from support.paths import DEMO

STEP_S = 0.1
SATURATED = (
    "saturation: in sweep 3 (wrist_1 ccw) 12 samples are at the end of the sensor's range. "
    "Choose a wider range or a slower sweep."
)
SHAKEN = "arm_moved_in_dwell: in dwell 7 (dwell at 0 -90 0) a joint moved by 0.31°. Let nothing move the arm."
UPRIGHT = {
    "sensor": "reference, accelerometer",
    "by": "host",
    "towards": "+z up",
    "size": 9.8142,
    "std": 0.0004,
    "expected": 9.80665,
    "unit": "m/s²",
    "samples": 1000,
    "refused": None,
}
SENSORS = {"gyro": "raw", "reference": "raw"}
ABOUT = About(
    "runs/2026-11-22T16-00-00Z-six_observation",
    "six_observation",
    may_answer=True,
    parts={"gyro": "lsm9ds1 LSM9DS1-001", "reference": "adis16465 ADIS16465-001"},
    simulated=True,
)


def plan_demo() -> Plan:
    """Return the movement of demo.yaml."""
    return load_configured(DEMO).phase.plan()


def state(time_s: float, q_rad: Joints, qd_rad_s: Joints) -> ArmState:
    """Return the state of a healthy arm."""
    playing = RobotMode.RUNNING, SafetyMode.NORMAL, RuntimeState.PLAYING
    return ArmState(time_s, time_s, q_rad, qd_rad_s, 1.0, 1.0, *playing, 3, 1)


def report(q_rad: Joints) -> ArmReport:
    """Return the report of an arm in this posture, whose model only its dashboard reports."""
    return ArmReport(
        host="127.0.0.2",
        version=(5, 14, 0, 0),
        polyscope="5.14",
        serial_number="20225500001",
        remote_control=True,
        program_running=False,
        state=state(0.0, q_rad, (0.0,) * 6),
        called="UR10",
        model="UR10e or UR12e",
    )


def servo_state(time_s: float, angle_rad: float) -> ServoState:
    """Return the state of a healthy servo at rest."""
    return ServoState(time_s, time_s, (angle_rad,), (0.0,), 0.001, 0, 0, 0, 0, 0.0, 12.0, 30.0)


def servo_report(state: ServoState) -> ServoReport:
    """Return the report of a servo with factory settings, in extended position mode."""
    return ServoReport(
        port="/dev/servo",
        servo_id=1,
        servo=MODELS[0],
        firmware=45,
        drive_mode=0,
        operating_mode=4,
        secondary_id=255,
        homing_offset=0,
        temperature_limit_c=72,
        voltage_limits_v=(6.5, 12.0),
        velocity_limit_rad_s=6.3,
        startup=0,
        shutdown=52,
        torque_on=False,
        round_trip_s=0.001,
        state=state,
    )


def before_it_moves(plan: Plan) -> Iterator[RunEvent]:
    """Yield the events up to the question."""
    stands = report(plan.start_q_rad)
    yield ArmConnected(stands)
    yield PhaseStarted("six_observation", plan, SENSORS)
    yield PreflightPassed(plan, stands)


def moving(plan: Plan, until_s: float, step_s: float = STEP_S) -> Iterator[RunEvent]:
    """Yield the events from the first motion to `until_s`."""
    yield SamplingStarted()
    time_s, done_s, q = 0.0, 0.0, plan.start_q_rad
    for number, step in enumerate(plan.steps, 1):
        yield StepStarted(number, len(plan.steps), step)
        travel_rad = travel(step.start_q_rad, step.target_q_rad) if isinstance(step, Sweep | Transfer) else (0.0,) * 6
        from_q = getattr(step, "start_q_rad", q)
        began_s = time_s
        while time_s < began_s + step.duration_s:
            if time_s > until_s:
                return
            fraction = (time_s - began_s) / step.duration_s
            speeds = tuple(angle / step.duration_s for angle in travel_rad)
            q = tuple(start + fraction * angle for start, angle in zip(from_q, travel_rad, strict=True))
            yield SamplesTaken(
                tuple(
                    _samples(name, time_s, step if isinstance(step, Sweep) else None, 0 if name == "gyro" else 3)
                    for name in SENSORS
                )
            )
            yield ArmSeen(state(time_s, q, speeds), 0)
            left_s = plan.duration_s - done_s - (time_s - began_s)
            yield Progress(
                number, len(plan.steps), step, fraction, done_s + time_s - began_s, left_s, max(map(abs, speeds))
            )
            time_s += step_s
        q = getattr(step, "target_q_rad", q)
        done_s += step.duration_s
        if isinstance(step, Sweep):
            yield _make_observation(step)
        yield StepFinished(number, len(plan.steps), step, step.duration_s)


def _samples(name: str, time_s: float, sweep: Sweep | None, lost: int) -> SensorSamples:
    ripple = [0.004 * math.sin(7 * time_s + phase) + 0.002 * math.sin(31 * time_s) for phase in (0.0, 1.0, 2.0)]
    axis = (0.0, 0.0, 0.0) if sweep is None else sweep.axis_flange
    speed = 0.0 if sweep is None else sweep.speed_rad_s
    x, y, z = (
        speed * component + bias + wave
        for component, bias, wave in zip(axis, (0.01, -0.02, 0.005), ripple, strict=True)
    )
    ax, ay, az = (9.8 * math.sin(0.2 * time_s) + 30 * ripple[0], 9.8 * math.cos(0.2 * time_s), 0.4 + 20 * ripple[1])
    acceleration = {"acceleration": (ax, ay, az)} if name == "reference" else {}
    latest = {"rate": (x, y, z), "temperature": (23.4,), **acceleration}
    return SensorSamples(name, round(238 * time_s) + 1, lost, latest)


def _make_observation(sweep: Sweep) -> RunEvent:
    if sweep.index == 3:
        return BoardNotObserved("gyro", sweep.index, SATURATED)
    x, y, z = (sweep.speed_rad_s * component / 1.15 for component in sweep.axis_flange)
    return BoardObserved("gyro", sweep.index, sweep.speed_rad_s, BoardObservation(sweep.index, 0, 1, 1428, (x, y, z)))


def look(plan: Plan, sweeps: int) -> Look:
    """Return the page's estimates after this many sweeps."""
    rows = []
    for sweep in plan.sweeps[:sweeps]:
        axis = max(range(3), key=lambda i: abs(sweep.axis_flange[i]))
        sign = 1 if sweep.axis_flange[axis] > 0 else -1
        for name, scale in (("gyro", 1.15), ("reference", 1.0002)):
            row = {
                "sensor": name,
                "sweep": sweep.index,
                "by": "host",
                "joint": sweep.joint_name,
                "direction": sweep.direction,
            }
            mean = [sweep.speed_rad_s * component / scale + 0.004 for component in sweep.axis_flange]
            row |= {
                "axis": "xyz"[axis],
                "sign": sign,
                "speed_rad_s": sweep.speed_rad_s,
                "mean_rad_s": mean,
                "std_rad_s": 9e-5,
            }
            refused = None
            if sweep.index == 3 and name == "gyro":
                refused = SATURATED
            rows.append({**row, "samples": 1428, "lost": 0, "refused": refused})
    if sweeps >= 4:
        rows += [
            {**UPRIGHT, "sweep": len(plan.sweeps), "dwell": "dwell at -90 -90 0"},
            {**UPRIGHT, "sweep": len(plan.sweeps) + 1, "dwell": "", "refused": SHAKEN},
        ]
    is_complete = sweeps >= 5
    parameters = [
        {
            "sensor": name,
            "labels": [*"xyz"],
            "unit": "rad/s",
            "scale": [1.17776, 1.15521, 1.14266] if is_complete else None,
            "scale_u": [0.00175, 0.00169, 0.00161] if is_complete else None,
            "bias": [0.00766, -0.00977, -0.00452],
            "bias_u": [0.00064, 0.00065, 0.00064],
            "of": "noise only",
            "missing": None if is_complete else "the observations have rank 3 of 4",
        }
        for name in SENSORS
    ]
    return Look(rows, parameters)


def judge(folder: Path, *, passed: bool) -> Iterator[RunEvent]:
    """Yield checks and verdict."""
    yield DocumentWritten(folder / "certificate.html")
    limit = 0.002 if passed else 0.0002
    for check in (
        Check("gyro.scale_deviation", 0.17776, 0.3, "1", Meaning("conformity", "gyro", "rate", "scale"), 0.00175),
        fitness("gyro", "rate", "scale_std", 0.00088, limit),
        Check("gyro.bias", 0.00977, 0.1, "rad/s", Meaning("conformity", "gyro", "rate", "bias"), 0.00065),
        fitness("gyro", "rate", "bias_std", 0.00033, 0.002, unit="rad/s"),
        fitness("gyro", "rate", "condition", 1.62, 10.0),
    ):
        yield Checked(check)
    yield VerdictReached(passed)
