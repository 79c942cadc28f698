"""The quality of the arm's states: the rate of their clock, the jitter of their times, the noise of their angles."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from math import comb

import numpy as np

from rig.estimation.arrays import Array
from rig.motion.steps import Sweep
from rig.observation.motion.arm_motion import ArmMotion
from rig.observation.observed_run import ObservedRun
from rig.observation.statistics.coloured_noise import correlation_inflation
from rig.observation.windows import inside, swept

ORDER = 6
VARIANCE_RATIO = comb(2 * ORDER, ORDER)  # of a difference of this order to the variance of one reading
EVENNESS_S = 1e-4  # states whose time steps differ by less count as evenly spaced


@dataclass(frozen=True, slots=True)
class Jitter:
    """The standard deviation of the times of the arm's states, s, and its degrees of freedom."""

    std_s: float
    dof: float


@dataclass(frozen=True, slots=True)
class ClockRate:
    """The rate error of a clock against another and its standard deviation, both fractions, with degrees of freedom."""

    error: float
    std: float
    dof: float


def compare_with_computer(motion: ArmMotion) -> ClockRate:
    """Return the rate error of the controller's clock against the computer's, by a straight line through arrival times.

    States arrive in bursts after delays, so the degrees of freedom are fewer than the states.
    """
    host_s, arm_s = motion.host_time_s - motion.host_time_s[0], motion.time_s - motion.time_s[0]
    design = np.column_stack([np.ones_like(host_s), host_s])
    (offset, slope), *_ = np.linalg.lstsq(design, arm_s, rcond=None)
    late_s = arm_s - design @ (offset, slope)
    independent = len(late_s) / correlation_inflation(late_s)
    std = float(late_s.std() / host_s.std() / np.sqrt(independent))
    return ClockRate(float(slope - 1), std, max(independent - 2, 1.0))


def state_jitter(recordings: Sequence[ObservedRun]) -> Jitter:
    """Return the jitter of the times of the arm's states, from the scatter of the joint angles in all sweeps of a run.

    Differences of the sixth order remove the servo's motion, which is slow compared with the states, and keep the
    errors of the times and the noise and steps of the encoder. Neighbouring differences share states and so are
    correlated. With the correlation ρ(k) of differences k apart, n differences have n / Σ ρ(k)² degrees of freedom,
    with Σ ρ(k)² = C(24, 12) / C(12, 6)² over all k, where C is the binomial coefficient.
    """
    count = 0
    scatter = []
    for sweep, steps_rad in _difference_sweeps(recordings):
        steps = steps_rad[:, sweep.joint]
        if len(steps):
            scatter.append(np.mean(steps**2) / VARIANCE_RATIO / sweep.speed_rad_s**2)
            count += len(steps)
    if not scatter:
        return Jitter(0.0, np.inf)
    return Jitter(float(np.sqrt(np.mean(scatter))), count * VARIANCE_RATIO**2 / comb(4 * ORDER, 2 * ORDER))


def find_encoder_noise_rad(recordings: Sequence[ObservedRun]) -> float:
    """Return the noise of one reading of a joint's angle, rad, from the joints that are at rest during a sweep.

    The noise is the scatter of sixth differences, as in `state_jitter`, and includes the encoders' steps. Return zero
    if the noise is unknown, because the turner has a single shaft, which never rests in a sweep, or inaccurate angles.
    """
    squares = [
        np.mean(np.delete(steps_rad, sweep.joint, axis=1) ** 2)
        for sweep, steps_rad in _difference_sweeps([run for run in recordings if run.motion.has_accurate_angles])
        if steps_rad.shape[0] and steps_rad.shape[1] > 1
    ]
    return float(np.sqrt(np.mean(squares) / VARIANCE_RATIO)) if squares else 0.0


def _difference_sweeps(recordings: Sequence[ObservedRun]) -> Iterator[tuple[Sweep, Array]]:
    """Yield each finished sweep with the sixth differences (n, k) of the k joint angles over evenly spaced states."""
    for recording in recordings:
        motion = recording.motion
        for finished in swept(recording.run):
            time_s = motion.time_s[inside(motion.time_s, finished.window)]
            steps_rad = np.diff(motion.angles(time_s), n=ORDER, axis=0)
            even = np.ptp(np.lib.stride_tricks.sliding_window_view(np.diff(time_s), ORDER), axis=1)
            yield finished.sweep, steps_rad[even < EVENNESS_S]
