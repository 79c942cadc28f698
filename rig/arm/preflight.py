"""Pre-flight: what can be known to go wrong before the arm moves. Pure: a plan and a report in, problems out."""

import math
from collections.abc import Sequence

import numpy as np

from rig.arm.carried import Carried, carried_by
from rig.arm.clearance import clearance_problems
from rig.arm.condition import readiness
from rig.arm.identity import identity_problems
from rig.arm.kinematics import NOMINAL, DenavitHartenberg, flange_axes
from rig.arm.motion import SAME_PLACE_RAD, Motion, Plan, travel
from rig.arm.motion_limits import motion_problems
from rig.arm.state import JOINT_NAMES, ArmReport, JointLimits, Joints
from rig.config.models import ArmSection
from rig.config.ur10e_limits import PAYLOAD_LIMIT_KG
from rig.errors import Problem, Refused

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
        arm=_geometry(arm, report),
        told=None if report.setup is None else report.setup.limits,
    )


def plan_problems(
    plan: Plan,
    carried: Carried,
    *,
    arm: DenavitHartenberg = NOMINAL,
    told: JointLimits | None = None,
) -> list[Problem]:
    """What is wrong with the plan itself: steps that are none, limits of position, speed, acceleration and payload.

    And what brings the flange or what it carries too near the arm. `told` are the controller's own limits, which count
    where they are narrower; the lengths are those of `arm`.
    """
    problems = step_problems(plan)
    problems += [problem for motion in plan.motions if _travels(motion) for problem in motion_problems(motion, told)]
    problems += clearance_problems(plan, carried, arm)
    if not 0 <= carried.payload_kg <= PAYLOAD_LIMIT_KG:
        problems.append(
            Problem(
                "payload_too_heavy",
                f"the payload of {carried.payload_kg:g} kg is outside 0 to {PAYLOAD_LIMIT_KG:g} kg",
                "Weigh the fixture and correct arm.payload_kg",
            )
        )
    return list(dict.fromkeys(problems))


def step_problems(plan: Plan) -> list[Problem]:
    """Steps that cannot be made: every one must take time, and every motion must lead somewhere, at some speed."""
    problems = [
        Problem(
            "no_duration",
            f"{step.name} is planned to take {step.duration_s:g} s",
            "Leave it out of the plan, or give it a duration above 0",
        )
        for step in plan.steps
        if not 0 < step.duration_s < math.inf
    ]
    problems += [
        Problem("no_travel", f"{motion.name} leads nowhere", "Leave it out of the plan, or let it move a joint")
        for motion in plan.motions
        if not _travels(motion)
    ]
    problems += [
        Problem(
            "no_speed",
            f"{motion.name} is planned with {motion.speed_rad_s:g} rad/s and {motion.acceleration_rad_s2:g} rad/s²",
            "Give it a speed and an acceleration above 0",
        )
        for motion in plan.motions
        if not (0 < motion.speed_rad_s < math.inf and 0 < motion.acceleration_rad_s2 < math.inf)
    ]
    return problems


def arm_problems(plan: Plan, report: ArmReport) -> list[Problem]:
    """What is wrong with the arm as it stands, for this plan: modes, stops, control, the way to the start.

    The payload is not compared here: `Arm.take_control` sets it and sees that the controller reckons with it.
    """
    problems = []
    if unready := readiness(report.state):
        problems.append(unready)
    # On the loopback address of the robot's own simulator the client skips this check, and so does the pendant.
    if report.remote_control is False and report.host not in ("127.0.0.1", "localhost"):
        problems.append(
            Problem(
                "not_in_remote_control",
                f"the arm at {report.host} is in local control",
                "Switch the pendant to remote control (top right corner)",
            )
        )
    if report.program_running:
        problems.append(
            Problem("program_running", f"a program runs on the arm at {report.host}", "Stop it on the pendant")
        )
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
                f"the way home is too long to take unseen ({', '.join(too_far)})",
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
            f"the tool's frame on the pendant is turned by {math.degrees(turn_rad):.2g}° against the flange's, "
            "in which the rig measures: somebody's tool or mounting is meant",
            "Set the rotation of the TCP to zero on the pendant for this run",
        )
    ]


def kinematics_problems(arm: ArmSection, report: ArmReport) -> list[Problem]:
    """What is wrong with the controller's account of its arm, where the configuration asks for it.

    Wrists that turn about other axes than a UR10e's are none, or are not known: the directions are compared in the
    flange's frame at home.
    """
    if arm.kinematics == "nominal":
        return []
    if report.kinematics is None:
        return [
            Problem(
                "no_kinematics",
                f"the controller at {report.host} does not say how its arm is made (primary interface, port 30001)",
                "Enable the primary interface in the arm's security settings, or set arm.kinematics: nominal",
            )
        ]
    home = np.radians(arm.home_deg)
    told, nominal = (flange_axes(home, each)[:, WRISTS] for each in (report.kinematics, NOMINAL))
    angles = np.arctan2(np.linalg.norm(np.cross(told, nominal, axis=0), axis=0), np.sum(told * nominal, axis=0))
    return [
        Problem(
            "kinematics_disagree",
            f"by what the controller says the axis of {JOINT_NAMES[joint]} lies {math.degrees(angle):.1f}° from a "
            f"UR10e's, {math.degrees(MAX_DISAGREEMENT_RAD):g}° is allowed",
            "Check that the controller is set up for this arm, or set arm.kinematics: nominal",
        )
        for joint, angle in zip(WRISTS, angles, strict=True)
        if angle > MAX_DISAGREEMENT_RAD
    ]


def used_kinematics(arm: ArmSection, report: ArmReport) -> DenavitHartenberg:
    """The geometry a recording is made with, as the configuration says.

    Raises Refused `no_kinematics`, `kinematics_disagree`.
    """
    refuse(kinematics_problems(arm, report))
    return _geometry(arm, report)


def _geometry(arm: ArmSection, report: ArmReport) -> DenavitHartenberg:
    return NOMINAL if arm.kinematics == "nominal" or report.kinematics is None else report.kinematics


def way_to_home(plan: Plan, q_rad: Joints) -> Joints:
    """(6,) rad: how far each joint will turn in the first motion, from where the arm stands to the plan's home pose."""
    return travel(q_rad, plan.home_q_rad)


def refuse(problems: Sequence[Problem]) -> None:
    """Raise `Refused` when there are problems: named after the first, with all of them and their remedies."""
    if not problems:
        return
    *others, last = problems
    also = "".join(f"{problem.what} ({problem.name}): {problem.remedy}. " for problem in others)
    raise Refused(problems[0].name, also + last.what, last.remedy)


def _travels(motion: Motion) -> bool:
    way = travel(motion.start_q_rad, motion.target_q_rad)
    return all(map(math.isfinite, way)) and max(map(abs, way)) > SAME_PLACE_RAD
