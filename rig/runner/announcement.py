"""The questions to the operator before a movement. Pure."""

from collections.abc import Iterable
from math import degrees

from rig.motion.plan_warnings import doubts
from rig.motion.preflight import find_travel_to_home
from rig.motion.steps import Plan, turn_words
from rig.motion.turner_state import Report
from rig.motion.winding import cable_words
from rig.station.events import Prompt
from rig.station.plain_text import duration_words
from rig.turners.turner_kind import Wording

KEEP_CLEAR = "Nobody and nothing may be within its reach."


def mounting(plan: Plan, number: int, words: Wording) -> Prompt:
    """Return the question whether the item is mounted for stage `number` (from 0); `words` names the turner."""
    stages, stage = plan.stages, plan.stages[number]
    far = _farthest(plan)
    lines = (
        f"Stage {number + 1} of {len(stages)}: {stage.instruction}.",
        f"The {words.short} {words.stands}: it does not move until you answer.",
        "Then small turns try the mounting, before "
        f"{len(stage.indices)} sweeps turn {words.turned} by more than {far} each.",
        *filter(None, [words.beware]),
        KEEP_CLEAR,
        *cable_words(plan, plan.home_q_rad, _joint_names(plan)),
    )
    ticked = f"The item is mounted so, and nobody and nothing is within the {words.short}'s reach"
    return Prompt(lines, to_tick=ticked, for_a_person=True, mounts=number)


def announcement(
    plan: Plan, report: Report, words: Wording, repeated: Plan | None, mounted: Iterable[str], *, early: bool = False
) -> Prompt:
    """Return the question before the first motion, which depends on the turner's pose.

    - words: the names of the turner.
    - repeated: the movement that follows without another question if the calibration passes.
    - mounted: lines that name the sensors on the turner.
    - early: whether the movement may end before its last repeat.
    """
    at_most = " at most, until the target uncertainty is reached" if early else ""
    home_rad = find_travel_to_home(plan, report.state.q_rad)
    turns = ", ".join(
        f"{name} {degrees(angle):+.0f}°"
        for name, angle in zip(report.joints, home_rad, strict=True)
        if abs(angle) > 0.01
    )
    lines = [
        *mounted,
        f"The {words.short} at {report.host} will move for {duration_words(plan.duration_s)}{at_most}.",
        f"First it goes home: {turns or 'it is already there'}.",
    ]
    if plan.sweeps:
        lines.append(f"Then {len(plan.sweeps)} sweeps turn {words.turned} by more than {_farthest(plan)} each.")
    if plan.dwells:
        lines.append(f"Then it stands still in {len(plan.dwells)} attitudes; settling may add {plan.settling_s:.0f} s.")
    if plan.waits:
        lines.append(
            f"That is {len(plan.waits)} sets at most: before each it stands still until the temperature is right. That "
            "may take much longer, and then it moves without another question."
        )
    if repeated is not None:
        lines.append(
            "If the calibration passes, the board stores it in place of the old one; then, without another question, "
            f"{len(repeated.sweeps)} sweeps verify it, for {repeated.duration_s:.0f} s."
        )
    lines += [*doubts(plan), *filter(None, [words.beware])]
    lines += [KEEP_CLEAR, *cable_words(plan, report.state.q_rad, report.joints)]
    return Prompt(tuple(lines), to_tick=f"I have looked: nobody and nothing is within the {words.short}'s reach")


def _joint_names(plan: Plan) -> list[str]:
    """Return a name for each joint: its name in the sweeps, or else its number."""
    names = {sweep.joint: sweep.joint_name for sweep in plan.sweeps}
    return [names.get(joint, f"joint {joint + 1}") for joint in range(len(plan.home_q_rad))]


def _farthest(plan: Plan) -> str:
    """Return the largest angle of the plan's sweeps in words."""
    return turn_words(max(sweep.angle_rad for sweep in plan.sweeps))
