"""What a gyroscope read in the rests in which the arm stood still."""

from collections.abc import Collection, Iterator, Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from rig.data.recording.run_file import RunData
from rig.estimation.arrays import Array
from rig.observation.average import Average, Stream, averaged, between
from rig.observation.motion.arm_motion import ArmMotion
from rig.observation.statistics.beside_lines import mean_of_standing
from rig.observation.swing import MAX_TRAVEL_AT_REST_RAD
from rig.observation.windows import Window, rested

REST_SETTLING_S = 0.2  # kept away from either end of a rest
MIN_SAMPLES_AT_REST = 20
MIN_RESTS = 3  # to tell whether the bias drifts


def rests_of(
    run: RunData, stream: Stream, motion: ArmMotion, response: Array, superseded: Collection[int] = ()
) -> tuple[Average, ...]:
    """Average the rests in which the arm stood still for long enough, but those beside a step in `superseded`.

    An arm that swings where it stands does so in what its encoders tell and in what the sensor reads, by `response`
    (3, 3) of that: the means are those of an arm that does not.
    """
    rests = (_rest(stream, motion, window, response) for window in rested(run, superseded))
    return tuple(rest for rest in rests if rest is not None)


def standing(motion: ArmMotion, rest: Window) -> Window | None:
    """Return a rest without its beginning and its end; None if the arm moved in it or too few states tell."""
    still = Window(rest.start_s + REST_SETTLING_S, rest.end_s - REST_SETTLING_S)
    moved_rad = motion.moved_rad(still)
    return still if moved_rad is not None and moved_rad <= MAX_TRAVEL_AT_REST_RAD else None


def still_samples(run: RunData, stream: Stream, motion: ArmMotion) -> Iterator[slice]:
    """Return the samples of every rest and dwell in which the arm stood still, apart where one is missing."""
    for window in rested(run):
        still = standing(motion, window)
        if still is None:
            continue
        inside = between(stream, still.start_s, still.end_s)
        sequence = stream.raw["sequence"][inside].astype(np.int64)
        gaps = inside.start + 1 + np.flatnonzero(np.diff(sequence) != 1)
        edges = [inside.start, *gaps.tolist(), inside.stop]
        yield from (slice(start, end) for start, end in pairwise(edges))


def place(average: Average, motion: ArmMotion) -> Average:
    """Return the average with the attitude the arm had meanwhile."""
    return replace(average, attitude=motion.attitude(average.start_s, average.end_s))


def bias_drift(rests: Sequence[Average]) -> Array:
    """Return the variance (3,) of the bias from rest to rest, (rad/s)², beyond what the noise of a rest explains.

    Zero unless that is significant over all axes (χ² at 0.999), so that a steady sensor is left alone.
    """
    from scipy.special import chdtri

    if len(rests) < MIN_RESTS:
        return np.zeros(3)
    means = np.array([rest.mean_rad_s for rest in rests])
    noise = np.array([rest.variance_rad2_s2 for rest in rests]).mean(axis=0)
    scatter = means.var(axis=0, ddof=1)
    freedom = len(rests) - 1
    significant = freedom * float(np.sum(scatter / noise)) > chdtri(3 * freedom, 0.001)
    return np.maximum(scatter - noise, 0.0) if significant else np.zeros(3)


def _rest(stream: Stream, motion: ArmMotion, window: Window, response: Array) -> Average | None:
    """Average a rest; None if the arm did not stand still or the rest is too short to say anything."""
    still = standing(motion, window)
    if still is None:
        return None
    inside = between(stream, still.start_s, still.end_s)
    if inside.stop - inside.start < MIN_SAMPLES_AT_REST:
        return None
    time_s = stream.time_s[inside]
    readings = stream.readings_rad_s[inside] - motion.swing_rates(time_s) @ response.T
    found, lasting = mean_of_standing(readings, time_s, still, stream.steps)
    return place(averaged(stream, inside, lasting, found), motion)
