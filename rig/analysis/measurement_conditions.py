"""The times and temperatures of the readings from which a calibration is estimated.

A gyroscope's scale factors come from the sweeps alone, its bias from sweeps and rests. So if the sensor warms up, scale
factors and bias refer to different temperatures.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from datetime import datetime, timedelta

import numpy as np

from rig.observation.average import Average
from rig.observation.finished_steps import dwell_times_s
from rig.observation.observed_run import ObservedRun


@dataclass(frozen=True, slots=True)
class Conditions:
    """The first, mean and last time of readings (UTC), and their mean temperature with its range.

    Temperatures are None without a thermometer; the range is None if the temperature was stated.
    """

    from_utc: datetime
    to_utc: datetime
    mean_utc: datetime
    temperature_c: float | None
    temperature_range_c: tuple[float, float] | None


@dataclass(frozen=True, slots=True)
class GyroscopeConditions:
    """The conditions to which a gyroscope's scale factors and its bias refer."""

    scale: Conditions
    bias: Conditions


@dataclass(frozen=True, slots=True)
class _WeightedReadings:
    """One average of readings: start and end on the first recording's clock, weight, temperature (NaN if unknown)."""

    start_s: float
    end_s: float
    weight: float
    temperature_c: float


def gyroscope_conditions(recordings: Sequence[ObservedRun], name: str) -> GyroscopeConditions:
    """Return the conditions of a gyroscope's readings: in sweeps for the scale, in sweeps and rests for the bias."""
    parts = [(recording.sensors[name], recording.clock_offset_s) for recording in recordings]
    turns = [_read_average(turn.average, offset_s) for part, offset_s in parts for turn in part.revolutions]
    rests = [_read_average(rest, offset_s) for part, offset_s in parts for rest in part.rests]
    return GyroscopeConditions(
        _average_conditions(recordings, name, turns), _average_conditions(recordings, name, [*turns, *rests])
    )


def accelerometer_conditions(recordings: Sequence[ObservedRun], name: str, dwells: Iterable[int]) -> Conditions:
    """Return the conditions of an accelerometer's readings in sweeps, and in the dwells with the indices `dwells`."""
    wanted = frozenset(dwells)
    read = []
    for recording in recordings:
        part, offset_s = recording.sensors[name], recording.clock_offset_s
        read.extend(_read_average(turn.average, offset_s) for turn in part.revolutions if turn.acceleration is not None)
        read.extend(
            _WeightedReadings(
                dwell.window.start_s + offset_s,
                dwell.window.end_s + offset_s,
                dwell.reading.samples,
                dwell.temperature_c,
            )
            for dwell in part.dwells
            if dwell.index in wanted
        )
    return _average_conditions(recordings, name, read)


def magnetometer_conditions(recordings: Sequence[ObservedRun], name: str, dwells: Iterable[int]) -> Conditions:
    """Return the conditions, without temperature, of a magnetometer's readings in the dwells with the indices `dwells`.

    If a dwell was repeated, only its last execution is used.
    """
    wanted = frozenset(dwells)
    times_s = {
        index: (start_s + recording.clock_offset_s, end_s + recording.clock_offset_s)
        for recording in recordings
        for index, (start_s, end_s) in dwell_times_s(recording.run).items()
        if index in wanted
    }
    read = [_WeightedReadings(start_s, end_s, end_s - start_s, float("nan")) for start_s, end_s in times_s.values()]
    return _average_conditions(recordings, name, read)


def _read_average(average: Average, offset_s: float) -> _WeightedReadings:
    return _WeightedReadings(
        average.start_s + offset_s, average.end_s + offset_s, average.samples, average.temperature_c
    )


def _average_conditions(recordings: Sequence[ObservedRun], name: str, read: Sequence[_WeightedReadings]) -> Conditions:
    """Return the conditions of weighted averages, as UTC; the first recording started at its first state."""
    began = datetime.fromisoformat(recordings[0].run.provenance.started_utc)
    first_s, weights = float(recordings[0].motion.time_s[0]), [window.weight for window in read]

    def utc(time_s: float) -> datetime:
        return began + timedelta(seconds=time_s - first_s)

    middles = [(window.start_s + window.end_s) / 2 for window in read]
    stated = recordings[0].run.sensors[name].temperature_stated
    warm = [window.temperature_c for window in read if np.isfinite(window.temperature_c)]
    return Conditions(
        utc(min(window.start_s for window in read)),
        utc(max(window.end_s for window in read)),
        utc(float(np.average(middles, weights=weights))),
        float(np.average(warm, weights=weights)) if warm else None,
        (min(warm), max(warm)) if warm and not stated else None,
    )
