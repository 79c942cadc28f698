"""Pre-flight of this arm: what can be known to go wrong before it moves. Pure: plans and a report in, problems out."""

import math
from collections.abc import Sequence

import numpy as np

from rig.config.models import ArmSection
from rig.errors import Problem, refuse
from rig.motion.carried import carried_by
from rig.motion.geometry import DenavitHartenberg, flange_axes
from rig.motion.model import home_of, model_of
from rig.motion.preflight import way_to_home
from rig.motion.state import JOINT_NAMES, Made
from rig.motion.steps import Plan
from rig.turners.ur.condition import MAKERS_SIMULATOR, local_control, readiness
from rig.turners.ur.controller.registers import registers_in_use
from rig.turners.ur.identity import identity_problems, model_found
from rig.turners.ur.plan_problems import plan_problems
from rig.turners.ur.report import MAKER, ArmReport

# How far the first motion may swing the large joints through the room, and the wrists.
FIRST_MOTION_LIMIT_RAD = tuple(math.radians(angle) for angle in (120, 120, 120, 360, 360, 360))
WRISTS = (3, 4, 5)
MAX_DISAGREEMENT_RAD = math.radians(1)  # what factories find differs from the nominal arm by a few milliradians
MAX_TOOL_TURN_RAD = 1e-3  # what a pendant rounds is less, what somebody means is more


def preflight_problems(plans: Sequence[Plan], arm: ArmSection, report: ArmReport) -> list[Problem]:
    """All that is known to speak against moving: the arm is another, a plan breaks a limit, the arm is not ready.

    The last of the `plans` is the one that is driven. Of another arm nothing else is said: all else is of this one.
    """
    if others := identity_problems(arm, report):
        return others
    problems = [problem for plan in plans for problem in _plan_problems_on(plan, arm, report)]
    return list(dict.fromkeys([*problems, *arm_problems(plans[-1], report), *kinematics_problems(arm, report)]))


def _plan_problems_on(plan: Plan, arm: ArmSection, report: ArmReport) -> list[Problem]:
    return plan_problems(
        plan,
        carried_by(arm),
        model_of(arm),
        arm=_geometry(arm, report),
        told=None if report.setup is None else report.setup.limits,
    )


def arm_problems(plan: Plan, report: ArmReport) -> list[Problem]:
    """What is wrong with the arm as it stands, for this plan: modes, stops, control, the way to the start.

    The payload is not compared here: `Arm.take_control` sets it and sees that the controller reckons with it.
    """
    problems = []
    if unready := readiness(report.state):
        problems.append(unready)
    # On the loopback address of the robot's own simulator the client skips this check, and so does the pendant.
    if report.remote_control is False and report.host not in MAKERS_SIMULATOR:
        problems.append(local_control(report.host))
    if report.program_running:
        problems.append(
            Problem("program_running", f"a program runs on the arm at {report.host}", "Stop it on the pendant")
        )
    if report.registers_free is False:
        problems.append(registers_in_use(report.host, report.version))
    if not report.state.at_rest:
        problems.append(Problem("arm_moves", "the arm is moving", "Wait until it stands still"))
    too_far = [
        f"{name} {math.degrees(angle):+.0f}°"
        for name, angle, limit in zip(
            JOINT_NAMES, way_to_home(plan, report.state.q_rad), FIRST_MOTION_LIMIT_RAD, strict=True
        )
        if abs(angle) > limit
    ]
    if too_far:
        problems.append(
            Problem(
                "far_from_home",
                f"the way to the home pose is too long to drive without a look ({', '.join(too_far)})",
                "Bring the arm near its home pose from the pendant, or correct arm.home_deg",
            )
        )
    return [*problems, *_tool_problems(plan, report)]


def _tool_problems(plan: Plan, report: ArmReport) -> list[Problem]:
    """A turned tool frame, where attitudes are visited; a controller that does not tell of it is not held up."""
    if not plan.dwells or report.tcp_offset is None:
        return []
    turn_rad = abs(math.remainder(math.hypot(*report.tcp_offset[3:]), math.tau))
    if turn_rad <= MAX_TOOL_TURN_RAD:
        return []
    return [
        Problem(
            "tcp_rotated",
            f"the tool's frame on the pendant is turned by {math.degrees(turn_rad):.2g}° relative to the "
            "flange's frame, in which the rig measures: it seems to describe a tool or a mounting",
            "Set the rotation of the TCP to zero on the pendant for this run",
        )
    ]


def kinematics_problems(arm: ArmSection, report: ArmReport) -> list[Problem]:
    """What is wrong with the controller's account of its arm, where the configuration asks for it.

    Wrists that turn about other axes than the drawing's are none, or are not known: the directions are compared in the
    flange's frame at home.
    """
    if arm.kinematics == "nominal":
        return []
    if report.kinematics is None:
        return [
            Problem(
                "no_kinematics",
                f"the controller at {report.host} does not state the geometry of its arm (primary interface, "
                "port 30001)",
                "Enable the primary interface in the arm's security settings, or set arm.kinematics: nominal",
            )
        ]
    home, model = home_of(arm), model_of(arm)
    told, nominal = (flange_axes(home, each)[:, WRISTS] for each in (report.kinematics, model.drawing))
    angles = np.arctan2(np.linalg.norm(np.cross(told, nominal, axis=0), axis=0), np.sum(told * nominal, axis=0))
    return [
        Problem(
            "kinematics_disagree",
            f"according to the controller the axis of {JOINT_NAMES[joint]} lies {math.degrees(angle):.1f}° from that "
            f"of a {model.name}; {math.degrees(MAX_DISAGREEMENT_RAD):g}° is allowed",
            "Check that the controller is set up for this arm, or set arm.kinematics: nominal",
        )
        for joint, angle in zip(WRISTS, angles, strict=True)
        if angle > MAX_DISAGREEMENT_RAD
    ]


def made(arm: ArmSection, report: ArmReport) -> Made:
    """The arm as a recording has it, its geometry as the configuration says.

    Raises Refused `no_kinematics`, `kinematics_disagree`.
    """
    refuse(kinematics_problems(arm, report))
    return Made(MAKER, model_found(report), _geometry(arm, report), report.tcp_offset)


def _geometry(arm: ArmSection, report: ArmReport) -> DenavitHartenberg:
    """What is reckoned with: the factory's measure of this arm, or the drawing of its model."""
    return model_of(arm).drawing if arm.kinematics == "nominal" or report.kinematics is None else report.kinematics
