"""What a bias that drifts steadily does to a calibration, by the plan alone. Pure."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from rig.config.section import Vector3
from rig.motion.geometry import flange_attitude
from rig.motion.state import Joints
from rig.motion.steps import Dwell, Rest, Step, Sweep, Transfer, closes

ON_THE_WAY = 24  # poses of an arc
NEGLIGIBLE = 1e-6  # of the largest singular value: what attitudes do not tell is left alone


@dataclass(frozen=True, slots=True)
class Look:
    """What is averaged: the flange's rate, where the arm stands (a sweep: begins), when, how long.

    `on_the_way` are poses evenly along an arc; there are none along whole turns.
    """

    rate_rad_s: Vector3
    q_rad: Joints
    middle_s: float
    duration_s: float
    on_the_way: tuple[Joints, ...] = ()


def drift_effect(steps: Sequence[Step]) -> float:
    """Change of the calibration, in rad/s, for a bias that rises by 1 rad/s from the first sweep to the last step.

    The vector model of sweeps and rests, m = F ω + c (+ G a, with rests: `rig.estimation.gyroscope.vector_model`), is
    fitted to that ramp about its middle: what it takes for scale, at the mean speed of the sweeps, and for bias are
    added in quadrature. Of an arm that stands on the floor; weights as of white noise.
    """
    looks = list(_looks(steps))
    rates = np.array([look.rate_rad_s for look in looks])
    downwards = flange_attitude(np.array([look.q_rad for look in looks])) @ (0.0, 0.0, -1.0)
    speeds = np.linalg.norm(rates, axis=1, keepdims=True)
    turning = speeds[:, 0] > 0
    axes = rates[turning] / speeds[turning]
    downwards[turning] = np.sum(downwards[turning] * axes, axis=1, keepdims=True) * axes  # the mean over a whole turn
    for place, look in enumerate(looks):
        if look.on_the_way:
            downwards[place] = flange_attitude(np.array(look.on_the_way)).mean(axis=0) @ (0.0, 0.0, -1.0)
    middles = np.array([look.middle_s for look in looks])
    ramp = (middles - middles.mean()) / np.ptp(middles)
    root = np.sqrt([look.duration_s for look in looks])
    speed = np.sqrt(np.mean(speeds[turning] ** 2))
    gravity = [] if turning.all() else [downwards]
    design = np.column_stack([rates / speed, np.ones(len(rates)), *gravity])
    taken = np.linalg.pinv(root[:, None] * design, rcond=NEGLIGIBLE) @ (root * ramp)
    return float(np.sqrt(taken[:3] @ taken[:3] + 3 * taken[3] ** 2))  # the three axes drift alike


def _on_the_way(sweep: Sweep) -> tuple[Joints, ...]:
    if closes(sweep.angle_rad):
        return ()
    q_rad = np.tile(sweep.start_q_rad, (ON_THE_WAY, 1))
    low, high = sweep.revolution_rad
    q_rad[:, sweep.joint] = low + (np.arange(ON_THE_WAY) + 0.5) / ON_THE_WAY * (high - low)
    return tuple(map(tuple, q_rad.tolist()))


def _looks(steps: Sequence[Step]) -> Iterator[Look]:
    """The sweeps, the rests after them, and the dwells."""
    time_s, here = 0.0, None
    for step in steps:
        middle_s = time_s + step.duration_s / 2
        match step:
            case Sweep():
                x, y, z = (step.speed_rad_s * axis for axis in step.axis_flange)
                yield Look((x, y, z), step.start_q_rad, middle_s, step.duration_s, _on_the_way(step))
                here = step.end_q_rad
            case Transfer():
                here = step.target_q_rad
            case Dwell():
                here = step.q_rad
        if isinstance(step, (Rest, Dwell)) and here is not None:
            yield Look((0.0, 0.0, 0.0), here, middle_s, step.duration_s)
        time_s += step.duration_s
