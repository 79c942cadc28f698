"""A plan as if it had been recorded: when the arm would be where. Pure."""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Generic, TypeVar

import numpy as np

from rig.motion.geometry import DenavitHartenberg
from rig.motion.state import state_dtype
from rig.motion.steps import Dwell, Plan, Rest, Step, Sweep, Transfer, progress
from rig.observation.arm_motion import ArmMotion

STATE_RATE_HZ = 125.0
STANDING_S = 1.0  # before the first step and after the last
StepT = TypeVar("StepT", Sweep, Dwell)
StepT_co = TypeVar("StepT_co", bound=Step, covariant=True)


@dataclass(frozen=True, slots=True)
class Timed(Generic[StepT_co]):
    """A step, and when it begins and ends."""

    step: StepT_co
    start_s: float
    end_s: float

    @property
    def window_s(self) -> tuple[float, float]:
        """When what counts of it begins and ends: of a sweep its whole turn, or its arc, at constant speed."""
        if not isinstance(self.step, Sweep):
            return self.start_s, self.end_s
        middle, half = (self.start_s + self.end_s) / 2, self.step.angle_rad / 2 / self.step.speed_rad_s
        return middle - half, middle + half


def timed(plan: Plan) -> Iterator[Timed[Step]]:
    """Every step of it, one after the other; no sensor takes long to settle before a dwell."""
    time_s = STANDING_S
    for step in plan.steps:
        yield Timed(step, time_s, time_s + step.duration_s)
        time_s += step.duration_s


def planned_motion(plan: Plan, arm: DenavitHartenberg) -> ArmMotion:
    """The motion of an arm, or of another chain of joints, made so, without vibration.

    Raises Fault `no_motion` where nothing moves.
    """
    time_s = np.arange(0.0, plan.duration_s + 2 * STANDING_S, 1 / STATE_RATE_HZ)
    states = np.zeros(len(time_s), state_dtype(arm.joints))
    states["time_s"] = time_s
    q_rad = np.tile(np.array(plan.start_q_rad), (len(time_s), 1))
    for each in timed(plan):
        step, since = each.step, time_s >= each.start_s
        if isinstance(step, (Sweep, Transfer)):
            share = progress(step, time_s[since] - each.start_s)[:, None]
            start, target = np.array(step.start_q_rad), np.array(step.target_q_rad)
            q_rad[since] = start + share * (target - start)
    states["q_rad"] = q_rad
    return ArmMotion(states, arm)


def timed_of(plan: Plan, kind: type[StepT]) -> list[Timed[StepT]]:
    """The plan's steps of one kind, its sweeps alone or its dwells, with their times."""
    return [Timed(each.step, each.start_s, each.end_s) for each in timed(plan) if isinstance(each.step, kind)]


def measured(plan: Plan) -> Iterator[Timed[Step]]:
    """What a plan measures: its sweeps, rests and dwells, with their times."""
    return (each for each in timed(plan) if isinstance(each.step, (Sweep, Rest, Dwell)))
