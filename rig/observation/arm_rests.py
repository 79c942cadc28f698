"""Averages of a gyroscope's readings over the arm's rests."""

from collections.abc import Collection, Iterator, Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from rig.data.recording.run_data import RunData
from rig.estimation.arrays import Array
from rig.observation.average import Average, Stream, build_average, slice_time
from rig.observation.motion.arm_motion import ArmMotion
from rig.observation.oscillation import MAX_TRAVEL_AT_REST_RAD
from rig.observation.statistics.vibration_noise import average_standstill
from rig.observation.windows import Window, iterate_rests

REST_SETTLING_S = 0.2  # time removed at either end of a rest
MIN_SAMPLES_AT_REST = 20
MIN_RESTS = 3  # fewest rests that show a drift of the bias


def average_rests(
    run: RunData, stream: Stream, motion: ArmMotion, response: Array, superseded: Collection[int] = ()
) -> tuple[Average, ...]:
    """Return the averages of the arm's sufficiently long rests, except those next to a superseded sweep or dwell.

    `superseded` are the indices of the sweeps and dwells that a later recording repeats. A resting arm still
    oscillates. This effect is subtracted from the readings: `response` (3, 3) converts the flange's rates to readings.
    """
    rests = (_average_rest(stream, motion, window, response) for window in iterate_rests(run, superseded))
    return tuple(rest for rest in rests if rest is not None)


def trim_rest(motion: ArmMotion, rest: Window) -> Window | None:
    """Return a rest without its beginning and end; None if the arm moved in it, or if it has fewer than two states."""
    still = Window(rest.start_s + REST_SETTLING_S, rest.end_s - REST_SETTLING_S)
    moved_rad = motion.travel_rad(still)
    return still if moved_rad is not None and moved_rad <= MAX_TRAVEL_AT_REST_RAD else None


def still_samples(run: RunData, stream: Stream, motion: ArmMotion) -> Iterator[slice]:
    """Yield slices of the samples in the arm's rests and dwells; missing samples divide a rest into several slices."""
    for window in iterate_rests(run):
        still = trim_rest(motion, window)
        if still is None:
            continue
        inside = slice_time(stream, still.start_s, still.end_s)
        sequence = stream.raw["sequence"][inside].astype(np.int64)
        gaps = inside.start + 1 + np.flatnonzero(np.diff(sequence) != 1)
        edges = [inside.start, *gaps.tolist(), inside.stop]
        yield from (slice(start, end) for start, end in pairwise(edges))


def add_attitude(average: Average, motion: ArmMotion) -> Average:
    """Return the average with the arm's mean attitude in the same window."""
    return replace(average, attitude=motion.attitude(average.start_s, average.end_s))


def estimate_bias_drift(rests: Sequence[Average]) -> Array:
    """Return the variance (3,), (rad/s)², of the bias from rest to rest: the means' scatter minus their noise.

    The result is zero unless χ² of the scatter over all axes exceeds its 99.9 % quantile, so that noise does not count
    as drift.
    """
    from scipy.special import chdtri

    if len(rests) < MIN_RESTS:
        return np.zeros(3)
    means = np.array([rest.mean_rad_s for rest in rests])
    noise = np.array([rest.variance_rad2_s2 for rest in rests]).mean(axis=0)
    scatter = means.var(axis=0, ddof=1)
    dof = len(rests) - 1
    significant = dof * float(np.sum(scatter / noise)) > chdtri(3 * dof, 0.001)
    return np.maximum(scatter - noise, 0.0) if significant else np.zeros(3)


def _average_rest(stream: Stream, motion: ArmMotion, window: Window, response: Array) -> Average | None:
    """Return the average of a rest; None if the arm moved in it or if it holds too few samples.

    `response` (3, 3) maps the flange's rates to readings, and serves to remove the arm's oscillation.
    """
    still = trim_rest(motion, window)
    if still is None:
        return None
    inside = slice_time(stream, still.start_s, still.end_s)
    if inside.stop - inside.start < MIN_SAMPLES_AT_REST:
        return None
    time_s = stream.time_s[inside]
    readings = stream.readings_rad_s[inside] - motion.rates_at_samples(time_s) @ response.T
    mean, averaged_window = average_standstill(readings, time_s, still, stream.steps)
    return add_attitude(build_average(stream, inside, averaged_window, mean), motion)
