"""The sweeps of a plan as a profile for each axis of the item, for the editor of a rate table."""

import math
from collections.abc import Iterator
from dataclasses import dataclass

from rig.config.section import Vector3
from rig.motion.steps import Plan, Rest, Sweep

HEADINGS = ("axis", "at_s", "angle_deg", "rate_deg_s", "what")
DIRECTION_TOLERANCE = 1e-6  # directions are rounded


@dataclass(frozen=True, slots=True)
class ProfilePoint:
    """A corner of a profile: the item's axis, time, angle, rate, and the name of the part that begins."""

    axis: str
    at_s: float
    angle_deg: float
    rate_deg_s: float
    what: str


def profile(plan: Plan) -> list[ProfilePoint]:
    """Return the corners of each axis's rate over time, axis after axis; each axis begins at 0 s and 0°.

    The profile consists of the sweeps and the rests after them. Motions between sweeps are left out, because a rate
    table makes its own. Angles are right-handed about the axis.
    """
    by_axis: dict[str, list[tuple[Sweep, float]]] = {}
    for index, step in enumerate(plan.steps):
        if isinstance(step, Sweep):
            after = plan.steps[index + 1] if index + 1 < len(plan.steps) else None
            by_axis.setdefault(_name_axis(step.axis_flange), []).append(
                (step, after.duration_s if isinstance(after, Rest) else 0.0)
            )
    return [point for axis, sweeps in by_axis.items() for point in _corners(axis, sweeps)]


def _corners(axis: str, sweeps: list[tuple[Sweep, float]]) -> Iterator[ProfilePoint]:
    """Yield the points at which the rate about the axis starts or stops changing."""
    at_s, angle_deg = 0.0, 0.0
    for sweep, rest_s in sweeps:
        sign = 1 if _leading_component(sweep.axis_flange) > 0 else -1
        rate_deg_s = sign * math.degrees(sweep.speed_rad_s)
        ramp_s = sweep.speed_rad_s / sweep.acceleration_rad_s2
        constant_s = sweep.duration_s - 2 * ramp_s
        for lasts_s, turned_deg, rate, what in (
            (0.0, 0.0, 0.0, "at rest"),
            (ramp_s, rate_deg_s * ramp_s / 2, rate_deg_s, "constant rate begins"),
            (constant_s, rate_deg_s * constant_s, rate_deg_s, "constant rate ends"),
            (ramp_s, rate_deg_s * ramp_s / 2, 0.0, "at rest"),
        ):
            at_s, angle_deg = at_s + lasts_s, angle_deg + turned_deg
            yield ProfilePoint(axis, at_s, angle_deg, rate, what)
        at_s += rest_s


def _name_axis(axis: Vector3) -> str:
    """Return the name of an axis, the same for both directions: `x`, `y`, `z`, or a vector in the flange's frame."""
    leading = _leading_component(axis)
    upright = [component / math.copysign(1.0, leading) for component in axis]
    if abs(leading) > 1 - DIRECTION_TOLERANCE:
        return "xyz"[max(range(3), key=lambda i: abs(axis[i]))]
    return " ".join(f"{component:.4f}" for component in upright)


def _leading_component(axis: Vector3) -> float:
    """Return the component that defines the positive direction: the largest, or the first of equal ones."""
    return max(axis, key=lambda component: (round(abs(component), 6), 0))


def profile_csv(plan: Plan) -> Iterator[str]:
    """Yield the lines of the profile as CSV, headings first."""
    yield ",".join(HEADINGS)
    for point in profile(plan):
        yield f"{point.axis},{point.at_s:.4f},{point.angle_deg:z.4f},{point.rate_deg_s:.6g},{point.what}"
