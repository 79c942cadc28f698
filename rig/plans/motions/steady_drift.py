"""The effect of a steady drift of the bias on a calibration, from the plan alone. Pure functions."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from rig.config.section import Vector3
from rig.motion.geometry import flange_attitude
from rig.motion.steps import Dwell, Rest, Step, Sweep, Transfer, closes
from rig.motion.turner_state import Joints

ARC_POSES = 24
NEGLIGIBLE_RATIO = 1e-6  # to the largest singular value: directions that attitudes do not determine are omitted


@dataclass(frozen=True, slots=True)
class PlannedAverage:
    """A planned average over a sweep, rest or dwell.

    - `rate_rad_s`: the flange's rate in its own frame, zero at rest.
    - `q_rad`: the arm's pose, for a sweep at its start.
    - `middle_s`: the middle of the averaging time, counted from the start of the first step.
    - `duration_s`: the length of the averaging time.
    - `on_the_way`: poses spaced evenly along an arc; empty for whole turns.
    """

    rate_rad_s: Vector3
    q_rad: Joints
    middle_s: float
    duration_s: float
    on_the_way: tuple[Joints, ...] = ()


def drift_effect(steps: Sequence[Step]) -> float:
    """Return the change of the calibration, rad/s, if the bias rises by 1 rad/s from the first average to the last.

    The vector model m = F ω + c (+ G a if there are rests; `rig.estimation.gyroscope.vector_model`) is fitted to this
    ramp, less its mean. The result is the root of the sum of squares of the changes of scale, times the sweeps' RMS
    speed, and of bias. The base counts as upright; each average has a weight in proportion to its duration.
    """
    looks = list(_list_averages(steps))
    rates = np.array([look.rate_rad_s for look in looks])
    downwards = flange_attitude(np.array([look.q_rad for look in looks])) @ (0.0, 0.0, -1.0)
    speeds = np.linalg.norm(rates, axis=1, keepdims=True)
    turning = speeds[:, 0] > 0
    axes = rates[turning] / speeds[turning]
    downwards[turning] = np.sum(downwards[turning] * axes, axis=1, keepdims=True) * axes  # the mean over a whole turn
    for index, look in enumerate(looks):
        if look.on_the_way:
            downwards[index] = flange_attitude(np.array(look.on_the_way)).mean(axis=0) @ (0.0, 0.0, -1.0)
    middles = np.array([look.middle_s for look in looks])
    ramp = (middles - middles.mean()) / np.ptp(middles)
    root = np.sqrt([look.duration_s for look in looks])
    speed = np.sqrt(np.mean(speeds[turning] ** 2))
    gravity = [] if turning.all() else [downwards]
    design = np.column_stack([rates / speed, np.ones(len(rates)), *gravity])
    coefficients = np.linalg.pinv(root[:, None] * design, rcond=NEGLIGIBLE_RATIO) @ (root * ramp)
    return float(np.sqrt(coefficients[:3] @ coefficients[:3] + 3 * coefficients[3] ** 2))  # the three axes drift alike


def _poses_on_arc(sweep: Sweep) -> tuple[Joints, ...]:
    if closes(sweep.angle_rad):
        return ()
    q_rad = np.tile(sweep.start_q_rad, (ARC_POSES, 1))
    low, high = sweep.revolution_rad
    q_rad[:, sweep.joint] = low + (np.arange(ARC_POSES) + 0.5) / ARC_POSES * (high - low)
    return tuple(map(tuple, q_rad.tolist()))


def _list_averages(steps: Sequence[Step]) -> Iterator[PlannedAverage]:
    """Yield the averages over sweeps, over dwells, and over the rests after the first motion."""
    time_s, pose = 0.0, None
    for step in steps:
        middle_s = time_s + step.duration_s / 2
        match step:
            case Sweep():
                x, y, z = (step.speed_rad_s * axis for axis in step.axis_flange)
                yield PlannedAverage((x, y, z), step.start_q_rad, middle_s, step.duration_s, _poses_on_arc(step))
                pose = step.end_q_rad
            case Transfer():
                pose = step.target_q_rad
            case Dwell():
                pose = step.q_rad
        if isinstance(step, (Rest, Dwell)) and pose is not None:
            yield PlannedAverage((0.0, 0.0, 0.0), pose, middle_s, step.duration_s)
        time_s += step.duration_s
