"""Revolutions and rests in segments of equal length, each averaged like the whole.

The spectral lines removed from a revolution's mean are removed from its segments' means, and the same weights average
readings and the arm's rate.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rig.data.quantity import RATE
from rig.estimation.arrays import Array
from rig.estimation.statistics.mean_weights import even_groups, mean_weights
from rig.estimation.statistics.rounding import Steps
from rig.observation.average import Average, Stream, slice_time
from rig.observation.consistency.raw_readings import REST, RawReadings, counts_of
from rig.observation.motion.arm_motion import ArmMotion
from rig.observation.observe import Observation, fit_response
from rig.observation.observed_run import ObservedRun
from rig.observation.statistics.coloured_noise import correlation_inflation
from rig.observation.statistics.mean import Mean, MeanNoise, compute_weighted_means
from rig.observation.statistics.spectral_lines import (
    LineSearch,
    find_angle_change_rad2,
    find_lines,
    fit_columns,
    fit_residuals,
    waves,
)
from rig.observation.statistics.tapered_weights import noise_at_zero
from rig.observation.turn_mean import slow_columns

# Not four segments: one of an encoder's waves with two periods per revolution is zero at the ends of quarters, and no
# segment would show it.
REVOLUTION_SEGMENTS, REST_SEGMENTS, MAX_SEGMENTS = 6, 3, 72
MIN_SAMPLES = 20  # of a segment
MIN_SCATTER_SEGMENTS = 3  # number of segments up to which they do not show a scatter around a straight line
MIN_REST_SAMPLES = 60  # fewer do not determine a rest's noise well enough for a weight
MAX_NOISE_RATIO = 0.7  # of noise at zero frequency to scatter, below which the rest of the scatter is a vibration
REST_SEARCH = LineSearch(stands_out=30.0, sidebands=0)  # noise alone exceeds this in one bin of 10⁹


def segment_counts(revolutions: int) -> tuple[int, int]:
    """Return the numbers of segments in a revolution and in a rest, for a sensor with so many `revolutions` in all."""
    segments = max(1, min(REVOLUTION_SEGMENTS, MAX_SEGMENTS // max(revolutions, 1)))
    return segments, max(1, segments // REST_SEGMENTS)


@dataclass(frozen=True, slots=True)
class MotionInterval:
    """An interval of the arm's `motion`, from `start_s` to `end_s` on the clock of the arm's states.

    `unseen_rad`: standard deviation of the angle that the samples miss at either end of the interval.
    """

    motion: ArmMotion
    start_s: float
    end_s: float
    unseen_rad: float = 0.0


@dataclass(frozen=True, slots=True)
class Segment:
    """A part of a revolution or rest, averaged.

    - position: from −1 in the first segment to 1 in the last.
    - mean: the mean of the readings, rad/s.
    - rate_rad_s (3,): the flange's mean rate relative to the base, in the flange's frame, weighted like `mean`.
    - attitude (3, 3): mean rotation from the base into the flange's frame.
    """

    position: float
    mean: Mean
    rate_rad_s: Array
    attitude: Array
    interval: MotionInterval


@dataclass(frozen=True, slots=True)
class SegmentedAverage:
    """A revolution or rest: its average as a whole, its segments, its raw readings.

    `speed_std`: relative standard deviation of the mean speed, zero for a rest.
    """

    average: Average
    segments: tuple[Segment, ...]
    readings: RawReadings
    speed_std: float = 0.0


def segment_recordings(name: str, recordings: Sequence[ObservedRun]) -> tuple[SegmentedAverage, ...]:
    """Return all revolutions of a gyroscope in segments, then all its rests, in the order of the recordings.

    A rest with too few samples to show its noise has no segments.
    """
    streams = [(recording, recording.stream(name)) for recording in recordings]
    turns = [(*streamed, turn) for streamed in streams for turn in streamed[0].sensors[name].revolutions]
    rests = [(*streamed, rest) for streamed in streams for rest in streamed[0].sensors[name].rests]
    of_turn, of_rest = segment_counts(len(turns))
    return (
        *(
            _segment_revolution(stream, recording.motion, turn, of_turn, sweep)
            for sweep, (recording, stream, turn) in enumerate(turns)
        ),
        *(
            _segment_rest(
                stream, recording.motion, rest, of_rest, fit_response(stream, recording.sensors[name].revolutions)
            )
            for recording, stream, rest in rests
        ),
    )


@dataclass(frozen=True, slots=True)
class _Division:
    """Samples of a window that lie in segments.

    - inside: all n samples of the window; used (n,): mask of those in a segment with enough samples.
    - enough: the indices of these segments among all p segments; ends_s (p + 1,): the segments' ends.
    - time_s (m,), readings_rad_s (m, 3): the used samples; groups (m, p): above zero if a sample lies in a segment.
    """

    inside: slice
    used: NDArray[np.bool_]
    time_s: Array
    readings_rad_s: Array
    groups: Array
    ends_s: Array
    enough: tuple[int, ...]
    steps: Steps

    def subtract_averages(self, values: Array) -> Array:
        """Return values (m, k) minus the plain means of their segments."""
        return self.subtract_means(values, mean_weights(self.groups, self.groups[:, :0]))

    def subtract_means(self, values: Array, weights: Array) -> Array:
        """Return values (m, k) minus the means of their segments; `weights` (p, m) compute the means of p segments."""
        residuals: Array = values - self.groups @ (weights @ values)
        return residuals


def _divide(stream: Stream, average: Average, usable: NDArray[np.bool_], count: int) -> _Division:
    """Return the `usable` samples (n,) of an average, divided into `count` segments, or fewer if samples are few."""
    inside = slice_time(stream, average.start_s, average.end_s)
    time_s = stream.time_s[inside]
    count = max(1, min(count, int(usable.sum()) // MIN_SAMPLES))
    ends_s = np.linspace(average.start_s, average.end_s, count + 1)
    index = np.where(usable, np.clip(np.searchsorted(ends_s, time_s, side="right") - 1, 0, count - 1), -1)
    enough = tuple(segment for segment in range(count) if np.sum(index == segment) >= MIN_SAMPLES / 2)
    used = np.isin(index, enough)
    readings = stream.readings_rad_s[inside][used]
    groups = even_groups(index[used], count)
    return _Division(inside, used, time_s[used], readings, groups, ends_s, enough, stream.steps)


def _segment_revolution(
    stream: Stream, motion: ArmMotion, turn: Observation, count: int, sweep: int
) -> SegmentedAverage:
    """Return a revolution or an arc with the averages of its segments, from which spectral lines are removed.

    Spectral lines slower than `SLOW_CYCLES` remain, because weights that cancel them would amplify the encoders' noise.
    The variance of each segment includes these slow lines, unless one step of the readings explains them. The noise is
    that of the whole average, in which a vibration does not count as noise, even if the encoders measure it only in
    part.
    """
    average, axis = turn.average, turn.axis_flange
    times_s = stream.time_s[slice_time(stream, average.start_s, average.end_s)]
    division = _divide(stream, average, motion.covered(times_s), count)
    rates = motion.rates_at_samples(times_s)[division.used]
    fraction = (division.time_s - average.start_s) / average.duration_s
    lines = waves(average.lines_hz * average.duration_s, fraction, turn.sidebands)
    vibration = np.column_stack([rates @ axis, motion.rate(division.time_s, 1) @ axis])  # and the effect of a lag
    encoded = np.column_stack([np.ones(len(rates)), vibration])
    residual, vibration = np.hsplit(division.subtract_averages(np.hstack([division.readings_rad_s, vibration])), [3])
    vibrating = vibration @ np.linalg.lstsq(vibration, residual, rcond=None)[0]
    noise_alone = residual - vibrating  # without the vibration that the encoders measure
    noise = MeanNoise(average.noise_rad_s**2, average.noise_rad2_s2 * average.samples, average.dof)
    is_slow = slow_columns(average.lines_hz * average.duration_s, turn.sidebands)
    weights = mean_weights(division.groups, lines[:, ~is_slow])
    added: Array | float = 0.0
    if is_slow.any():
        added = _slow_line_variance(lines[:, is_slow], weights, fit_residuals(encoded, division.readings_rad_s))
    segments = _average(
        division,
        motion,
        weights=weights,
        added=added,
        residuals=noise_alone - lines @ fit_columns(lines, noise_alone),
        rates=rates,
        noise=noise,
    )
    lsb = stream.sensor.channel(RATE).unit_per_count
    readings = RawReadings(
        sweep=sweep,
        counts=counts_of(stream, RATE, division.inside),
        residual_counts=noise_alone / lsb,
        vibration_counts=np.sqrt(np.mean(vibrating**2, axis=0)) / lsb,
    )
    return SegmentedAverage(average, segments, readings, turn.speed_std_rad_s / turn.speed_rad_s)


def _slow_line_variance(slow: Array, weights: Array, residuals: Array) -> Array:
    """Return the variance (3,) that slow spectral lines, columns (n, k) fitted to residuals (n, 3), add to means.

    The means have weights (p, n). The frequencies of slow lines are uncertain, so the variance is at least the means'
    scatter around a linear drift in time. The drift is excluded, because it would be a fault, not a vibration. A step
    would be a fault too, but its harmonics look like lines. So if one step explains more than the lines, the variance
    is zero.
    """
    vibration = slow @ fit_columns(slow, residuals)
    if _explain_by_step(residuals) > np.sum(vibration**2):
        return np.zeros(3)
    fitted = np.mean((weights @ vibration) ** 2, axis=0)
    if len(weights) <= MIN_SCATTER_SEGMENTS:
        return np.asarray(fitted, dtype=np.float64)
    means, straight = weights @ residuals, np.vander(np.linspace(-1, 1, len(weights)), 2)
    around = fit_residuals(straight, means)
    variance: Array = np.maximum(fitted, np.sum(around**2, axis=0) / (len(weights) - 2))
    return variance


def _explain_by_step(residuals: Array) -> float:
    """Return by how much one step, at the best place, reduces the sum of squares of residuals (n, 3)."""
    before = np.arange(1, len(residuals))[:, None]
    sums = np.cumsum(residuals - residuals.mean(axis=0), axis=0)[:-1]
    return float(np.sum(sums**2 * (1 / before + 1 / (len(residuals) - before)), axis=1).max())


def _segment_rest(stream: Stream, motion: ArmMotion, average: Average, count: int, response: Array) -> SegmentedAverage:
    """Return a rest with the averages of its `count` segments, without vibrations and the arm's oscillation.

    The oscillation is computed from the flange's rates by the sensor's `response` (3, 3) to them.
    """
    inside = slice_time(stream, average.start_s, average.end_s)
    division = _divide(stream, average, np.ones(inside.stop - inside.start, dtype=np.bool_), count)
    readings = division.readings_rad_s - motion.rates_at_samples(division.time_s) @ response.T
    division = replace(division, readings_rad_s=readings)
    fraction = (division.time_s - average.start_s) / average.duration_s
    cycles = find_lines(readings - readings.mean(axis=0), REST_SEARCH, fraction=fraction)
    lines = waves(cycles, fraction, REST_SEARCH.sidebands)
    weights = mean_weights(division.groups, lines)
    residuals = division.subtract_means(readings, weights)
    residuals = residuals - lines @ fit_columns(lines, residuals)
    segments = _average(
        division,
        motion,
        weights=weights,
        residuals=residuals,
        rates=np.zeros((len(readings), 3)),
        noise=_noise_at_rest(residuals, len(division.enough), lines.shape[1], division.steps),
    )
    lsb = stream.sensor.channel(RATE).unit_per_count
    vibrating = division.subtract_averages(readings)
    raw = RawReadings(
        sweep=REST,
        counts=counts_of(stream, RATE, division.inside),
        residual_counts=residuals / lsb,
        vibration_counts=np.zeros(3),
        vibration_rad2=find_angle_change_rad2(vibrating, lines, cycles / average.duration_s),
    )
    return SegmentedAverage(average, segments if average.samples >= MIN_REST_SAMPLES else (), raw)


def _noise_at_rest(residuals: Array, segments: int, columns: int, steps: Steps) -> MeanNoise:
    """Return the noise of readings, from the residuals (n, 3) of a fit of segment means and spectral lines.

    `segments` and `columns` are the numbers of fitted means and of fitted columns of spectral lines. If there are
    lines, a part of a vibration may remain in the scatter; if so, the noise of a long mean is taken from the spectrum
    at zero frequency instead.
    """
    dof = max(len(residuals) - segments - columns, 1)
    scatter = np.maximum(np.sum(residuals**2, axis=0) / dof, steps.variance)
    in_a_mean = scatter * np.array([correlation_inflation(axis) for axis in residuals.T])
    if columns:
        at_zero = np.maximum(noise_at_zero(residuals), steps.variance)
        in_a_mean = np.where(at_zero < MAX_NOISE_RATIO * scatter, at_zero, in_a_mean)
    return MeanNoise(scatter, in_a_mean, float(dof))


def _average(
    division: _Division,
    motion: ArmMotion,
    *,
    weights: Array,
    residuals: Array,
    rates: Array,
    noise: MeanNoise,
    added: Array | float = 0.0,
) -> tuple[Segment, ...]:
    """Return the segments with enough samples; weights (p, m) average the readings and the flange's rates (m, 3).

    `added` (3,): the variance of each mean due to slow spectral lines.
    """
    readings = division.readings_rad_s
    groups, rows = division.groups[:, division.enough], weights[list(division.enough)]
    smooth = readings - residuals
    means = compute_weighted_means(readings, groups, rows, smooth=smooth, noise=noise, steps=division.steps)
    last, segments = len(weights) - 1, list[Segment]()
    starts_s, ends_s = division.ends_s[list(division.enough)], division.ends_s[1:][list(division.enough)]
    averaged = zip(
        division.enough,
        means,
        rows @ rates,
        motion.mean_attitudes(starts_s, ends_s),
        starts_s.tolist(),
        ends_s.tolist(),
        strict=True,
    )
    for index, mean, rate_rad_s, attitude, start_s, end_s in averaged:
        segments.append(
            Segment(
                position=2 * index / last - 1 if last else 0.0,
                mean=replace(mean, variance=mean.variance + added),
                rate_rad_s=rate_rad_s,
                attitude=attitude,
                interval=MotionInterval(motion, start_s, end_s),
            )
        )
    return tuple(segments)
