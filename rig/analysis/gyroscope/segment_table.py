"""The table of all segments of a sensor's revolutions and rests, with the sensed rates and gravity. Pure functions."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rig.data.recording.settings import Site
from rig.estimation.arrays import Array, median
from rig.estimation.gyroscope.vector_fit import VectorFit
from rig.observation.consistency.raw_readings import REST, RawReadings
from rig.observation.consistency.segments import MIN_REST_SAMPLES, MotionInterval, SegmentedAverage
from rig.observation.consistency.transfers import WristTransfer


@dataclass(frozen=True, slots=True)
class Segments:
    """N segments of revolutions and rests: the means of their readings, and the motion in each.

    - sweep (N,): index of the revolution, −1 for a rest; transfers between these have numbers from −2 downwards.
    - position (N,): place of the segment in its revolution or rest, from −1 for the first to 1 for the last.
    - means_rad_s, variances_rad2_s2 (N, 3): mean readings and their variances.
    - rates_rad_s (N, 3): angular rate of the flange in inertial space, in its frame.
    - gravity_m_s2 (N, 3): gravity minus the acceleration of the sensor, in that frame.
    - attitudes (N, 3, 3): from the base into that frame.
    - speed_std (N,): relative standard deviation of the mean speed.
    - times_s (N, 2): start and end on the clock of the first recording.
    - intervals: the same times on the clock of the segment's own recording, with the arm's motion.
    - readings: the single readings of each revolution and rest.
    - roundings_rad_s (N, 3): standard uncertainty of each mean due to rounding.
    - unexplained_rad2_s2 (N, 3): part of the variances that neither arm nor noise explains.
    """

    sweep: NDArray[np.intp]
    position: Array
    means_rad_s: Array
    variances_rad2_s2: Array
    rates_rad_s: Array
    gravity_m_s2: Array
    attitudes: Array
    speed_std: Array
    times_s: Array
    intervals: tuple[MotionInterval, ...]
    readings: tuple[RawReadings, ...]
    roundings_rad_s: Array | float = 0.0
    unexplained_rad2_s2: Array | float = 0.0


def stack_segments(windows: Sequence[SegmentedAverage], explained: VectorFit, site: Site) -> Segments:
    """Return the segments of all `windows`, a gyroscope's revolutions and rests in the order of the fit `explained`.

    The Earth's rate is the one in `explained`, which was either estimated or taken from the site.
    """
    inputs = explained.inputs
    placed = list(zip(windows, inputs.windows_s[:, 0], inputs.acceleration_m_s2, strict=True))
    # began_s: the window's start by the clock of the first recording; sensed: the acceleration of the sensor in it.
    segments = [segment for window in windows for segment in window.segments]
    rates = [segment.rate_rad_s + segment.attitude @ inputs.earth_rate_rad_s for segment in segments]
    return Segments(
        sweep=np.array([window.readings.sweep for window in windows for _ in window.segments]),
        position=np.array([segment.position for segment in segments]),
        means_rad_s=np.array([segment.mean.mean for segment in segments]),
        variances_rad2_s2=np.array([segment.mean.variance for segment in segments]),
        rates_rad_s=np.array(rates),
        gravity_m_s2=np.array(
            [segment.attitude @ site.down_m_s2 - sensed for window, _, sensed in placed for segment in window.segments]
        ),
        attitudes=np.array([segment.attitude for segment in segments]),
        speed_std=np.array([window.speed_std for window in windows for _ in window.segments]),
        times_s=np.array(
            [
                np.array([segment.interval.start_s, segment.interval.end_s]) - window.average.start_s + began_s
                for window, began_s, _ in placed
                for segment in window.segments
            ]
        ),
        intervals=tuple(segment.interval for segment in segments),
        readings=tuple(window.readings for window in windows),
        roundings_rad_s=np.sqrt(np.array([segment.mean.rounding for segment in segments])),
    )


def append_transfers(
    segments: Segments,
    transfers: Sequence[WristTransfer],
    windows: Sequence[SegmentedAverage],
    explained: VectorFit,
) -> Segments:
    """Return the segments with the transfers appended, numbered downwards from `REST` − 1.

    A transfer's variance is the larger of its own and that of other segments over the same duration, plus the effect of
    vibration, which is estimated from the rests before and after. `windows` are the sweeps and rests of `segments`.
    """
    if not transfers:
        return segments
    of_noise = segments.variances_rad2_s2 - np.square(segments.roundings_rad_s)
    density = median(of_noise * np.diff(segments.times_s), axis=0)  # variance of a mean times its duration
    intervals = tuple(transfer.interval for transfer in transfers)
    own_times_s = np.array([[interval.start_s, interval.end_s] for interval in intervals])
    times_s = own_times_s + np.array([[transfer.clock_offset_s] for transfer in transfers])
    duration_s, count = np.diff(times_s), len(transfers)
    noise = density / duration_s
    unexplained = np.maximum([transfer.scatter_rad2_s2 for transfer in transfers] - noise, 0.0)
    roundings = np.array([transfer.rounding_rad2_s2 for transfer in transfers])
    vibration = _vibration_changes(windows, explained, times_s) / duration_s**2
    earth_rad_s = explained.inputs.earth_rate_rad_s
    rates = [transfer.rate_rad_s + transfer.attitude @ earth_rad_s for transfer in transfers]
    return replace(
        segments,
        sweep=np.concatenate([segments.sweep, REST - 1 - np.arange(count)]),
        position=np.concatenate([segments.position, np.zeros(count)]),
        means_rad_s=np.concatenate([segments.means_rad_s, [transfer.mean_rad_s for transfer in transfers]]),
        variances_rad2_s2=np.concatenate([segments.variances_rad2_s2, noise + unexplained + vibration + roundings]),
        unexplained_rad2_s2=np.concatenate([np.zeros(segments.means_rad_s.shape), unexplained]),
        roundings_rad_s=np.concatenate(
            [np.broadcast_to(segments.roundings_rad_s, segments.means_rad_s.shape), np.sqrt(roundings)]
        ),
        rates_rad_s=np.concatenate([segments.rates_rad_s, rates]),
        gravity_m_s2=np.concatenate([segments.gravity_m_s2, [transfer.gravity_m_s2 for transfer in transfers]]),
        attitudes=np.concatenate([segments.attitudes, [transfer.attitude for transfer in transfers]]),
        speed_std=np.concatenate([segments.speed_std, np.zeros(count)]),
        times_s=np.concatenate([segments.times_s, times_s]),
        intervals=(*segments.intervals, *intervals),
    )


def _vibration_changes(windows: Sequence[SegmentedAverage], explained: VectorFit, times_s: Array) -> Array:
    """Return the variances (M, 3), rad², of the angle that vibration adds to the rotation in each of M transfers.

    They are means of the variances in the rests nearest to the transfer's start and to its end, which are `times_s`
    (M, 2) on the clock of the first recording. `windows` are in the order of the fit `explained`.
    """
    rests = [
        (time_s, window.readings.vibration_rad2)
        for window, time_s in zip(windows, explained.inputs.windows_s.mean(axis=1), strict=True)
        if window.readings.sweep == REST and window.average.samples >= MIN_REST_SAMPLES  # fewer show no vibration
    ]
    if not rests:
        return np.zeros((len(times_s), 3))
    rests_s, swings_rad2 = (np.array(column) for column in zip(*rests, strict=True))
    nearest = np.abs(times_s[:, :, None] - rests_s).argmin(axis=2)
    nearby: Array = swings_rad2[nearest].mean(axis=1)
    return nearby
