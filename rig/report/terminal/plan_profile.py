"""The sweeps of a plan as a profile for each axis of the item: what a rate table's own editor is to be given."""

import math
from collections.abc import Iterator
from dataclasses import dataclass

from rig.config.section import Vector3
from rig.motion.steps import Plan, Rest, Sweep

HEADINGS = ("axis", "at_s", "angle_deg", "rate_deg_s", "what")
SAME = 1e-6  # of directions, which are rounded


@dataclass(frozen=True, slots=True)
class Point:
    """Where a profile changes: about which axis of the item, after which time, at which angle and rate, and why."""

    axis: str
    at_s: float
    angle_deg: float
    rate_deg_s: float
    what: str


def profile(plan: Plan) -> list[Point]:
    """The corners of each axis' rate over time, axis after axis; each begins at 0 s and 0°, and rests after a sweep.

    Ways between sweeps are left out: a table has others. Angles grow by the right-hand rule about the axis named.
    """
    by_axis: dict[str, list[tuple[Sweep, float]]] = {}
    for place, step in enumerate(plan.steps):
        if isinstance(step, Sweep):
            after = plan.steps[place + 1] if place + 1 < len(plan.steps) else None
            by_axis.setdefault(_axis(step.axis_flange), []).append(
                (step, after.duration_s if isinstance(after, Rest) else 0.0)
            )
    return [point for axis, sweeps in by_axis.items() for point in _of_axis(axis, sweeps)]


def _of_axis(axis: str, sweeps: list[tuple[Sweep, float]]) -> Iterator[Point]:
    at_s, angle_deg = 0.0, 0.0
    for sweep, rest_s in sweeps:
        sign = 1 if _leading(sweep.axis_flange) > 0 else -1
        rate_deg_s = sign * math.degrees(sweep.speed_rad_s)
        ramp_s = sweep.speed_rad_s / sweep.acceleration_rad_s2
        even_s = sweep.duration_s - 2 * ramp_s
        for for_s, turned_deg, rate, what in (
            (0.0, 0.0, 0.0, "at rest"),
            (ramp_s, rate_deg_s * ramp_s / 2, rate_deg_s, "constant rate begins"),
            (even_s, rate_deg_s * even_s, rate_deg_s, "constant rate ends"),
            (ramp_s, rate_deg_s * ramp_s / 2, 0.0, "at rest"),
        ):
            at_s, angle_deg = at_s + for_s, angle_deg + turned_deg
            yield Point(axis, at_s, angle_deg, rate, what)
        at_s += rest_s


def _axis(along: Vector3) -> str:
    """The name of an axis whichever way it turns: `x`, `y`, `z`, or the direction in the frame of what is turned."""
    leading = _leading(along)
    upright = [component / math.copysign(1.0, leading) for component in along]
    if abs(leading) > 1 - SAME:
        return "xyz"[max(range(3), key=lambda each: abs(along[each]))]
    return " ".join(f"{component:.4f}" for component in upright)


def _leading(along: Vector3) -> float:
    """The component that decides which way is positive: the largest, the first of those alike."""
    return max(along, key=lambda each: (round(abs(each), 6), 0))


def profile_csv(plan: Plan) -> Iterator[str]:
    """The lines of the profile as CSV, the headings first."""
    yield ",".join(HEADINGS)
    for point in profile(plan):
        yield f"{point.axis},{point.at_s:.4f},{round(point.angle_deg, 4) + 0.0:.4f},{point.rate_deg_s:.6g},{point.what}"
