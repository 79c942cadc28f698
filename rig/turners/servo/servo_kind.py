"""Dynamixel X servos, as a kind of turner."""

from collections.abc import Sequence
from contextlib import AbstractContextManager
from math import degrees, pi, radians
from pathlib import Path

from rig.config.procedures.servo_section import ServoSection
from rig.errors import Problem
from rig.motion.carried import FlangeLoad
from rig.motion.chain import DenavitHartenberg
from rig.motion.preflight import find_step_problems
from rig.motion.steps import Plan
from rig.motion.turner_state import TurnerIdentity
from rig.turners.servo.goal_profiles import move_problems
from rig.turners.servo.servo_models import MAKER, find_model
from rig.turners.servo.servo_preflight import servo_problems
from rig.turners.servo.servo_state import SERVO_FIELDS, ServoReport
from rig.turners.turner import Turner
from rig.turners.turner_kind import OnState, TurnerKind, Wording

# The shaft is the z axis of its own frame and of the housing's; both have their origin at the mounting face.
SHAFT = DenavitHartenberg(theta_rad=(0.0,), a_m=(0.0,), d_m=(0.0,), alpha_rad=(0.0,))
READING_STD_RAD = radians(0.065)  # 0.088° steps, 0.06° noise (AS5045, data sheet: "transition noise")
MAX_TRAVEL_RAD = 2 * pi


def _connect(section: ServoSection, on_state: OnState, log: Path) -> AbstractContextManager[Turner]:
    from rig.turners.servo.servo_driver import Servo

    return Servo(
        section.port,
        section.model,
        on_state,
        servo_id=section.id,
        baud=section.baud,
        rate_hz=section.state_rate_hz,
        watchdog_s=section.watchdog_s,
    )


def _read_report(section: ServoSection) -> ServoReport:
    from rig.turners.servo.first_contact import look_at
    from rig.turners.servo.packet_handler import Bus

    bus = Bus(section.port, section.baud, section.id)
    try:
        return look_at(bus, section.port, section.id)
    finally:
        bus.close()


def _stance(report: ServoReport) -> str:
    state = report.state
    torque = "on" if report.torque_on else "off"
    warm = f"{state.voltage_v:.1f} V, {state.temperature_c:.0f} °C"
    return f"shaft: {degrees(state.q_rad[0]):.1f} °, torque {torque}, {warm}"


def _problems(plans: Sequence[Plan], section: ServoSection, report: ServoReport | None) -> list[Problem]:
    """Return all problems of the plans, and with a `report` also the problems of the servo."""
    problems = list(dict.fromkeys(problem for plan in plans for problem in find_step_problems(plan)))
    motions = [motion for plan in plans for motion in plan.motions]  # one problem of each kind is reported
    if report is None:
        return [*problems, *move_problems(motions, find_model(section.model).no_load_rad_s)]
    return [
        *problems,
        *servo_problems(report, section.model, _read_payload(section), 1 / section.state_rate_hz),
        *move_problems(motions, min(report.velocity_limit_rad_s, report.servo.no_load_rad_s)),
        *_wind_up_problems(plans, report),
    ]


def _wind_up_problems(plans: Sequence[Plan], report: ServoReport) -> list[Problem]:
    """Return a problem if the shaft is more than a revolution from home, because the cable may be wound up."""
    (angle_rad,) = report.state.q_rad
    distance_rad = max((abs(angle_rad - plan.home_q_rad[0]) for plan in plans), default=0.0)
    if distance_rad <= MAX_TRAVEL_RAD:
        return []
    return [
        Problem(
            "servo_wound_up",
            f"the servo counts {degrees(angle_rad):.0f}°, which is {distance_rad / MAX_TRAVEL_RAD:.1f} turns from home",
            "Unwind the cable by hand, with the supply off, and switch it on: the servo forgets its turns then",
        )
    ]


def _make_nominal(section: ServoSection) -> TurnerIdentity:
    return TurnerIdentity(MAKER, find_model(section.model).title, SHAFT, reading_std_rad=READING_STD_RAD)


def _make_recorded(section: ServoSection, report: ServoReport) -> TurnerIdentity:
    return TurnerIdentity(MAKER, report.model, SHAFT, reading_std_rad=READING_STD_RAD)


def _read_payload(section: ServoSection) -> FlangeLoad:
    x, y, z = (coordinate_mm / 1000 for coordinate_mm in section.payload_centre_mm)
    return FlangeLoad(section.payload_kg, (x, y, z))


SERVO = TurnerKind(
    name="servo",
    section=ServoSection,
    connect=_connect,
    look=_read_report,
    stance=_stance,
    problems=_problems,
    describe_configured=_make_nominal,
    describe_connected=_make_recorded,
    carried=_read_payload,
    words=Wording(
        name="servo",
        short="servo",
        turned="the shaft",
        method="A servo turns the items through {turns} at constant rate about its shaft, both ways, remounted for "
        "each axis",
        briefly="{turns} and rests on the shaft of a servo",
        directions="how the item is mounted on the shaft",
        beware="The servo has no brake and no emergency stop: only the switch of its supply is sure. "
        "Have it within reach.",
        stands="stands still and holds its shaft as long as it has its supply",
        clock="this computer's oscillator, by a clock that is never set",
        axes_source="as the stages of the procedure say",
        axes_traceability="not traceable; the six-observation solution uses speeds alone and does not need them",
    ),
    fields=SERVO_FIELDS,
)
