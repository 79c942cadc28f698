"""A recording in pieces: parts of revolutions and of rests, each with what the arm did meanwhile.

A revolution's mean is free of the servo's vibration, its parts are not: the arm's measured rate is taken out of them,
and so is what the sensor's filter delays of it.
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
from rig.estimation.vector_fit import Explained
from rig.observation.arm_beside_lines import beside, means_of_parts, turned
from rig.observation.arm_motion import ArmMotion
from rig.observation.average import Average, Stream, between
from rig.observation.coloured_noise import widening
from rig.observation.lines import NONE, SAME, fitted, in_hertz, lines, swings, turning, waves
from rig.observation.mean import rounding_left
from rig.observation.observe import Observation
from rig.observation.observed_run import ObservedRun
from rig.observation.tapered_weights import noise_at_zero

FEWEST_SAMPLES = 20
PREVAILS = 0.7  # of the residuals' variance, what is left in a long mean where the rest of them is a vibration
FEWEST_AT_REST = 60  # of a whole rest: fewer do not tell its noise well enough to weigh it by
TWICE = 2  # in a turn, at most, what a sensor feels comes and goes, and encoders err
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


BEFORE = Cuts(parts=4, times_a_rest=2, most=48)
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
    (N, 2) from start to end on the clock of the first recording, `stretches` on that of their own.
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


@dataclass(frozen=True, slots=True)
class _Piece:
    sweep: int
    place: float
    mean_rad_s: Array
    variance_rad2_s2: Array
    rate_rad_s: Array
    gravity_m_s2: Array
    attitude: Array
    speed_std: float
    stretch: Stretch


def cut(name: str, recordings: Sequence[ObservedRun], result: SensorResult, explained: Explained, site: Site) -> Pieces:
    """The sensor's revolutions and rests of all recordings in pieces, in the order `explained` was made from."""
    x, y, z = explained.seen.earth_rate_rad_s.tolist()  # known by the site, or found
    site = replace(site, earth_rate_rad_s=(x, y, z))
    by_model = recordings[0].run.settings.checked_by_model
    parts, of_rest = (BY_MODEL if by_model else BEFORE).of(len(result.observations))
    streams = [(recording, recording.stream(name)) for recording in recordings]
    turns = [(*each, turn) for each in streams for turn in each[0].sensors[name].revolutions]
    rests = [(*each, rest) for each in streams for rest in each[0].sensors[name].rests]
    cut_up = partial(_cut, site=site, finds_lines=by_model)
    room_hz = _in_the_room([(stream, rest) for _, stream, rest in rests]) if by_model else NONE
    found = [
        *(
            cut_up(stream, recording.motion, turn.average, sweep=sweep, turn=turn, parts=parts, room_hz=room_hz)
            for sweep, (recording, stream, turn) in enumerate(turns)
        ),
        *(cut_up(stream, recording.motion, rest, parts=of_rest) for recording, stream, rest in rests),
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
    )


def _in_the_room(rests: Sequence[tuple[Stream, Average]]) -> Array:
    """(k,) Hz of what vibrates in the longest of the rests."""
    if not rests:
        return NONE
    stream, rest = max(rests, key=lambda each: each[1].duration_s)
    inside = between(stream, rest.start_s, rest.end_s)
    readings = stream.readings_rad_s[inside]
    return in_hertz(lines(readings - readings.mean(axis=0)), stream.time_s[inside])


def _lines_in(readings: Array, share: Array, known_cycles: Array, *, turns: bool) -> Array:
    """(k,) cycles of what vibrates in readings (n, 3), where a share (n,) of the time is over.

    They are told beside what comes and goes smoothly in a turn: beside means of parts they would leave steps, which
    look like slow lines of another sign each way. Two that are near each other do not average out in a part.
    """
    smooth = np.column_stack([np.ones(len(readings)), turning(2 * np.pi * share, TWICE if turns else 0)])
    return lines(readings - smooth @ fitted(smooth, readings), known_cycles=known_cycles, apart_cycles=SAME)


