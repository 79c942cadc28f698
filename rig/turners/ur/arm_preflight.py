"""Pre-flight of the arm: predictable problems, from plans and a report. Pure."""

import math
from collections.abc import Sequence

import numpy as np

from rig.config.models import ArmSection
from rig.errors import Problem, refuse
from rig.motion.carried import read_load
from rig.motion.chain import DenavitHartenberg
from rig.motion.geometry import flange_axes
from rig.motion.model import find_home, model_of
from rig.motion.preflight import find_travel_to_home
from rig.motion.steps import Plan
from rig.motion.turner_state import JOINT_NAMES, TurnerIdentity
from rig.turners.ur.arm_report import MAKER, ArmReport
from rig.turners.ur.condition import SIMULATOR_HOSTS, local_control, readiness
from rig.turners.ur.controller.free_registers import registers_in_use
from rig.turners.ur.identity import identify_model, identity_problems
from rig.turners.ur.plan_problems import plan_problems

# The longest first motion of the large joints, which sweep through the room, and of the wrists.
FIRST_MOTION_LIMIT_RAD = tuple(math.radians(angle) for angle in (120, 120, 120, 360, 360, 360))
WRISTS = (3, 4, 5)
MAX_DISAGREEMENT_RAD = math.radians(1)  # a factory's measurement differs from the nominal arm by a few milliradians
MAX_TOOL_ROTATION_RAD = 1e-3  # above a pendant's rounding, below any intended rotation


def preflight_problems(plans: Sequence[Plan], arm: ArmSection, report: ArmReport) -> list[Problem]:
    """Return all reasons against moving: another arm, a plan beyond a limit, an arm that is not ready.

    The last of `plans` is to be driven. If another arm answers, no other reason is reported, because these concern the
    configured arm.
    """
    if others := identity_problems(arm, report):
        return others
    problems = [problem for plan in plans for problem in _plan_problems_on(plan, arm, report)]
    return list(dict.fromkeys([*problems, *arm_problems(plans[-1], report), *kinematics_problems(arm, report)]))


def _plan_problems_on(plan: Plan, arm: ArmSection, report: ArmReport) -> list[Problem]:
    return plan_problems(
        plan,
        read_load(arm),
        model_of(arm),
        arm=_geometry(arm, report),
        controller=None if report.setup is None else report.setup.limits,
    )


def arm_problems(plan: Plan, report: ArmReport) -> list[Problem]:
    """Return the problems of the arm's state for this plan: modes, stops, control, the motion to the start.

    The payload is not checked here, because `Arm.take_control` sets and confirms it.
    """
    problems = []
    if unready := readiness(report.state):
        problems.append(unready)
    # The client skips this check at the loopback address of the robot's own simulator, and so does the pendant.
    if report.remote_control is False and report.host not in SIMULATOR_HOSTS:
        problems.append(local_control(report.host))
    if report.program_running:
        problems.append(
            Problem("program_running", f"a program runs on the arm at {report.host}", "Stop it on the pendant")
        )
    if report.registers_free is False:
        problems.append(registers_in_use(report.host, report.version))
    if not report.state.at_rest:
        problems.append(Problem("arm_moves", "the arm is moving", "Wait until it is at rest"))
    too_far = [
        f"{name} {math.degrees(angle):+.0f}°"
        for name, angle, limit in zip(
            JOINT_NAMES, find_travel_to_home(plan, report.state.q_rad), FIRST_MOTION_LIMIT_RAD, strict=True
        )
        if abs(angle) > limit
    ]
    if too_far:
        problems.append(
            Problem(
                "far_from_home",
                f"the way to the home pose is too long to drive without looking ({', '.join(too_far)})",
                "Bring the arm near its home pose from the pendant, or correct arm.home_deg",
            )
        )
    return [*problems, *_tool_problems(plan, report)]


def _tool_problems(plan: Plan, report: ArmReport) -> list[Problem]:
    """Return the problem of a rotated tool frame, if the plan has attitudes and the controller reports the frame."""
    if not plan.dwells or report.tcp_offset is None:
        return []
    rotation_rad = abs(math.remainder(math.hypot(*report.tcp_offset[3:]), math.tau))
    if rotation_rad <= MAX_TOOL_ROTATION_RAD:
        return []
    return [
        Problem(
            "tcp_rotated",
            f"the tool's frame on the pendant is turned by {math.degrees(rotation_rad):.2g}° relative to the "
            "flange's frame, in which the rig measures: it seems to describe a tool or a mounting",
            "Set the rotation of the TCP to zero on the pendant for this run",
        )
    ]


def kinematics_problems(arm: ArmSection, report: ArmReport) -> list[Problem]:
    """Return the problems of the controller's description of its arm, if the configuration uses it.

    These are a missing description, and wrists whose axes in the flange's frame at home differ from the nominal ones.
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
    home, model = find_home(arm), model_of(arm)
    actual, nominal = (flange_axes(home, chain)[:, WRISTS] for chain in (report.kinematics, model.nominal))
    angles = np.arctan2(np.linalg.norm(np.cross(actual, nominal, axis=0), axis=0), np.sum(actual * nominal, axis=0))
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


def make_recorded(arm: ArmSection, report: ArmReport) -> TurnerIdentity:
    """Return the arm as it is recorded, with its geometry. Raise Refused `no_kinematics`, `kinematics_disagree`."""
    refuse(kinematics_problems(arm, report))
    return TurnerIdentity(MAKER, identify_model(report), _geometry(arm, report), report.tcp_offset)


def _geometry(arm: ArmSection, report: ArmReport) -> DenavitHartenberg:
    """Return the geometry for all computations: the factory's measurement of this arm, or its model's nominal one."""
    return model_of(arm).nominal if arm.kinematics == "nominal" or report.kinematics is None else report.kinematics
