"""A recording in pieces: parts of revolutions and of rests, each with what the arm did meanwhile.

The lines that were taken out of a revolution's mean are taken out of its parts, and the weights that make the means of
their readings make those of the arm's rate.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from rig.analysis.calibration import SensorResult
from rig.data.quantity import RATE
from rig.data.settings import Site
from rig.estimation.arrays import Array
from rig.estimation.mean_weights import even_groups, mean_weights
from rig.estimation.rounding import Steps, rounding_left
from rig.estimation.vector_fit import Explained
from rig.observation.arm_motion import ArmMotion
from rig.observation.average import Average, Stream, between
from rig.observation.coloured_noise import widening
from rig.observation.lines import LineSearch, find_lines, fitted, swings, waves
from rig.observation.observe import Observation
from rig.observation.observed_run import ObservedRun
from rig.observation.tapered_weights import noise_at_zero

FEWEST_SAMPLES = 20
PREVAILS = 0.7  # of the residuals' variance, what is left in a long mean where the rest of them is a vibration
FEWEST_AT_REST = 60  # of a whole rest: fewer do not tell its noise well enough to weigh it by
AT_REST = LineSearch(stands_out=30.0, beats=0)  # of noise one bin in 10⁹ does
REST = -1  # in the place of a sweep; ways between sweeps and rests count down from there


@dataclass(frozen=True, slots=True)
class Cuts:
    """Parts of a revolution, and how many times fewer a rest has.

    There are `most` of all revolutions: where these are many, each is cut into fewer.
    """

    parts: int
    times_a_rest: int
    most: int

    def of(self, revolutions: int) -> tuple[int, int]:
        """How many parts each of so many revolutions has, and each rest beside them."""
        parts = max(1, min(self.parts, self.most // max(revolutions, 1)))
        return parts, max(1, parts // self.times_a_rest)


# Not four: at the ends of quarters one of an encoder's waves that come twice a turn is zero, and no part shows it.
BY_MODEL = Cuts(parts=6, times_a_rest=3, most=72)


@dataclass(frozen=True, slots=True)
class Window:
    """The samples of one revolution or rest.

    `sweep` is the place of the revolution among all of the sensor's, −1 for a rest; `counts` (n, 3) are the readings
    as recorded, `residual_counts` (m, 3) what of a reading neither its part's mean nor the arm's vibration explains,
    nor in a rest what vibrates beside it, where the arm's motion is known; `vibration_counts` (3,) is the RMS of the
    arm's vibration. `swing_rad2` (3,): by how much the angle of what vibrates in a rest differs between two moments, in
    the mean square.
    """

    sweep: int
    counts: NDArray[np.int64]
    residual_counts: Array
    vibration_counts: Array
    swing_rad2: Array = field(default_factory=partial(np.zeros, 3))


@dataclass(frozen=True, slots=True)
class Stretch:
    """A stretch of time in which the arm made a motion, on the clock of its states.

    `unseen_rad` is what samples may miss of where a motion begins or ends.
    """

    motion: ArmMotion
    start_s: float
    end_s: float
    unseen_rad: float = 0.0


@dataclass(frozen=True, slots=True)
class Pieces:
    """N pieces of revolutions and rests, and the windows they were cut from.

    `sweep` (N,) is the place of the revolution, −1 for a rest; `place` (N,) runs from −1 in its first part to 1 in its
    last; `means_rad_s`, `variances_rad2_s2` (N, 3); `rates_rad_s` (N, 3) of the flange, `pull_m_s2` (N, 3) what is
    felt as gravity, in its frame, `attitudes` (N, 3, 3) from the base into it; `speed_std` (N,) relative; `times_s`
    (N, 2) from start to end on the clock of the first recording, `stretches` on that of their own. `roundings_rad_s`
    (N, 3) is the standard uncertainty that rounding leaves in each mean.
    """

    sweep: NDArray[np.intp]
    place: Array
    means_rad_s: Array
    variances_rad2_s2: Array
    rates_rad_s: Array
    pull_m_s2: Array
    attitudes: Array
    speed_std: Array
    times_s: Array
    stretches: tuple[Stretch, ...]
    windows: tuple[Window, ...]
    roundings_rad_s: Array | float = 0.0


@dataclass(frozen=True, slots=True)
class _Piece:
    sweep: int
    place: float
    mean_rad_s: Array
    variance_rad2_s2: Array
    rounding_rad2_s2: Array
    rate_rad_s: Array
    gravity_m_s2: Array
    attitude: Array
    speed_std: float
    stretch: Stretch


def cut(name: str, recordings: Sequence[ObservedRun], result: SensorResult, explained: Explained, site: Site) -> Pieces:
    """The sensor's revolutions and rests of all recordings in pieces, in the order `explained` was made from."""
    x, y, z = explained.seen.earth_rate_rad_s.tolist()  # known by the site, or found
    site = replace(site, earth_rate_rad_s=(x, y, z))
    parts, of_rest = BY_MODEL.of(len(result.observations))
    streams = [(recording, recording.stream(name)) for recording in recordings]
    turns = [(*each, turn) for each in streams for turn in each[0].sensors[name].revolutions]
    rests = [(*each, rest) for each in streams for rest in each[0].sensors[name].rests]
    found = [
        *(
            _cut_turn(stream, recording.motion, turn, site=site, parts=parts, sweep=sweep)
            for sweep, (recording, stream, turn) in enumerate(turns)
        ),
        *(_cut_rest(stream, recording.motion, rest, site=site, parts=of_rest) for recording, stream, rest in rests),
    ]
    averages = [*(turn.average for *_, turn in turns), *(rest for *_, rest in rests)]
    seen, pieces, pull_m_s2, times_s = explained.seen, list[_Piece](), list[Array](), list[Array]()
    for (_, made), average, began_s, acceleration_m_s2 in zip(
        found, averages, seen.windows_s[:, 0], seen.acceleration_m_s2, strict=True
    ):
        if made and made[0].sweep < 0 and average.samples < FEWEST_AT_REST:
            continue
        pieces += made
        pull_m_s2 += [piece.gravity_m_s2 - acceleration_m_s2 for piece in made]
        times_s += [
            np.array([piece.stretch.start_s, piece.stretch.end_s]) - average.start_s + began_s for piece in made
        ]
    return Pieces(
        sweep=np.array([piece.sweep for piece in pieces]),
        place=np.array([piece.place for piece in pieces]),
        means_rad_s=np.array([piece.mean_rad_s for piece in pieces]),
        variances_rad2_s2=np.array([piece.variance_rad2_s2 for piece in pieces]),
        rates_rad_s=np.array([piece.rate_rad_s for piece in pieces]),
        pull_m_s2=np.array(pull_m_s2),
        attitudes=np.array([piece.attitude for piece in pieces]),
        speed_std=np.array([piece.speed_std for piece in pieces]),
        times_s=np.array(times_s),
        stretches=tuple(piece.stretch for piece in pieces),
        windows=tuple(window for window, _ in found),
        roundings_rad_s=np.sqrt([piece.rounding_rad2_s2 for piece in pieces]),
    )


