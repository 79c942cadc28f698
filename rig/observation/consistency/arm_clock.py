"""What the times of a controller's states tell of its clock: its rate by the computer's, and how its times scatter."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import comb

import numpy as np

from rig.observation.motion.arm_motion import ArmMotion
from rig.observation.observed_run import ObservedRun
from rig.observation.statistics.coloured_noise import widening
from rig.observation.windows import inside, swept

ORDER = 6
EVEN_S = 1e-4  # states whose steps in time differ by less follow each other evenly


@dataclass(frozen=True, slots=True)
class Jitter:
    """Scatter of the times of the arm's states: standard deviation in s, and its degrees of freedom."""

    std_s: float
    freedom: float


@dataclass(frozen=True, slots=True)
class ClockRate:
    """How much too fast a clock runs by another, its standard deviation, both fractions, and degrees of freedom."""

    error: float
    std: float
    freedom: float


def compare_with_computer(motion: ArmMotion) -> ClockRate:
    """Return the rate of the controller's clock by the computer's: a line through when the states came.

    States come late in bursts, so fewer than all of them count as independent.
    """
    host_s, arm_s = motion.host_time_s - motion.host_time_s[0], motion.time_s - motion.time_s[0]
    design = np.column_stack([np.ones_like(host_s), host_s])
    (offset, slope), *_ = np.linalg.lstsq(design, arm_s, rcond=None)
    late_s = arm_s - design @ (offset, slope)
    independent = len(late_s) / widening(late_s)
    std = float(late_s.std() / host_s.std() / np.sqrt(independent))
    return ClockRate(float(slope - 1), std, max(independent - 2, 1.0))


def state_jitter(recordings: Sequence[ObservedRun]) -> Jitter:
    """Return the jitter of the times of the arm's states, by how the joint angles of all sweeps of a run scatter.

    Differences of the sixth order: of what the servo does, slow beside the states, nothing is left in them. What is
    left are the times, and the encoder's steps. Neighbouring differences share states: n of them have the freedom of
    n / Σ ρ², where Σ ρ² over all lags is C(24, 12) / C(12, 6)².
    """
    scatter, count = [], 0
    sweeps = [(each, finished) for each in recordings for finished in swept(each.run)]
    for recording, finished in sweeps:
        motion = recording.motion
        time_s = motion.time_s[inside(motion.time_s, finished.window)]
        steps = np.diff(motion.angle(finished.sweep, time_s), n=ORDER)
        even = np.ptp(np.lib.stride_tricks.sliding_window_view(np.diff(time_s), ORDER), axis=1)
        steps = steps[even < EVEN_S]
        if len(steps):
            scatter.append(np.mean(steps**2) / comb(2 * ORDER, ORDER) / finished.sweep.speed_rad_s**2)
            count += len(steps)
    if not scatter:
        return Jitter(0.0, np.inf)
    return Jitter(float(np.sqrt(np.mean(scatter))), count * comb(2 * ORDER, ORDER) ** 2 / comb(4 * ORDER, 2 * ORDER))
