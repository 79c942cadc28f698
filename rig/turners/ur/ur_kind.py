"""The arms of Universal Robots, as a kind of turner."""

from collections.abc import Sequence
from contextlib import AbstractContextManager
from math import degrees
from pathlib import Path
from typing import TYPE_CHECKING

from rig.config.models import ArmSection
from rig.errors import Problem, refuse
from rig.motion.carried import read_load
from rig.motion.model import model_of
from rig.motion.state_rows import ARM_FIELDS
from rig.motion.steps import Plan
from rig.motion.turner_state import TurnerIdentity
from rig.turners.turner import Turner
from rig.turners.turner_kind import OnState, TurnerKind, Wording
from rig.turners.ur.plan_problems import plan_problems

if TYPE_CHECKING:
    from rig.turners.ur.arm_report import ArmReport


def _connect(section: ArmSection, on_state: OnState, log: Path) -> AbstractContextManager[Turner]:
    # Imported here: it imports multiprocessing and HTTP, which a plan does not need.
    from rig.turners.ur import arm_driver

    rate_hz = min(section.state_rate_hz, model_of(section).state_rate_hz)
    return arm_driver.Arm(section.host, on_state, rate_hz, log, robot_api_port=section.robot_api_port)


def _read_report(section: ArmSection) -> "ArmReport":
    from rig.turners.ur import arm_driver

    return arm_driver.look(section.host, section.robot_api_port)


def _stance(report: "ArmReport") -> str:
    angles = " ".join(f"{degrees(angle):z.1f}" for angle in report.state.q_rad)
    return f"arm joints: {angles} °, speed slider {100 * report.state.target_speed_fraction:.0f} %"


def _problems(plans: Sequence[Plan], section: ArmSection, report: "ArmReport | None") -> list[Problem]:
    if report is None:
        return [problem for plan in plans for problem in plan_problems(plan, read_load(section), model_of(section))]
    from rig.turners.ur import arm_preflight

    return arm_preflight.preflight_problems(plans, section, report)


def _make_nominal(section: ArmSection) -> TurnerIdentity:
    model = model_of(section)
    return TurnerIdentity(model.maker, model.name, model.nominal)


def _make_recorded(section: ArmSection, report: "ArmReport") -> TurnerIdentity:
    from rig.turners.ur import arm_preflight
    from rig.turners.ur.identity import identity_problems

    refuse(identity_problems(section, report))
    return arm_preflight.make_recorded(section, report)


UR = TurnerKind(
    name="ur",
    section=ArmSection,
    connect=_connect,
    look=_read_report,
    stance=_stance,
    problems=_problems,
    describe_configured=_make_nominal,
    describe_connected=_make_recorded,
    carried=read_load,
    words=Wording(
        name="robot arm",
        short="arm",
        turned="the wrists",
        method="A robot arm turns the items through {turns} at constant rate about its wrists' axes, both ways",
        briefly="{turns} and attitudes at rest on a robot arm",
        directions="the arm's kinematics",
        stands="stands still and its program has ended",
    ),
    fields=ARM_FIELDS,
)