@dataclass(frozen=True, slots=True)
class _Parted:
    """Samples at times (n,) in parts of equal length, which are `groups` (n, p), from `ends_s` (p,) to the next.

    `inside` are all samples of the window, of which those are `used` (m,) that lie in a part with `enough` of them.
    """

    inside: slice
    used: NDArray[np.bool_]
    time_s: Array
    groups: Array
    ends_s: Array
    enough: tuple[int, ...]

    @property
    def averages(self) -> Array:
        """(p, n) the weights of even means of the parts."""
        return mean_weights(self.groups, self.groups[:, :0])


def _parted(stream: Stream, average: Average, known: NDArray[np.bool_], parts: int) -> _Parted:
    """The samples of an average, those of them that are `known` (m,), in so many parts, or in fewer of few samples."""
    inside = between(stream, average.start_s, average.end_s)
    time_s = stream.time_s[inside]
    parts = max(1, min(parts, int(known.sum()) // FEWEST_SAMPLES))
    ends_s = np.linspace(average.start_s, average.end_s, parts + 1)
    part = np.where(known, np.clip(np.searchsorted(ends_s, time_s, side="right") - 1, 0, parts - 1), -1)
    enough = tuple(each for each in range(parts) if np.sum(part == each) >= FEWEST_SAMPLES / 2)
    used = np.isin(part, enough)
    return _Parted(inside, used, time_s[used], even_groups(part[used], parts), ends_s, enough)


def _cut_turn(
    stream: Stream, motion: ArmMotion, turn: Observation, *, site: Site, parts: int, sweep: int
) -> tuple[Window, list[_Piece]]:
    """A revolution or an arc in parts, beside the lines that were found when it was averaged.

    The encoders do not see all that vibrates, and what they miss of a ripple is no noise of a part's.
    """
    average, axis = turn.average, turn.axis_flange
    times_s = stream.time_s[between(stream, average.start_s, average.end_s)]
    parted = _parted(stream, average, motion.covered(times_s), parts)
    readings = stream.readings_rad_s[parted.inside][parted.used]
    rate = motion.sampled_rates(times_s)[parted.used]
    share = (parted.time_s - average.start_s) / average.duration_s
    lines = waves(average.lines_hz * average.duration_s, share, turn.beats)
    weights = mean_weights(parted.groups, lines)
    vibration = np.column_stack([rate @ axis, motion.rate(parted.time_s, 1) @ axis])
    residual, vibration = (each - parted.groups @ (parted.averages @ each) for each in (readings, vibration))
    shaken = vibration @ np.linalg.lstsq(vibration, residual, rcond=None)[0]
    left = residual - shaken
    left_beside_lines = left - lines @ fitted(lines, left)
    means = _Means(
        weights,
        readings,
        smooth_rad_s=readings - left_beside_lines,
        rates_rad_s=weights @ rate,
        noise_rad2_s2=average.noise_rad2_s2 * average.samples,
        scatter_rad2_s2=average.noise_rad_s**2,
    )
    window = _window(stream, parted.inside, sweep, residual=left, vibration=np.sqrt(np.mean(shaken**2, axis=0)))
    speed_std = turn.speed_std_rad_s / turn.speed_rad_s
    return window, _pieces(parted, means, motion, site, stream.steps, sweep=sweep, speed_std=speed_std)


def _cut_rest(
    stream: Stream, motion: ArmMotion, average: Average, *, site: Site, parts: int
) -> tuple[Window, list[_Piece]]:
    """A rest in parts. What vibrates is taken out of their means and their noise."""
    inside = between(stream, average.start_s, average.end_s)
    parted = _parted(stream, average, np.ones(inside.stop - inside.start, dtype=np.bool_), parts)
    readings = stream.readings_rad_s[parted.inside][parted.used]
    share = (parted.time_s - average.start_s) / average.duration_s
    cycles = find_lines(readings - readings.mean(axis=0), AT_REST, share=share)
    lines = waves(cycles, share, AT_REST.beats)
    weights = mean_weights(parted.groups, lines)
    residual = readings - parted.groups @ (parted.averages @ readings)
    beside = readings - parted.groups @ (weights @ readings)
    left = beside - lines @ fitted(lines, beside)
    free = max(len(left) - len(parted.enough) - lines.shape[1], 1)
    scatter = np.maximum(np.sum(left**2, axis=0) / free, stream.steps.variance)
    noise = scatter * np.array([widening(axis) for axis in left.T])
    if len(cycles):
        at_zero = np.maximum(noise_at_zero(left), stream.steps.variance)
        noise = np.where(at_zero < PREVAILS * scatter, at_zero, noise)
    means = _Means(
        weights,
        readings,
        smooth_rad_s=readings - left,
        rates_rad_s=np.zeros((len(weights), 3)),
        noise_rad2_s2=noise,
        scatter_rad2_s2=scatter,
    )
    swing_rad2 = swings(residual, lines, cycles / average.duration_s)
    window = _window(stream, parted.inside, REST, residual=left, vibration=np.zeros(3), swing_rad2=swing_rad2)
    return window, _pieces(parted, means, motion, site, stream.steps, sweep=REST, speed_std=0.0)


@dataclass(frozen=True, slots=True)
class _Means:
    """The means of readings (n, 3) in p parts by `weights` (p, n), and the flange's rates (p, 3) by the same.

    `smooth_rad_s` (n, 3) is what of the readings is no noise. One reading has the variance `noise_rad2_s2` (3,) as it
    counts in a mean, and `scatter_rad2_s2` (3,) in all.
    """

    weights: Array
    readings_rad_s: Array
    smooth_rad_s: Array
    rates_rad_s: Array
    noise_rad2_s2: Array
    scatter_rad2_s2: Array


def _pieces(
    parted: _Parted, means: _Means, motion: ArmMotion, site: Site, steps: Steps, *, sweep: int, speed_std: float
) -> list[_Piece]:
    earth = np.zeros(3) if site.earth_rate_rad_s is None else np.array(site.earth_rate_rad_s)
    read = means.weights @ means.readings_rad_s
    last, pieces = len(means.weights) - 1, []
    for each in parted.enough:
        start_s, end_s = parted.ends_s[each], parted.ends_s[each + 1]
        attitude = motion.attitude(start_s, end_s)
        own, inside = means.weights[each], parted.groups[:, each] > 0
        rounding = rounding_left(means.readings_rad_s[inside], steps, means.smooth_rad_s[inside], means.scatter_rad2_s2)
        pieces.append(
            _Piece(
                sweep=sweep,
                place=2 * each / last - 1 if last else 0.0,
                mean_rad_s=read[each],
                variance_rad2_s2=means.noise_rad2_s2 * float(own @ own) + rounding,
                rounding_rad2_s2=rounding,
                rate_rad_s=means.rates_rad_s[each] + attitude @ earth,
                gravity_m_s2=attitude @ site.down_m_s2,
                attitude=attitude,
                speed_std=speed_std,
                stretch=Stretch(motion, float(start_s), float(end_s)),
            )
        )
    return pieces


def _window(
    stream: Stream,
    inside: slice,
    sweep: int,
    *,
    residual: Array,
    vibration: Array,
    swing_rad2: Array | None = None,
) -> Window:
    """The window of samples inside; `residual` (m, 3) and the RMS of `vibration` (3,) in rad/s."""
    gyroscope = stream.sensor.channel(RATE)
    counts, count = gyroscope.counts(stream.raw)[inside].astype(np.int64), gyroscope.unit_per_count
    swing = np.zeros(3) if swing_rad2 is None else swing_rad2
    return Window(sweep, counts, residual / count, vibration / count, swing)
