"""Transfers of the arm between sweeps and rests: rotations about other axes than the sweeps before and after.

All sweeps about one axis follow each other, so they do not show a change of that axis's scale factor before or after
them; transfers do. In a transfer two wrists turn by half a revolution, from rest to rest, and the encoders give the
arm's mean rate as in a sweep. Each transfer is averaged as a whole.

No spectral lines are sought in a transfer, because it is short, and the frequency of the servo's vibration rises and
falls. A vibration at the data rate aliases to zero, which causes an error of the mean that the scatter does not show
(`rig.analysis.consistency.gyroscope_checks`).
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from rig.data.quantity import RATE
from rig.data.recording.run_data import RunData
from rig.data.recording.settings import Site
from rig.estimation.arrays import Array, median_step
from rig.estimation.statistics.rounding import bound_rounding_variance
from rig.motion.geometry import flange_attitude, flange_pose
from rig.observation.average import Stream, slice_time
from rig.observation.consistency.segments import MotionInterval
from rig.observation.motion.arm_motion import ArmMotion
from rig.observation.motion.reference_motion import MIN_RATE_RAD_S
from rig.observation.observed_run import ObservedRun
from rig.observation.statistics.spectral_lines import unit_columns
from rig.observation.statistics.tapered_weights import noise_at_zero
from rig.observation.windows import iterate_rests, swept

MARGIN_S = 0.1  # before and after the motion: an arm at this speed may still be moving
MIN_TRANSFER_S, MAX_TRANSFER_S = 0.5, 30.0
MAX_STEP_S = 0.0105  # of samples that show the servo's vibration while it accelerates
# The sum of samples equals a transfer except at the corners of its rate: each adds its change of slope times dt² B₂(x)
# / 2, at the fraction x of an interval (Euler and Maclaurin). B₂, the second Bernoulli polynomial, has the RMS
# √(1/180); either end has two corners.
CORNER_RMS = (2 / 180) ** 0.5 / 2
SMOOTHING_S = 0.05  # against encoder noise: 24 µrad make 4 mrad/s from angles 8 ms apart
MAX_LOST_FRACTION = 0.01  # of samples, by the nominal rate, which boards keep to about 1 %
MIN_GAP_INTERVALS = 1.5  # a longer step between samples misses a sample
TIME_STEPS = 48
FILTER_SAMPLES = range(-2, 3)  # which a sensor's filter combines into one reading
WRISTS = 3  # the last joints, whose transfers count
STILL_RAD = 1e-3  # largest apparent rotation of a joint that does not move
LOW_FRACTION = 0.0  # of the data rate: as few low frequencies as possible, because a servo's vibration is near


@dataclass(frozen=True, slots=True)
class WristTransfer:
    """A transfer in which only the wrists turned, averaged; times are on the clock of its recording.

    - clock_offset_s: converts the transfer's times to the clock of the first recording.
    - mean_rad_s (3,): mean of the readings; rounding_rad2_s2 (3,): variance of the mean due to rounding.
    - scatter_rad2_s2 (3,): variance of the mean due to noise, from residuals after a fit of the arm's rate and gravity.
    - rate_rad_s (3,): the flange's mean rate relative to the base, in the flange's frame.
    - gravity_m_s2 (3,): gravity minus the acceleration at the sensors' position, in the same frame.
    - attitude (3, 3): rotation from the base into the flange's frame.
    """

    clock_offset_s: float
    mean_rad_s: Array
    scatter_rad2_s2: Array
    rounding_rad2_s2: Array
    rate_rad_s: Array
    gravity_m_s2: Array
    attitude: Array
    interval: MotionInterval


def average_transfers(
    name: str, recordings: Sequence[ObservedRun], matrix: Array, site: Site, extension_m: Array
) -> list[WristTransfer]:
    """Return the averages of a gyroscope's readings in all transfers without a missing or saturated sample.

    The gyroscope is mounted at `extension_m` (3,) in the flange's frame; `matrix` (3, 3) converts rates to readings.
    """
    transfers = list[WristTransfer]()
    for recording in recordings:
        stream = recording.stream(name)
        for interval in _find_transfers(recording.run, stream, recording.motion):
            inside = slice_time(stream, interval.start_s, interval.end_s)
            readings, time_s = stream.readings_rad_s[inside], stream.time_s[inside]
            moving = interval.motion.rate(time_s) @ matrix.T
            transfers.append(
                WristTransfer(
                    clock_offset_s=recording.clock_offset_s,
                    mean_rad_s=readings.mean(axis=0),
                    scatter_rad2_s2=_scatter(readings, time_s, interval.motion, site.down_m_s2),
                    rounding_rad2_s2=bound_rounding_variance(readings, stream.steps, moving, stream.steps.variance),
                    rate_rad_s=interval.motion.mean_rate(interval.start_s, interval.end_s),
                    gravity_m_s2=mean_specific_force_m_s2(interval, site.down_m_s2, extension_m),
                    attitude=interval.motion.attitude(interval.start_s, interval.end_s),
                    interval=interval,
                )
            )
    return transfers


def find_transfer(motion: ArmMotion, start_s: float, end_s: float) -> MotionInterval | None:
    """Return the interval from before the arm moves until the arm has stopped; None for a window without motion."""
    inside = (motion.time_s >= start_s) & (motion.time_s <= end_s)
    rates, smoothed = _rate_norms(motion, motion.time_s[inside])
    moving = motion.time_s[inside][(rates > MIN_RATE_RAD_S) & (smoothed > MIN_RATE_RAD_S / 2)]
    if not len(moving):
        return None
    return MotionInterval(motion, max(start_s, float(moving[0]) - MARGIN_S), min(end_s, float(moving[-1]) + MARGIN_S))


def _rate_norms(motion: ArmMotion, time_s: Array) -> tuple[Array, Array]:
    """Return two norms (n,), rad/s, at times (n,): of the flange's rate, and of its mean over `SMOOTHING_S`."""
    half_s = SMOOTHING_S / 2
    within_s = np.clip(time_s, motion.time_s[0] + half_s, motion.time_s[-1] - half_s)
    rates, smoothed = motion.rate(time_s), motion.mean_rates(within_s, SMOOTHING_S)
    return np.linalg.norm(rates, axis=1), np.linalg.norm(smoothed, axis=1)


