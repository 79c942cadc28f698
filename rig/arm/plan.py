"""The movement before it happens: every motion with its joints, limits and duration. Pure; connects to nothing."""

import math
from collections.abc import Collection, Iterable
from dataclasses import dataclass
from typing import Protocol

from rig.arm.kinematics import flange_axes
from rig.arm.state import JOINT_NAMES, Joints
from rig.config.models import ArmSection, Direction, ProcedureSection, Vector3

# Joint angles closer than this are the same place: well above the encoder's step, well below anything that matters.
SAME_PLACE_RAD = 1e-4

# The first motion may swing the large joints from wherever somebody left the arm, so it is made at leisure.
APPROACH_SPEED_RAD_S = math.radians(30)
APPROACH_ACCELERATION_RAD_S2 = math.radians(60)


class Motion(Protocol):
    """One joint-space movement: the joint that travels farthest has this speed and acceleration; others keep pace."""

    @property
    def name(self) -> str: ...
    @property
    def start_q_rad(self) -> Joints: ...
    @property
    def target_q_rad(self) -> Joints: ...
    @property
    def speed_rad_s(self) -> float: ...
    @property
    def acceleration_rad_s2(self) -> float: ...
    @property
    def duration_s(self) -> float: ...


@dataclass(frozen=True, slots=True)
class Sweep:
    """One wrist through one revolution at constant speed, with ramps and margins outside the revolution.

    `index` counts the plan's sweeps from 0. `joint` is 0 (base) to 5 (wrist 3). `direction` is "ccw" for a growing
    joint angle, "cw" for a falling one. `axis_flange` is the unit vector of the flange's angular velocity in the
    flange frame, sign included. `revolution_rad` is the (low, high) joint angle of the revolution: exactly 2π,
    centred on the home pose.
    """

    index: int
    joint: int
    joint_name: str
    direction: Direction
    axis_flange: Vector3
    start_q_rad: Joints
    end_q_rad: Joints
    speed_rad_s: float
    acceleration_rad_s2: float
    duration_s: float
    revolution_rad: tuple[float, float]

    @property
    def name(self) -> str:
        return f"sweep {self.joint_name} {self.direction}"

    @property
    def target_q_rad(self) -> Joints:
        return self.end_q_rad


@dataclass(frozen=True, slots=True)
class Transfer:
    """A movement between sweeps; nothing is measured during it."""

    name: str
    start_q_rad: Joints
    target_q_rad: Joints
    speed_rad_s: float
    acceleration_rad_s2: float
    duration_s: float


@dataclass(frozen=True, slots=True)
class Rest:
    """The arm stands still, in the controller's time."""

    name: str
    duration_s: float


Step = Sweep | Transfer | Rest


@dataclass(frozen=True, slots=True)
class Plan:
    """Every step in order. `home_q_rad` is where the plan ends, `start_q_rad` where it expects the arm to begin."""

    steps: tuple[Step, ...]
    start_q_rad: Joints
    home_q_rad: Joints

    @property
    def duration_s(self) -> float:
        """The sum of all motions and rests."""
        return sum(step.duration_s for step in self.steps)

    @property
    def sweeps(self) -> tuple[Sweep, ...]:
        return tuple(step for step in self.steps if isinstance(step, Sweep))

    @property
    def motions(self) -> tuple[Sweep | Transfer, ...]:
        return tuple(step for step in self.steps if not isinstance(step, Rest))


def trapezoid_duration(distance_rad: float, speed_rad_s: float, acceleration_rad_s2: float) -> float:
    """Seconds for a distance with equal ramps up and down; a short distance never reaches the speed."""
    if distance_rad < speed_rad_s**2 / acceleration_rad_s2:
        return 2 * math.sqrt(distance_rad / acceleration_rad_s2)
    return distance_rad / speed_rad_s + speed_rad_s / acceleration_rad_s2


def travel(start_q_rad: Joints, target_q_rad: Joints) -> Joints:
    """The six signed joint travels from start to target, rad."""
    return tuple(target - start for start, target in zip(start_q_rad, target_q_rad, strict=True))


def plan_six_observation(
    arm: ArmSection,
    procedure: ProcedureSection,
    start_q_rad: Joints | None = None,
    done: Collection[int] = (),
) -> Plan:
    """The movement of SIX, Section III: each wrist in the configured order turns clockwise, rests, turns back, rests.

    `start_q_rad` is where the arm stands (home when None); from there the plan goes home first, slowly, and it ends
    at home.
    `done` holds the indices of sweeps to leave out: those an interrupted run has finished.
    The whole series repeats `procedure.repeats` times. Limits are not judged here: see `rig.arm.preflight`.
    """
    home = _radians(arm.home_deg)
    start = home if start_q_rad is None else start_q_rad
    sweeps = [sweep for sweep in _sweeps(home, procedure) if sweep.index not in done]
    steps = tuple(_connected(sweeps, start, home, arm, procedure))
    return Plan(steps, start_q_rad=start, home_q_rad=home)


def _sweeps(home: Joints, procedure: ProcedureSection) -> list[Sweep]:
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
    sweeps: list[Sweep], start: Joints, home: Joints, arm: ArmSection, procedure: ProcedureSection
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
