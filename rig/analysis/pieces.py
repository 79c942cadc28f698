"""A recording in pieces: parts of revolutions and of rests, each with what the arm did meanwhile.

A revolution's mean is free of the servo's vibration, its parts are not: the arm's measured rate is taken out of them,
and so is what the sensor's filter delays of it.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rig.analysis.calibration import SensorResult
from rig.data.settings import Site
from rig.estimation.arrays import Array
from rig.estimation.explained import Explained
from rig.observation.average import Average, Stream, between, rounding_left
from rig.observation.colour import widening
from rig.observation.observe import Observation
from rig.observation.observed_run import ObservedRun
from rig.observation.timebase import ArmMotion

PARTS = 4  # of a revolution; a rest has half as many
MOST_PIECES = 48  # of all revolutions: beyond twelve sweeps these are cut into fewer parts
FEWEST_SAMPLES = 20
FEWEST_AT_REST = 60  # of a whole rest: fewer do not tell its noise well enough to weigh it by


@dataclass(frozen=True, slots=True)
class Window:
    """The samples of one revolution or rest.

    `sweep` is the place of the revolution among all of the sensor's, −1 for a rest; `counts` (n, 3) are the readings
    as recorded, `residual_counts` (m, 3) what of a reading neither its part's mean nor the arm's vibration explains,
    where the arm's motion is known; `vibration_counts` (3,) is the RMS of that vibration.
    """

    sweep: int
    counts: NDArray[np.int64]
    residual_counts: Array
    vibration_counts: Array


@dataclass(frozen=True, slots=True)
class Pieces:
    """N pieces of revolutions and rests, and the windows they were cut from.

    `sweep` (N,) is the place of the revolution, −1 for a rest; `place` (N,) runs from −1 in its first part to 1 in its
    last; `means_rad_s`, `variances_rad2_s2` (N, 3); `rates_rad_s` (N, 3) of the flange, `pull_m_s2` (N, 3) what is
    felt as gravity, in its frame; `speed_std` (N,) relative; `times_s` (N, 2) from start to end on the clock of the
    first recording.
    """

    sweep: Array
    place: Array
    means_rad_s: Array
    variances_rad2_s2: Array
    rates_rad_s: Array
    pull_m_s2: Array
    speed_std: Array
    times_s: Array
    windows: tuple[Window, ...]


@dataclass(frozen=True, slots=True)
class _Piece:
    sweep: int
    place: float
    mean_rad_s: Array
    variance_rad2_s2: Array
    rate_rad_s: Array
    gravity_m_s2: Array
    speed_std: float
    start_s: float
    end_s: float


def cut(name: str, recordings: Sequence[ObservedRun], result: SensorResult, explained: Explained, site: Site) -> Pieces:
    """The sensor's revolutions and rests of all recordings in pieces, in the order `explained` was made from."""
    x, y, z = explained.seen.earth_rate_rad_s.tolist()  # known by the site, or found
    site = replace(site, earth_rate_rad_s=(x, y, z))
    parts = max(1, min(PARTS, MOST_PIECES // len(result.observations)))
    streams = [(recording, recording.stream(name)) for recording in recordings]
    turns = [(*each, turn) for each in streams for turn in each[0].sensors[name].revolutions]
    rests = [(*each, rest) for each in streams for rest in each[0].sensors[name].rests]
    found = [
        *(
            _cut(stream, recording.motion, turn.average, site, parts, sweep=sweep, turn=turn)
            for sweep, (recording, stream, turn) in enumerate(turns)
        ),
        *(_cut(stream, recording.motion, rest, site, max(1, parts // 2)) for recording, stream, rest in rests),
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
        times_s += [np.array([piece.start_s, piece.end_s]) - average.start_s + began_s for piece in made]
    return Pieces(
        sweep=np.array([piece.sweep for piece in pieces]),
        place=np.array([piece.place for piece in pieces]),
        means_rad_s=np.array([piece.mean_rad_s for piece in pieces]),
        variances_rad2_s2=np.array([piece.variance_rad2_s2 for piece in pieces]),
        rates_rad_s=np.array([piece.rate_rad_s for piece in pieces]),
        pull_m_s2=np.array(pull_m_s2),
        speed_std=np.array([piece.speed_std for piece in pieces]),
        times_s=np.array(times_s),
        windows=tuple(window for window, _ in found),
    )


def _cut(
    stream: Stream,
    motion: ArmMotion,
    average: Average,
    site: Site,
    parts: int,
    *,
    sweep: int = -1,
    turn: Observation | None = None,
) -> tuple[Window, list[_Piece]]:
    """A revolution (`turn`) or a rest in parts of equal length; one of which too little is known is left out."""
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
    means, rates = _means(readings, part, parts), _means(rate, part, parts)
    residual, shaken = readings - means[part], np.zeros(readings.shape)
    if turn is not None:
        vibration = np.column_stack([rate @ turn.axis_flange, motion.rate(time_s, 1) @ turn.axis_flange])
        vibration -= _means(vibration, part, parts)[part]
        shaken = vibration @ np.linalg.lstsq(vibration, residual, rcond=None)[0]
        residual = residual - shaken
    count = stream.sensor.sensitivity_rad_s_per_count
    scatter = np.maximum(np.sum(residual**2, axis=0) / max(len(residual) - len(enough), 1), count**2 / 12)
    wider = np.array([widening(residual[:, axis]) for axis in range(3)])
    earth = np.zeros(3) if site.earth_rate_rad_s is None else np.array(site.earth_rate_rad_s)
    pieces = []
    for each in enough:
        attitude = motion.attitude(ends[each], ends[each + 1])
        pieces.append(
            _Piece(
                sweep=sweep,
                place=2 * each / (parts - 1) - 1 if parts > 1 else 0.0,
                mean_rad_s=means[each],
                variance_rad2_s2=scatter * wider / np.sum(part == each) + rounding_left(scatter, count),
                rate_rad_s=rates[each] + attitude @ earth,
                gravity_m_s2=attitude @ site.down_m_s2,
                speed_std=0.0 if turn is None else turn.speed_std_rad_s / turn.speed_rad_s,
                start_s=float(ends[each]),
                end_s=float(ends[each + 1]),
            )
        )
    seen = stream.raw["counts"][inside].astype(np.int64)
    return Window(sweep, seen, residual / count, np.sqrt(np.mean(shaken**2, axis=0)) / count), pieces


def _means(values: Array, part: NDArray[np.intp], parts: int) -> Array:
    """(parts, k) means of values (n, k) by part; zero where a part has none."""
    counts = np.maximum(np.bincount(part, minlength=parts), 1)
    sums = [np.bincount(part, values[:, column], minlength=parts) for column in range(values.shape[1])]
    means: Array = np.stack(sums, axis=1) / counts[:, None]
    return means
