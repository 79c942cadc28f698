"""When and how warm it was while what was found of a sensor was read: no value holds at another time or temperature.

A gyroscope's scale factors come from the sweeps alone, its bias from the rests between them as well: a sensor that
warms up has them at different temperatures.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta

import numpy as np

from rig.observation.average import Average
from rig.observation.finished import dwell_times_s
from rig.observation.observed_run import ObservedRun


@dataclass(frozen=True, slots=True)
class When:
    """When readings were taken, in UTC, and their `mean_utc`; their mean temperature and how it ranged.

    No temperatures where no thermometer tells them, and where the temperature was stated no range.
    """

    from_utc: datetime
    to_utc: datetime
    mean_utc: datetime
    temperature_c: float | None
    temperature_range_c: tuple[float, float] | None


@dataclass(frozen=True, slots=True)
class Held:
    """When a gyroscope's scale factors hold, and when its bias does."""

    scale: When
    bias: When


@dataclass(frozen=True, slots=True)
class _Read:
    """Readings from start to end on the clock of the first recording; how many, and how warm it was, or NaN."""

    start_s: float
    end_s: float
    weight: float
    temperature_c: float


def of_gyroscope(recordings: Sequence[ObservedRun], name: str) -> Held:
    """When a gyroscope's scale and bias were read: in its sweeps, and in sweeps and rests."""
    parts = [(recording.sensors[name], recording.clock_offset_s) for recording in recordings]
    turns = [_averaged(turn.average, since_s) for part, since_s in parts for turn in part.revolutions]
    rests = [_averaged(rest, since_s) for part, since_s in parts for rest in part.rests]
    return Held(_when(recordings, name, turns), _when(recordings, name, [*turns, *rests]))


def of_accelerometer(recordings: Sequence[ObservedRun], name: str, dwells: Iterable[int]) -> When:
    """When an accelerometer was read: in the dwells of these indices, and its sweeps."""
    wanted, read = frozenset(dwells), []
    for recording in recordings:
        part, since_s = recording.sensors[name], recording.clock_offset_s
        read += [_averaged(turn.average, since_s) for turn in part.revolutions if turn.acceleration is not None]
        read += [
            _Read(
                dwell.window.start_s + since_s,
                dwell.window.end_s + since_s,
                dwell.reading.samples,
                dwell.temperature_c,
            )
            for dwell in part.dwells
            if dwell.index in wanted
        ]
    return _when(recordings, name, read)


def of_magnetometer(recordings: Sequence[ObservedRun], name: str, dwells: Iterable[int]) -> When:
    """When a magnetometer, which has no thermometer, was read: in the last dwells of these indices."""
    wanted = frozenset(dwells)
    times_s = {
        index: (start_s + recording.clock_offset_s, end_s + recording.clock_offset_s)
        for recording in recordings
        for index, (start_s, end_s) in dwell_times_s(recording.run).items()
        if index in wanted
    }
    read = [_Read(start_s, end_s, end_s - start_s, float("nan")) for start_s, end_s in times_s.values()]
    return _when(recordings, name, read)


def _averaged(average: Average, since_s: float) -> _Read:
    return _Read(average.start_s + since_s, average.end_s + since_s, average.samples, average.temperature_c)


def _when(recordings: Sequence[ObservedRun], name: str, read: Sequence[_Read]) -> When:
    """When a sensor's readings were taken, each window by its weight; a recording began with its first state."""
    began = datetime.fromisoformat(recordings[0].run.provenance.started_utc)
    first_s, weights = float(recordings[0].motion.time_s[0]), [each.weight for each in read]

    def utc(time_s: float) -> datetime:
        return began + timedelta(seconds=time_s - first_s)

    middles = [(each.start_s + each.end_s) / 2 for each in read]
    stated = recordings[0].run.sensors[name].temperature_stated
    warm = [each.temperature_c for each in read if np.isfinite(each.temperature_c)]
    return When(
        utc(min(each.start_s for each in read)),
        utc(max(each.end_s for each in read)),
        utc(float(np.average(middles, weights=weights))),
        float(np.average(warm, weights=weights)) if warm else None,
        (min(warm), max(warm)) if warm and not stated else None,
    )
