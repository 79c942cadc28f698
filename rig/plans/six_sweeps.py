"""The six sweeps of SIX, Section III, around the home pose, with the ways between them and the rests after them."""

import math
from collections.abc import Collection, Iterable

import numpy as np

from rig.arm.kinematics import flange_axes
from rig.arm.motion import SAME_PLACE_RAD, Plan, Rest, Step, Sweep, Transfer, trapezoid_duration, travel
from rig.arm.state import JOINT_NAMES, Joints
from rig.config.models import ArmSection
from rig.config.procedure_sections import SixSweepsSection
from rig.errors import Refused

# The first motion may swing the large joints from wherever somebody left the arm, so it is made at leisure.
APPROACH_SPEED_RAD_S = math.radians(30)
APPROACH_ACCELERATION_RAD_S2 = math.radians(60)
# The swept axes must span space: the smallest singular value of their unit vectors, 1 when orthogonal.
AXES_SPAN = 0.5


def plan_six_observation(
    arm: ArmSection,
    procedure: SixSweepsSection,
    start_q_rad: Joints | None = None,
    done: Collection[int] = (),
) -> Plan:
    """The movement of SIX, Section III: each wrist in the configured order turns clockwise, rests, turns back, rests.

    `start_q_rad` is where the arm stands (home when None); from there the plan goes home first, slowly, and it ends
    at home.
    `done` holds the indices of sweeps to leave out: those an interrupted run has finished.
    The whole series repeats `procedure.repeats` times. Limits are not judged here: see `rig.arm.preflight`.
    Raises Refused `axes_do_not_span`.
    """
    home = _radians(arm.home_deg)
    _check_span(home, procedure)
    start = home if start_q_rad is None else start_q_rad
    sweeps = [sweep for sweep in _sweeps(home, procedure) if sweep.index not in done]
    steps = tuple(_connected(sweeps, start, home, arm, procedure))
    return Plan(steps, start_q_rad=start, home_q_rad=home)


def _check_span(home: Joints, procedure: SixSweepsSection) -> None:
    """Six parameters can be told only from turns about three independent axes."""
    swept = sorted(JOINT_NAMES.index(wrist) for wrist in set(procedure.order))
    span = np.linalg.svd(flange_axes(home)[:, swept], compute_uv=False)
    if len(span) < 3 or span[2] < AXES_SPAN:
        raise Refused(
            "axes_do_not_span",
            "the swept wrists do not turn the flange about three independent axes",
            "Set wrist 2 in arm.home_deg near 90 or -90, and sweep all three wrists",
        )


def _sweeps(home: Joints, procedure: SixSweepsSection) -> list[Sweep]:
    """The sweeps in order, each around the home pose."""
    speed, acceleration = math.radians(procedure.speed_deg_s), math.radians(procedure.acceleration_deg_s2)
    half_travel = math.pi + math.radians(procedure.margin_deg) + speed**2 / (2 * acceleration)
    duration = trapezoid_duration(2 * half_travel, speed, acceleration)
    wanted = [
        (wrist, direction)
        for _ in range(procedure.repeats)
        for wrist in procedure.order
        for direction in procedure.directions
    ]
    sweeps = []
    for index, (wrist, direction) in enumerate(wanted):
        joint = JOINT_NAMES.index(wrist)
        sign = 1 if direction == "ccw" else -1
        x, y, z = (sign * flange_axes(home)[:, joint]).tolist()
        sweeps.append(
            Sweep(
                index=index,
                joint=joint,
                joint_name=wrist,
                direction=direction,
                axis_flange=(x, y, z),
                start_q_rad=_with_joint(home, joint, home[joint] - sign * half_travel),
                end_q_rad=_with_joint(home, joint, home[joint] + sign * half_travel),
                speed_rad_s=speed,
                acceleration_rad_s2=acceleration,
                duration_s=duration,
                revolution_rad=(home[joint] - math.pi, home[joint] + math.pi),
            )
        )
    return sweeps


def _connected(
    sweeps: list[Sweep], start: Joints, home: Joints, arm: ArmSection, procedure: SixSweepsSection
) -> Iterable[Step]:
    """Sweeps with the rests after them and a transfer wherever the arm is not yet where the next one begins."""
    speed, acceleration = math.radians(arm.transfer_speed_deg_s), math.radians(procedure.acceleration_deg_s2)
    leisure = min(speed, APPROACH_SPEED_RAD_S), min(acceleration, APPROACH_ACCELERATION_RAD_S2)
    yield from _transfer("approach home", start, home, *leisure)
    here = home
    for sweep in sweeps:
        yield from _transfer(f"transfer to the start of {sweep.name}", here, sweep.start_q_rad, speed, acceleration)
        yield sweep
        if procedure.rest_s > 0:
            yield Rest(f"rest after {sweep.name}", procedure.rest_s)
        here = sweep.end_q_rad
    yield from _transfer("transfer home", here, home, speed, acceleration)


def _transfer(
    name: str, start: Joints, target: Joints, speed_rad_s: float, acceleration_rad_s2: float
) -> Iterable[Transfer]:
    distance_rad = max(map(abs, travel(start, target)))
    if distance_rad > SAME_PLACE_RAD:
        duration_s = trapezoid_duration(distance_rad, speed_rad_s, acceleration_rad_s2)
        yield Transfer(name, start, target, speed_rad_s, acceleration_rad_s2, duration_s)


def _radians(degrees: Iterable[float]) -> Joints:
    return tuple(math.radians(angle) for angle in degrees)


def _with_joint(q_rad: Joints, joint: int, angle_rad: float) -> Joints:
    return (*q_rad[:joint], angle_rad, *q_rad[joint + 1 :])
