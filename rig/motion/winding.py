"""How far a plan winds what hangs at the flange: each joint's way to both sides, from where it stands. Pure."""

from collections.abc import Sequence
from math import degrees, pi

from rig.motion.state import Joints
from rig.motion.steps import Plan

SLACK_RAD = pi / 2  # a cable that can be turned by less needs no word
AWAY_RAD = pi  # from home: farther, a joint stands at another turn than the one that its cable was laid at


def windings_rad(plan: Plan, q_rad: Joints) -> list[tuple[float, float]]:
    """(k, 2) how far each joint will turn below and above where it stands, ≤ 0 and ≥ 0, in all motions of a plan."""
    poses = [q_rad, plan.home_q_rad, *(q for each in plan.motions for q in (each.start_q_rad, each.target_q_rad))]
    ways = ([angle - now for angle in angles] for now, angles in zip(q_rad, zip(*poses, strict=True), strict=True))
    return [(min(way), max(way)) for way in ways]


def cable_words(plan: Plan, q_rad: Joints, names: Sequence[str]) -> list[str]:
    """What the cable at the flange must allow from how it hangs now, in sentences; `names` are those of the joints."""
    turning = [
        f"{name} by {-degrees(low):.0f}° one way (-) and {degrees(high):.0f}° the other (+)"
        for name, (low, high) in zip(names, windings_rad(plan, q_rad), strict=True)
        if max(-low, high) > SLACK_RAD
    ]
    away = [
        f"{name} stands {degrees(now - home):+.0f}° from home: its cable may be wound by as much already, and is "
        "unwound on the way."
        for name, now, home in zip(names, q_rad, plan.home_q_rad, strict=True)
        if abs(now - home) > AWAY_RAD
    ]
    if not turning:
        return away
    return [f"The sensor's cable needs slack, from how it hangs now, to turn {', '.join(turning)}.", *away]
