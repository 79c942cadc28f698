"""A plan as if it had been recorded: when the arm would be where, and how it would turn. Pure."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from typing import Generic, TypeVar

import numpy as np

from rig.config.models import RigConfig
from rig.data.recording.settings import RunSettings, Site, Uncertainty, settings_of, site_of, uncertainty_of
from rig.estimation.arrays import Array
from rig.motion.geometry import DenavitHartenberg, axis_errors, flange_arm, flange_attitude, flange_axes
from rig.motion.state import Joints, state_dtype
from rig.motion.steps import Dwell, Plan, Rest, Step, Sweep, Transfer, progress
from rig.observation.motion.arm_motion import ATTITUDES, ArmMotion
from rig.observation.motion.revolution import Revolution

STATE_RATE_HZ = 125.0
STANDING_S = 1.0  # before the first step and after the last
StepT = TypeVar("StepT", Sweep, Dwell)
StepT_co = TypeVar("StepT_co", bound=Step, covariant=True)


@dataclass(frozen=True, slots=True)
class PlannedRun:
    """A recording that a plan will give, of a chain of joints made so (`arm`), and what is stated beforehand.

    Its clock begins `since_s` after that of the run's first recording.
    """

    plan: Plan
    arm: DenavitHartenberg
    settings: RunSettings
    site: Site
    known: Uncertainty
    since_s: float = 0.0


def planned_run(config: RigConfig, plan: Plan, arm: DenavitHartenberg) -> PlannedRun:
    """A new run of the plan. Raises Refused as `settings_of`."""
    return PlannedRun(plan, arm, settings_of(config, plan), site_of(config.site), uncertainty_of(config))


@dataclass(frozen=True, slots=True)
class Timed(Generic[StepT_co]):
    """A step, when it begins and ends, and the joint angles where it begins."""

    step: StepT_co
    start_s: float
    end_s: float
    q_rad: Joints

    @property
    def window_s(self) -> tuple[float, float]:
        """When what counts of it begins and ends: of a sweep its whole turn, or its arc, at constant speed."""
        if not isinstance(self.step, Sweep):
            return self.start_s, self.end_s
        middle, half = (self.start_s + self.end_s) / 2, self.step.angle_rad / 2 / self.step.speed_rad_s
        return middle - half, middle + half


def timed(plan: Plan) -> Iterator[Timed[Step]]:
    """Every step of it, one after the other; no sensor takes long to settle before a dwell."""
    time_s, q_rad = STANDING_S, plan.start_q_rad
    for step in plan.steps:
        yield Timed(step, time_s, time_s + step.duration_s, q_rad)
        time_s += step.duration_s
        q_rad = step.target_q_rad if isinstance(step, (Sweep, Transfer)) else q_rad


def timed_of(plan: Plan, kind: type[StepT]) -> list[Timed[StepT]]:
    """The plan's steps of one kind, its sweeps alone or its dwells, with their times."""
    return [
        Timed(each.step, each.start_s, each.end_s, each.q_rad) for each in timed(plan) if isinstance(each.step, kind)
    ]


def measured(plan: Plan) -> Iterator[Timed[Step]]:
    """What a plan measures: its sweeps, rests and dwells, with their times."""
    return (each for each in timed(plan) if isinstance(each.step, (Sweep, Rest, Dwell)))


def planned_turn(at: Timed[Sweep], arm: DenavitHartenberg, mount: Array) -> Revolution:
    """The turn of a sweep, or its arc, as `ArmMotion.turn` will find it where the item is mounted so (3, 3)."""
    sweep, began = at.step, at.step.began_q_rad
    return Revolution(
        *at.window_s,
        duration_std_s=0.0,
        axis_flange=sweep.growing * mount @ _axes(began, arm)[:, sweep.joint],
        attitude=mount @ _attitude(began, arm),
        axis_errors=sweep.growing * _axis_errors(began, sweep.joint, arm) @ mount.T,
        arm_m=mount @ _arm(began, sweep.joint, arm),
        station=(sweep.joint, *np.round(np.delete(began, sweep.joint), 2).tolist()),
        angle_rad=sweep.angle_rad,
    )


def planned_attitude(at: Timed[Step], arm: DenavitHartenberg, mount: Array) -> Array:
    """The mean attitude (3, 3) over a sweep's turn, or of a rest or a dwell, as `ArmMotion.attitude` will find it."""
    if not isinstance(at.step, Sweep):
        return mount @ _attitude(at.q_rad, arm)
    return mount @ _mean_attitude(at.step.began_q_rad, at.step.joint, at.step.growing * at.step.angle_rad, arm)


# Each pose comes again in every repeat, and in most of the plans that a search looks at.
_axes, _axis_errors = lru_cache(maxsize=512)(flange_axes), lru_cache(maxsize=512)(axis_errors)
_attitude, _arm = lru_cache(maxsize=512)(flange_attitude), lru_cache(maxsize=512)(flange_arm)


@lru_cache(maxsize=512)
def _mean_attitude(began_q_rad: Joints, joint: int, turned_rad: float, arm: DenavitHartenberg) -> Array:
    q_rad = np.tile(began_q_rad, (ATTITUDES, 1))
    q_rad[:, joint] += turned_rad * (np.arange(ATTITUDES) + 0.5) / ATTITUDES
    mean: Array = flange_attitude(q_rad, arm).mean(axis=0)
    return mean


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
