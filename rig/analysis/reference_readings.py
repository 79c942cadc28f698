"""What accelerometers and magnetometers read in dwells and sweeps, and in which of them something knocked. Pure.

Of each the readings as recorded, of which `rig.analysis.readings` judges bits and noise; and of each dwell its halves,
which noise alone may tell apart.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig.analysis.cut_recording import Window as Read
from rig.analysis.suspicion import Statistic
from rig.data.quantity import ACCELERATION
from rig.estimation.arrays import Array
from rig.estimation.mean_weights import even_groups, mean_weights
from rig.estimation.rounding import Steps
from rig.observation.acceleration import DwellReading
from rig.observation.average import Stream, between
from rig.observation.beside_lines import BRIEF, noise_of
from rig.observation.field import dwelt_field
from rig.observation.lines import LineSearch, find_lines, fitted, waves
from rig.observation.mean import mean_at_rest
from rig.observation.observed_run import ObservedRun
from rig.observation.windows import Window

FEWEST_IN_HALF = 20  # readings: fewer do not tell how their mean scatters
SLOW_LINES = LineSearch(stands_out=30.0, slowest=2.5, beats=0)
TAPERED = 8.0  # cycles in a dwell: of faster lines nothing is left in the tapered mean of a half


@dataclass(frozen=True, slots=True)
class Dwelt:
    """The readings of one dwell: counts (n, 3) at times (n,) of the controller's, within the `window`.

    The arm stood at `q_rad` (6,); `since_s` takes those times to the clock of the first recording.
    """

    index: int
    counts: NDArray[np.int64]
    time_s: Array
    window: Window
    q_rad: Array
    since_s: float

    @property
    def middle_s(self) -> float:
        """Middle of the window by the controller's time, s."""
        return (self.window.start_s + self.window.end_s) / 2


def acceleration_dwells(name: str, recording: ObservedRun, since_s: float = 0.0) -> list[Dwelt]:
    """What a sensor's accelerometer read in each of its dwells."""
    stream = recording.stream(name)
    found = []
    for dwell in recording.sensors[name].dwells:
        inside = between(stream, dwell.window.start_s, dwell.window.end_s)
        found.append(_dwelt(dwell, _counts(stream, inside), stream.time_s[inside], recording, since_s))
    return found


def acceleration_sweeps(name: str, recording: ObservedRun) -> list[Read]:
    """What a sensor's accelerometer read in its revolutions, each with its place among the recording's."""
    stream, found = recording.stream(name), []
    for place, turn in enumerate(recording.sensors[name].revolutions):
        if turn.acceleration is not None:
            count = stream.sensor.channel(ACCELERATION).unit_per_count
            inside, wave = between(stream, turn.average.start_s, turn.average.end_s), turn.acceleration.harmonic
            counts = _counts(stream, inside)
            found.append(Read(place, counts, wave.residuals_m_s2 / count, wave.vibration_m_s2 / count))
    return found


def field_dwells(name: str, recording: ObservedRun, since_s: float = 0.0) -> list[Dwelt]:
    """What a magnetometer read in each of its dwells."""
    return [
        _dwelt(dwell, counts.astype(np.int64), time_s, recording, since_s)
        for dwell, counts, time_s in dwelt_field(recording, name)
    ]


def _dwelt(
    dwell: DwellReading, counts: NDArray[np.int64], time_s: Array, recording: ObservedRun, since_s: float
) -> Dwelt:
    window = dwell.window
    q_rad = recording.motion.angles((window.start_s + window.end_s) / 2)
    return Dwelt(dwell.index, counts, time_s, window, q_rad, since_s)


def resting(dwells: Sequence[Dwelt]) -> list[Read]:
    """The dwells as rests: what of a reading its dwell's mean does not explain."""
    return [Read(-1, dwell.counts, dwell.counts - dwell.counts.mean(axis=0), np.zeros(3)) for dwell in dwells]


def knocked(dwells: Sequence[Dwelt], flicker_counts: float, rate: float, steps: Steps) -> Mapping[str, Statistic]:
    """How much the halves of a dwell differ where they differ most, as χ² of three axes; nothing of short dwells.

    The limit is that of F: how readings scatter is found from those of the dwell. A bias that flickers by an Allan
    deviation of `flicker_counts` makes the halves differ by √2 times as much. The counts come in these steps.
    """
    from scipy.special import fdtri

    told = [dwell for dwell in dwells if len(dwell.counts) >= 2 * FEWEST_IN_HALF]
    if not told:
        return {}
    freedom = min(len(dwell.counts) for dwell in told) - 2
    limit = 3 * float(fdtri(3, freedom, 1 - rate / len(told)))
    return {"knocked_dwell": (max(_apart(each, flicker_counts, steps) for each in told), limit)}


def _apart(dwell: Dwelt, flicker_counts: float, steps: Steps) -> float:
    halves = Window(dwell.window.start_s, dwell.middle_s), Window(dwell.middle_s, dwell.window.end_s)
    early, means = dwell.time_s < dwell.middle_s, []
    share = (dwell.time_s - dwell.window.start_s) / (dwell.window.end_s - dwell.window.start_s)
    readings = dwell.counts.astype(np.float64)
    cycles = find_lines(readings - readings.mean(axis=0), SLOW_LINES, share=share)
    if (cycles < TAPERED).any():
        return _apart_beside(waves(cycles, share, SLOW_LINES.beats), readings, early, flicker_counts, steps)
    for half, inside in zip(halves, (early, ~early), strict=True):
        means.append(mean_at_rest(readings[inside], dwell.time_s[inside], half, steps)[0])
    first, last = means
    return float(np.sum((last.mean - first.mean) ** 2 / (first.variance + last.variance + 2 * flicker_counts**2)))


def _apart_beside(
    lines: Array, readings: Array, early: NDArray[np.bool_], flicker_counts: float, steps: Steps
) -> float:
    """Return what `_apart` does of readings (n, 3) in which slow `lines` (n, k) swing."""
    halves = even_groups(np.where(early, 0, 1), 2)
    first, last = mean_weights(halves, lines)
    columns = np.column_stack([halves, lines])
    noise = noise_of(readings - columns @ fitted(columns, readings), columns.shape[1], steps, BRIEF)
    variance = noise.in_a_mean * float(np.sum((last - first) ** 2))
    return float(np.sum(((last - first) @ readings) ** 2 / (variance + 2 * flicker_counts**2)))


def _counts(stream: Stream, inside: slice) -> NDArray[np.int64]:
    counts: NDArray[np.int64] = stream.sensor.channel(ACCELERATION).counts(stream.raw)[inside].astype(np.int64)
    return counts
