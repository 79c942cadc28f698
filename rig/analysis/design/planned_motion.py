"""The motion of a plan, in the form of a recorded motion. Pure functions."""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import lru_cache
from typing import Generic, TypeVar

import numpy as np

from rig.analysis.environment import INTERPOLATION_JITTER_RATIO
from rig.config.models import RigConfig
from rig.data.recording.settings import RunSettings, Site, Uncertainty, settings_of, site_of, uncertainty_of
from rig.estimation.arrays import Array
from rig.motion.chain import DenavitHartenberg
from rig.motion.geometry import axis_errors, flange_arm, flange_attitude, flange_axes
from rig.motion.state_rows import state_dtype
from rig.motion.steps import Dwell, Plan, Rest, Step, Sweep, Transfer, progress
from rig.motion.turner_state import Joints
from rig.observation.motion.arm_motion import ATTITUDES, ArmMotion
from rig.observation.motion.revolution import Revolution

STATE_RATE_HZ = 125.0
STATE_JITTER_S = 2e-6  # jitter of an arm's state times, as runs with real-time controllers show it
ENCODER_NOISE_RAD = 2.4e-5  # noise of one reading of a joint's angle, as in logs of UR arms (docs/simulated-arm.md)
END_REST_S = 1.0  # rest before the first step and after the last
StepT = TypeVar("StepT", Sweep, Dwell)
StepT_co = TypeVar("StepT_co", bound=Step, covariant=True)


@dataclass(frozen=True, slots=True)
class PlannedRun:
    """A planned recording of a chain of joints (`arm`), and the stated errors.

    The recording's clock begins `clock_offset_s` after that of the run's first recording.
    """

    plan: Plan
    arm: DenavitHartenberg
    settings: RunSettings
    site: Site
    uncertainty: Uncertainty
    clock_offset_s: float = 0.0


def plan_run(config: RigConfig, plan: Plan, arm: DenavitHartenberg) -> PlannedRun:
    """Return the plan as a recording with the configuration's settings. Raise Refused as `settings_of` does."""
    return PlannedRun(plan, arm, settings_of(config, plan), site_of(config.site), uncertainty_of(config))


@dataclass(frozen=True, slots=True)
class Timed(Generic[StepT_co]):
    """A step of a plan with its start and end, and the joint angles at its start."""

    step: StepT_co
    start_s: float
    end_s: float
    q_rad: Joints

    @property
    def window_s(self) -> tuple[float, float]:
        """The start and end of the measurement; for a sweep the revolution, or arc, at constant speed."""
        if not isinstance(self.step, Sweep):
            return self.start_s, self.end_s
        middle, half = (self.start_s + self.end_s) / 2, self.step.angle_rad / 2 / self.step.speed_rad_s
        return middle - half, middle + half


def time_steps(plan: Plan) -> Iterator[Timed[Step]]:
    """Yield every step in order with its times, assuming that sensors settle at once before a dwell."""
    time_s, q_rad = END_REST_S, plan.start_q_rad
    for step in plan.steps:
        yield Timed(step, time_s, time_s + step.duration_s, q_rad)
        time_s += step.duration_s
        q_rad = step.target_q_rad if isinstance(step, (Sweep, Transfer)) else q_rad


def time_steps_of(plan: Plan, kind: type[StepT]) -> list[Timed[StepT]]:
    """Return the plan's steps of a class, such as `Sweep` or `Dwell`, with their times."""
    return [
        Timed(time_step.step, time_step.start_s, time_step.end_s, time_step.q_rad)
        for time_step in time_steps(plan)
        if isinstance(time_step.step, kind)
    ]


def measuring_steps(plan: Plan) -> Iterator[Timed[Step]]:
    """Yield the plan's sweeps, rests and dwells with their times."""
    return (time_step for time_step in time_steps(plan) if isinstance(time_step.step, (Sweep, Rest, Dwell)))


def predict_state_jitter(plan: Plan) -> float:
    """Return the standard deviation, s, of the times of an arm's states, including the effect of encoder noise."""
    slow_s_rad = np.mean([1 / sweep.speed_rad_s**2 for sweep in plan.sweeps]) if plan.sweeps else 0.0
    return float(np.sqrt(STATE_JITTER_S**2 + ENCODER_NOISE_RAD**2 * slow_s_rad)) * INTERPOLATION_JITTER_RATIO


def predict_revolution(timed_step: Timed[Sweep], arm: DenavitHartenberg, mount: Array) -> Revolution:
    """Return a planned sweep's revolution or arc, as `ArmMotion.turn` finds it, with a mount (3, 3) on the flange."""
    sweep, start_q_rad = timed_step.step, timed_step.step.first_q_rad
    return Revolution(
        *timed_step.window_s,
        duration_std_s=0.0,
        axis_flange=sweep.growing * mount @ _axes(start_q_rad, arm)[:, sweep.joint],
        attitude=mount @ _attitude(start_q_rad, arm),
        axis_errors=sweep.growing * _axis_errors(start_q_rad, sweep.joint, arm) @ mount.T,
        arm_m=mount @ _arm(start_q_rad, sweep.joint, arm),
        station=(sweep.joint, *np.round(np.delete(start_q_rad, sweep.joint), 2).tolist()),
        angle_rad=sweep.angle_rad,
    )


def predict_attitude(timed_step: Timed[Step], arm: DenavitHartenberg, mount: Array) -> Array:
    """Return the mean attitude (3, 3) of a planned revolution, rest or dwell, as `ArmMotion.attitude` finds it."""
    if not isinstance(timed_step.step, Sweep):
        return mount @ _attitude(timed_step.q_rad, arm)
    return mount @ _mean_attitude(
        timed_step.step.first_q_rad, timed_step.step.joint, timed_step.step.growing * timed_step.step.angle_rad, arm
    )


# Each pose recurs in every repeat, and in most plans of a search.
_axes, _axis_errors = lru_cache(maxsize=512)(flange_axes), lru_cache(maxsize=512)(axis_errors)
_attitude, _arm = lru_cache(maxsize=512)(flange_attitude), lru_cache(maxsize=512)(flange_arm)


@lru_cache(maxsize=512)
def _mean_attitude(first_q_rad: Joints, joint: int, turned_rad: float, arm: DenavitHartenberg) -> Array:
    q_rad = np.tile(first_q_rad, (ATTITUDES, 1))
    q_rad[:, joint] += turned_rad * (np.arange(ATTITUDES) + 0.5) / ATTITUDES
    mean: Array = flange_attitude(q_rad, arm).mean(axis=0)
    return mean


def predict_motion(plan: Plan, arm: DenavitHartenberg) -> ArmMotion:
    """Return the motion of a plan without vibration. Raise Fault `no_motion` if nothing moves."""
    time_s = np.arange(0.0, plan.duration_s + 2 * END_REST_S, 1 / STATE_RATE_HZ)
    states = np.zeros(len(time_s), state_dtype(arm.joints))
    states["time_s"] = time_s
    q_rad = np.tile(np.array(plan.start_q_rad), (len(time_s), 1))
    for time_step in time_steps(plan):
        step, moving = time_step.step, time_s >= time_step.start_s
        if isinstance(step, (Sweep, Transfer)):
            fraction = progress(step, time_s[moving] - time_step.start_s)[:, None]
            start, target = np.array(step.start_q_rad), np.array(step.target_q_rad)
            q_rad[moving] = start + fraction * (target - start)
    states["q_rad"] = q_rad
    return ArmMotion(states, arm)