def _cut(
    stream: Stream,
    motion: ArmMotion,
    average: Average,
    *,
    site: Site,
    parts: int,
    finds_lines: bool,
    sweep: int = REST,
    turn: Observation | None = None,
    room_hz: Array = NONE,
) -> tuple[Window, list[_Piece]]:
    """A revolution (`turn`) or a rest in parts of equal length; one of which too little is known is left out.

    Where it `finds_lines`, what vibrates is taken out of the means of readings and rates alike, and out of the noise:
    the encoders do not see all of it. What vibrates in the room, at `room_hz`, a turning sensor feels beside these
    frequencies alone.
    """
    inside = between(stream, average.start_s, average.end_s)
    time_s = stream.time_s[inside]
    known = motion.covered(time_s) if turn is not None else np.ones(len(time_s), dtype=np.bool_)
    parts = max(1, min(parts, int(known.sum()) // FEWEST_SAMPLES))
    ends = np.linspace(average.start_s, average.end_s, parts + 1)
    part = np.where(known, np.clip(np.searchsorted(ends, time_s, side="right") - 1, 0, parts - 1), -1)
    rate = motion.rate(time_s) if turn is not None else np.zeros((len(time_s), 3))
    readings = stream.readings_rad_s[inside]
    enough = [each for each in range(parts) if np.sum(part == each) >= FEWEST_SAMPLES / 2]
    used = np.isin(part, enough)
    part, rate, readings, time_s = part[used], rate[used], readings[used], time_s[used]
    means, rates = means_of_parts(readings, part, parts), means_of_parts(rate, part, parts)
    residual, shaken = readings - means[part], np.zeros(readings.shape)
    if turn is not None:
        vibration = np.column_stack([rate @ turn.axis_flange, motion.rate(time_s, 1) @ turn.axis_flange])
        vibration -= means_of_parts(vibration, part, parts)[part]
        shaken = vibration @ np.linalg.lstsq(vibration, residual, rcond=None)[0]
        residual = residual - shaken
    left, taken, swing_rad2 = residual, 0, np.zeros(3)
    if finds_lines:
        share = np.arange(len(readings)) / len(readings)  # as they were found, some missing or none
        cycles = _lines_in(readings, share, room_hz * average.duration_s, turns=turn is not None)
        columns = waves(cycles, share)
        taken = columns.shape[1]
        means, left = beside(columns, readings, part, parts)
        if turn is None:
            swing_rad2 = swings(residual, columns, in_hertz(cycles, time_s))
            residual = left
        else:
            rates, unexplained = beside(columns, rate, part, parts)
            along = unexplained @ turn.axis_flange[:, None]
            left = left - along @ np.linalg.lstsq(along, left, rcond=None)[0]
            if known.all():
                rates = turned(motion, average.start_s, average.end_s, in_hertz(cycles, time_s), parts)
    gyroscope = stream.sensor.channel(RATE)
    count = gyroscope.unit_per_count
    scatter = np.maximum(np.sum(left**2, axis=0) / max(len(left) - len(enough) - taken, 1), count**2 / 12)
    if finds_lines and turn is not None:  # what the encoders miss of a ripple is no noise of a part's
        noise = (average.variance_rad2_s2 - average.drift_rad2_s2) * average.samples
    else:
        noise = scatter * np.array([widening(left[:, axis]) for axis in range(3)])
        if taken:
            at_zero = np.maximum(noise_at_zero(left), count**2 / 12)
            noise = np.where(at_zero < PREVAILS * scatter, at_zero, noise)
    earth = np.zeros(3) if site.earth_rate_rad_s is None else np.array(site.earth_rate_rad_s)
    pieces = []
    for each in enough:
        attitude = motion.attitude(ends[each], ends[each + 1])
        pieces.append(
            _Piece(
                sweep=sweep,
                place=2 * each / (parts - 1) - 1 if parts > 1 else 0.0,
                mean_rad_s=means[each],
                variance_rad2_s2=noise / np.sum(part == each) + rounding_left(scatter, count),
                rate_rad_s=rates[each] + attitude @ earth,
                gravity_m_s2=attitude @ site.down_m_s2,
                attitude=attitude,
                speed_std=0.0 if turn is None else turn.speed_std_rad_s / turn.speed_rad_s,
                stretch=Stretch(motion, float(ends[each]), float(ends[each + 1])),
            )
        )
    seen = gyroscope.counts(stream.raw)[inside].astype(np.int64)
    return Window(sweep, seen, residual / count, np.sqrt(np.mean(shaken**2, axis=0)) / count, swing_rad2), pieces
