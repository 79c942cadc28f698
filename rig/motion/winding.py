"""How far a plan winds the flange's cable: each joint's travel below and above the joint's present angle."""

from collections.abc import Sequence
from math import ceil, degrees, pi

from rig.motion.steps import Plan
from rig.motion.turner_state import Joints

MAX_SLACK_RAD = pi / 2  # a smaller rotation needs no warning
MAX_HOME_ANGLE_RAD = pi  # from home, beyond which a joint is in another revolution than when its cable was laid


def windings_rad(plan: Plan, q_rad: Joints) -> list[tuple[float, float]]:
    """Return each joint's travel (k, 2), rad, below (≤ 0) and above (≥ 0) its present angle in a plan's motions."""
    poses = [q_rad, plan.home_q_rad, *(q for step in plan.motions for q in (step.start_q_rad, step.target_q_rad))]
    travels = ([angle - now for angle in angles] for now, angles in zip(q_rad, zip(*poses, strict=True), strict=True))
    return [(min(angles), max(angles)) for angles in travels]


def _round_up_deg(angle_rad: float) -> int:
    """Return an angle rounded up to whole degrees, but without rounding errors: 190 for 190.0000001°."""
    return ceil(degrees(angle_rad) - 1e-6)


def cable_words(plan: Plan, q_rad: Joints, names: Sequence[str]) -> list[str]:
    """Return sentences on the slack that the flange's cable needs from its present position; `names`: the joints'."""
    travels = [
        f"{name} by {_round_up_deg(-low)}° one way (-) and {_round_up_deg(high)}° the other (+)"
        for name, (low, high) in zip(names, windings_rad(plan, q_rad), strict=True)
        if max(-low, high) > MAX_SLACK_RAD
    ]
    wound = [
        f"{name} is {degrees(now - home):+.0f}° from home: its cable may be wound by as much already, and is "
        "unwound on the way."
        for name, now, home in zip(names, q_rad, plan.home_q_rad, strict=True)
        if abs(now - home) > MAX_HOME_ANGLE_RAD
    ]
    if not travels:
        return wound
    return [f"The sensor's cable needs enough slack, from its present position, to turn {', '.join(travels)}.", *wound]