def is_by_wrists(interval: MotionInterval) -> bool:
    """Return whether a transfer is of suitable duration and moves the wrists only."""
    before = max(interval.motion.kinematics.joints - WRISTS, 0)  # of any chain the last three joints are its wrists
    others = interval.motion.angles(np.linspace(interval.start_s, interval.end_s, TIME_STEPS))[:, :before]
    rotated_rad = np.ptp(others, axis=0).max(initial=0.0)
    return bool(MIN_TRANSFER_S < interval.end_s - interval.start_s < MAX_TRANSFER_S and rotated_rad < STILL_RAD)


def mean_specific_force_m_s2(interval: MotionInterval, down_m_s2: Array, extension_m: Array) -> Array:
    """Return the mean (3,) of gravity minus the acceleration at the sensors' position, in the flange's frame."""
    time_s, step_s = np.linspace(interval.start_s, interval.end_s, TIME_STEPS, retstep=True)
    pose = flange_pose(interval.motion.angles(time_s), interval.motion.kinematics)
    position_m = pose[:, :3, 3] + pose[:, :3, :3] @ extension_m
    acceleration = np.diff(position_m, n=2, axis=0) / step_s**2
    sensed = np.einsum("nji,nj->ni", pose[1:-1, :3, :3], down_m_s2 - acceleration)
    return np.asarray(interval.motion.mount @ sensed.mean(axis=0), dtype=np.float64)


def _scatter(readings: Array, time_s: Array, motion: ArmMotion, down_m_s2: Array) -> Array:
    """Return the variance (3,) of the mean of readings (n, 3), after removal of the arm's rate and gravity.

    `down_m_s2` (3,) is gravity in the frame of the base. The arm's rates at adjacent samples are also removed, because
    a sensor's filter combines them. A ripple above half the data rate counts as noise.
    """
    step_s = median_step(time_s)
    rates = [motion.rates_at_samples(time_s + shift * step_s) for shift in FILTER_SAMPLES]
    gravity = flange_attitude(motion.angles(time_s), motion.kinematics) @ down_m_s2
    columns = unit_columns(np.column_stack([np.ones(len(time_s)), *rates, gravity]))
    residuals = readings - columns @ np.linalg.lstsq(columns, readings, rcond=None)[0]
    variance: Array = noise_at_zero(residuals, LOW_FRACTION) / len(readings)
    return variance


def _find_transfers(run: RunData, stream: Stream, motion: ArmMotion) -> Iterator[MotionInterval]:
    """Yield the interval of each transfer without a missing sample, from before the arm moves until it has stopped.

    A transfer is a part of a turn, so a shaft whose encoder is exact only over whole turns has no usable transfers.
    """
    if not motion.has_accurate_angles:
        return
    windows = sorted([*(sweep.window for sweep in swept(run)), *iterate_rests(run)], key=lambda window: window.start_s)
    for before, after in pairwise(windows):
        yield from _whole_transfer(before.end_s, after.start_s, stream, motion)
    if windows:
        yield from _whole_transfer(float(motion.time_s[0]), windows[0].start_s, stream, motion)
        yield from _whole_transfer(windows[-1].end_s, float(motion.time_s[-1]), stream, motion)


def _whole_transfer(start_s: float, end_s: float, stream: Stream, motion: ArmMotion) -> Iterator[MotionInterval]:
    """Yield the wrists' transfer between two times, cut to whole samples; nothing if samples or states are missing."""
    transfer = find_transfer(motion, start_s, end_s)
    if transfer is None:
        return
    # A sample stands for an interval around it. Beyond the states, the angles at its ends would be extrapolated.
    half_s = 0.5 / stream.sensor.rate_hz
    covered_s = motion.time_s[0] + half_s, motion.time_s[-1] - half_s
    samples = slice_time(stream, max(transfer.start_s, covered_s[0]), min(transfer.end_s, covered_s[1]))
    time_s = stream.time_s[samples]
    if len(time_s) < 2 or np.diff(time_s).mean() > MAX_STEP_S:
        return
    step_s = float(time_s[-1] - time_s[0]) / (len(time_s) - 1)
    turning = motion.time_s[(motion.time_s >= transfer.start_s) & (motion.time_s <= transfer.end_s)]
    unseen_rad = float(np.linalg.norm(motion.rate(turning, 1), axis=1).max() * CORNER_RMS * step_s**2)
    transfer = MotionInterval(motion, float(time_s[0]) - step_s / 2, float(time_s[-1]) + step_s / 2, unseen_rad)
    complete = len(time_s) >= (1 - MAX_LOST_FRACTION) * (transfer.end_s - transfer.start_s) * stream.sensor.rate_hz
    complete &= bool(np.diff(time_s).max() < MIN_GAP_INTERVALS * step_s)
    ends = np.minimum(*_rate_norms(motion, np.array([transfer.start_s, transfer.end_s])))
    in_range = not stream.sensor.channel(RATE).is_saturated(stream.raw[samples]).any()
    stands = ends.max() < 3 * MIN_RATE_RAD_S
    if is_by_wrists(transfer) and complete and in_range and stands and motion.covered(time_s).all():
        yield transfer
