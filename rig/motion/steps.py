"""What an arm can be told to do, step by step: motions with their joints, speed and duration, rests and
dwells. Pure."""

import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from rig.config.section import Direction, Vector3
from rig.motion.state import Joints

# Joint angles closer than this are the same place: well above the encoder's step, well below anything that matters.
SAME_PLACE_RAD = 1e-4
TURN_RAD = 2 * math.pi
CLOSED_RAD = 1e-6  # what rounding may take from a whole turn, or add to it


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
    """One wrist through one revolution, or an arc, at constant speed, with ramps and margins outside of it.

    `index` counts the procedure's sweeps and dwells from 0. `joint` is 0 (base) to 5 (wrist 3). `direction` is "ccw"
    for a growing joint angle, "cw" for a falling one. `axis_flange` is the unit vector of the flange's angular velocity
    in the flange frame, sign included, as of the nominal arm. `revolution_rad` is the (low, high) joint angle of the
    revolution or the arc, centred on the home pose.
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

    @property
    def growing(self) -> float:
        """1 where the joint's angle grows, −1 where it falls."""
        return 1.0 if self.direction == "ccw" else -1.0

    @property
    def began_q_rad(self) -> Joints:
        """The joint angles where the revolution or the arc begins."""
        low, high = self.revolution_rad
        angle_rad = low if self.direction == "ccw" else high
        return (*self.start_q_rad[: self.joint], angle_rad, *self.start_q_rad[self.joint + 1 :])

    @property
    def angle_rad(self) -> float:
        """How far it turns while it is averaged: exactly 2π n where that is n whole turns."""
        low, high = self.revolution_rad
        return TURN_RAD * round((high - low) / TURN_RAD) if closes(high - low) else high - low


@dataclass(frozen=True, slots=True)
class Transfer:
    """A movement between sweeps or attitudes; nothing is measured during it.

    One that `tries` the mounting is a small turn of one joint that the sensors must feel about the axis and with the
    sign that the stage's mounting says, or the run ends.
    """

    name: str
    start_q_rad: Joints
    target_q_rad: Joints
    speed_rad_s: float
    acceleration_rad_s2: float
    duration_s: float
    tries: bool = False


@dataclass(frozen=True, slots=True)
class Rest:
    """The arm stands still, in the controller's time.

    One `for_temperature` lasts until the sensors are as warm as is wanted next; its duration is a guess.
    """

    name: str
    duration_s: float
    for_temperature: bool = False


@dataclass(frozen=True, slots=True)
class Dwell:
    """The arm stands still in the attitude `q_rad`, and that is measured, for `duration_s` in the controller's time.

    It begins when the sensors have settled after the way there, `settle_s` after the arm has arrived at the latest;
    `duration_s` does not hold that wait. `index` counts the procedure's sweeps and dwells from 0.
    """

    index: int
    q_rad: Joints
    duration_s: float
    settle_s: float

    @property
    def name(self) -> str:
        angles = (round(math.degrees(angle), 1) + 0.0 for angle in self.q_rad[-3:])  # no -0
        return f"dwell at {' '.join(f'{angle:g}' for angle in angles)}"


Step = Sweep | Transfer | Rest | Dwell


@dataclass(frozen=True, slots=True)
class Stage:
    """A part of a plan before which the operator mounts the item as the `instruction` says; it has its own recording.

    `mount` (3 rows of 3) is the nominal rotation from the flange's frame to the item's, in which the sensors'
    mountings stand. `indices` are those of its sweeps in the whole procedure; `begins` counts the plan's steps before.
    """

    mount: tuple[Vector3, Vector3, Vector3]
    instruction: str
    indices: frozenset[int]
    begins: int


@dataclass(frozen=True, slots=True)
class Plan:
    """Every step in order. `home_q_rad` is where the plan ends, `start_q_rad` where it expects the arm to begin.

    The item stays mounted as it is where there are no `stages`; else it is mounted for each, with the arm at home.
    """

    steps: tuple[Step, ...]
    start_q_rad: Joints
    home_q_rad: Joints
    stages: tuple[Stage, ...] = ()

    @property
    def duration_s(self) -> float:
        """The sum of all motions, rests and dwells, without the waits for sensors to settle."""
        return sum(step.duration_s for step in self.steps)

    @property
    def settling_s(self) -> float:
        """How long the waits for sensors to settle may take in all."""
        return sum(dwell.settle_s for dwell in self.dwells)

    @property
    def sweeps(self) -> tuple[Sweep, ...]:
        return tuple(step for step in self.steps if isinstance(step, Sweep))

    @property
    def dwells(self) -> tuple[Dwell, ...]:
        return tuple(step for step in self.steps if isinstance(step, Dwell))

    @property
    def waits(self) -> tuple[Rest, ...]:
        """The rests until a temperature is there."""
        return tuple(step for step in self.steps if isinstance(step, Rest) and step.for_temperature)

    @property
    def motions(self) -> tuple[Sweep | Transfer, ...]:
        return tuple(step for step in self.steps if isinstance(step, (Sweep, Transfer)))


def closes(angle_rad: float) -> bool:
    """Whether an angle is one or several whole turns: then it is known by the closure of the circle."""
    turns = round(angle_rad / TURN_RAD)
    return turns > 0 and abs(angle_rad - turns * TURN_RAD) < CLOSED_RAD


def turn_words(angle_rad: float) -> str:
    """An angle in words: a whole turn, so many of them, or degrees."""
    turns = round(angle_rad / TURN_RAD)
    whole = "a whole turn" if turns == 1 else f"{turns} whole turns"
    return whole if closes(angle_rad) else f"{math.degrees(angle_rad):g}°"


def trapezoid_duration(distance_rad: float, speed_rad_s: float, acceleration_rad_s2: float) -> float:
    """Seconds for a distance with equal ramps up and down; a short distance never reaches the speed."""
    if distance_rad < speed_rad_s**2 / acceleration_rad_s2:
        return 2 * math.sqrt(distance_rad / acceleration_rad_s2)
    return distance_rad / speed_rad_s + speed_rad_s / acceleration_rad_s2


def progress(motion: Motion, since_s: NDArray[np.float64]) -> NDArray[np.float64]:
    """(n,) share of the way, from 0 to 1, that a motion has come at times (n,) since it began."""
    way = max(map(abs, travel(motion.start_q_rad, motion.target_q_rad)))
    ramp_s = min(motion.speed_rad_s / motion.acceleration_rad_s2, motion.duration_s / 2)
    since_s = since_s.clip(0.0, motion.duration_s)
    left_s = np.minimum(since_s, motion.duration_s - since_s)
    gone = motion.acceleration_rad_s2 * (np.minimum(left_s, ramp_s) ** 2 / 2 + ramp_s * (left_s - ramp_s).clip(min=0.0))
    share: NDArray[np.float64] = np.where(since_s < motion.duration_s / 2, gone, way - gone) / way
    return share


def travel(start_q_rad: Joints, target_q_rad: Joints) -> Joints:
    """The six signed joint travels from start to target, rad."""
    return tuple(target - start for start, target in zip(start_q_rad, target_q_rad, strict=True))
