"""The steps of a plan: motions with their joints, speed and duration, rests and dwells. Pure functions."""

import math
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from rig.config.section import Direction, Vector3
from rig.motion.turner_state import Joints

POSE_TOLERANCE_RAD = 1e-4  # well above the encoder's step, well below any relevant difference
TURN_RAD = 2 * math.pi
CLOSURE_TOLERANCE_RAD = 1e-6  # of a whole turn, for rounding


class Motion(Protocol):
    """A joint-space motion, with the speed and acceleration of the joint that travels farthest.

    The other joints start and end at the same times.
    """

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
    """A revolution, or an arc, of one wrist at constant speed, with ramps and margins outside of it.

    - `index`: number among the procedure's sweeps and dwells, from 0.
    - `joint`: 0 (base) to 5 (wrist 3); `direction`: "ccw" for an increasing joint angle, "cw" for a decreasing one.
    - `axis_flange`: unit vector of the nominal arm's angular velocity in the flange frame, sign included.
    - `revolution_rad`: (low, high) joint angle of the revolution or arc, centred on the home pose.
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
        """The sign of the joint's speed, 1 or −1."""
        return 1.0 if self.direction == "ccw" else -1.0

    @property
    def first_q_rad(self) -> Joints:
        """The joint angles at the start of the revolution or arc."""
        low, high = self.revolution_rad
        angle_rad = low if self.direction == "ccw" else high
        return (*self.start_q_rad[: self.joint], angle_rad, *self.start_q_rad[self.joint + 1 :])

    @property
    def angle_rad(self) -> float:
        """The angle over which readings are averaged: exactly 2π n for n whole turns."""
        low, high = self.revolution_rad
        return TURN_RAD * round((high - low) / TURN_RAD) if closes(high - low) else high - low


@dataclass(frozen=True, slots=True)
class Transfer:
    """A motion between sweeps or attitudes, without measurement.

    If `tries` is true, the transfer is a small turn of one joint that tests the mounting. The run ends unless the
    sensors sense this turn about the axis, and with the sign, that the stage's mounting predicts.
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
    """A rest of the arm for `duration_s` on the controller's clock.

    If `for_temperature`, the rest lasts until the sensors have the next temperature, and `duration_s` is an estimate.
    """

    name: str
    duration_s: float
    for_temperature: bool = False


@dataclass(frozen=True, slots=True)
class Dwell:
    """A measured rest in the attitude `q_rad` for `duration_s` on the controller's clock.

    The dwell begins when the sensors have settled, at most `settle_s` after the arm's arrival; `duration_s` does not
    include this time. `index` is the number among the procedure's sweeps and dwells, from 0.
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
    """A part of a plan with its own recording, before which the operator mounts the item as the `instruction` says.

    `mount` (3 rows of 3): nominal rotation from the flange's frame to the item's, to which sensors' mountings refer.
    `indices`: the indices of the stage's sweeps in the whole procedure; `begins`: the number of steps before the stage.
    """

    mount: tuple[Vector3, Vector3, Vector3]
    instruction: str
    indices: frozenset[int]
    begins: int


@dataclass(frozen=True, slots=True)
class Plan:
    """All steps of a run in order; `start_q_rad` is the expected pose at the start, `home_q_rad` the pose at the end.

    Without `stages` the item's mounting does not change; else it changes before each stage, with the arm at home.
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
        """The greatest total wait for sensors to settle, s."""
        return sum(dwell.settle_s for dwell in self.dwells)

    @property
    def sweeps(self) -> tuple[Sweep, ...]:
        return tuple(step for step in self.steps if isinstance(step, Sweep))

    @property
    def dwells(self) -> tuple[Dwell, ...]:
        return tuple(step for step in self.steps if isinstance(step, Dwell))

    @property
    def waits(self) -> tuple[Rest, ...]:
        """The rests that last until a temperature is reached."""
        return tuple(step for step in self.steps if isinstance(step, Rest) and step.for_temperature)

    @property
    def motions(self) -> tuple[Sweep | Transfer, ...]:
        return tuple(step for step in self.steps if isinstance(step, (Sweep, Transfer)))


def closes(angle_rad: float) -> bool:
    """Return whether an angle is one or more whole turns, so that an encoder's error at both ends cancels."""
    turns = round(angle_rad / TURN_RAD)
    return turns > 0 and abs(angle_rad - turns * TURN_RAD) < CLOSURE_TOLERANCE_RAD


def turn_words(angle_rad: float) -> str:
    """Return an angle in words: whole turns, or degrees."""
    turns = round(angle_rad / TURN_RAD)
    whole = "a whole turn" if turns == 1 else f"{turns} whole turns"
    return whole if closes(angle_rad) else f"{math.degrees(angle_rad):g}°"


def trapezoid_duration(distance_rad: float, speed_rad_s: float, acceleration_rad_s2: float) -> float:
    """Return the duration, s, of a motion with equal ramps, even if the distance is too short to reach the speed."""
    if distance_rad < speed_rad_s**2 / acceleration_rad_s2:
        return 2 * math.sqrt(distance_rad / acceleration_rad_s2)
    return distance_rad / speed_rad_s + speed_rad_s / acceleration_rad_s2


def progress(motion: Motion, elapsed_s: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return the fraction of the path (n,), 0 to 1, that a motion has covered at times (n,) after its start."""
    distance = max(map(abs, travel(motion.start_q_rad, motion.target_q_rad)))
    ramp_s = min(motion.speed_rad_s / motion.acceleration_rad_s2, motion.duration_s / 2)
    elapsed_s = elapsed_s.clip(0.0, motion.duration_s)
    end_s = np.minimum(elapsed_s, motion.duration_s - elapsed_s)
    gone = motion.acceleration_rad_s2 * (np.minimum(end_s, ramp_s) ** 2 / 2 + ramp_s * (end_s - ramp_s).clip(min=0.0))
    fraction: NDArray[np.float64] = np.where(elapsed_s < motion.duration_s / 2, gone, distance - gone) / distance
    return fraction


def travel(start_q_rad: Joints, target_q_rad: Joints) -> Joints:
    """Return the signed joint travels (n,) from start to target, rad."""
    return tuple(target - start for start, target in zip(start_q_rad, target_q_rad, strict=True))
