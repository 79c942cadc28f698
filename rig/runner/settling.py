"""The test whether the sensors have settled after a motion: their readings scatter hardly more than in the first rest.

The arm's controller reports standstill while the carried parts still oscillate, so the sensors decide.
"""

import threading
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rig.data.quantity import ACCELERATION, RATE
from rig.data.recording.recorded_sensor import RecordedSensor
from rig.estimation.arrays import Array

SPAN_S = 0.5  # time span of the readings in one scatter, all after the motion
SPANS_AT_REST = 6  # spans at rest: the vibration of an arm varies, so the largest scatter of these counts
MAX_QUIET_RATIO = 1.2  # to the scatter at rest, whose standard uncertainty is 4 % for a hundred samples on three axes
# Largest ratio of a constant scatter to that at rest, and the least ratio of a scatter to an earlier one that counts as
# constant. A constant scatter is no decaying oscillation; a larger one has to be constant for longer. An arm vibrates
# differently in each attitude, and a vibration near a multiple of half the data rate comes and goes in the samples.
MAX_STEADY_RATIO, MIN_STEADY_DECREASE = 2.0, 0.85  # of the newest span to the one before
MAX_LONG_STEADY_RATIO, MIN_LONG_STEADY_DECREASE = 5.0, 0.9  # of the newest `LONG_SPANS` to as many before
LONG_SPANS = 3
MIN_SCATTER_COUNTS = 0.5  # a smaller scatter is rounding


@dataclass(slots=True)
class _RecentReadings:
    """The latest readings of one sensor, (3,) counts each."""

    name: str
    column: str
    enough: int
    recent: deque[Array]
    at_rest_counts: list[float] = field(default_factory=list)

    def find_scatters_counts(self, most: int) -> list[float]:
        """Return the scatter of each of the newest spans of readings, the newest span first, at most `most` of them.

        The scatter is the standard deviation, RMS over the axes. There are fewer if there are not enough readings.
        """
        count = min(most, len(self.recent) // self.enough)
        if not count:
            return []
        newest = np.array(self.recent)[-count * self.enough :].reshape(count, self.enough, -1)
        scatters: list[float] = np.sqrt(np.var(newest, axis=1).mean(axis=1))[::-1].tolist()
        return scatters

    def over_rest(self) -> list[float]:
        """Return the newest scatters divided by the scatter at rest, the newest first; empty with too few readings."""
        if not self.at_rest_counts:
            return []
        at_rest_counts = max(*self.at_rest_counts, MIN_SCATTER_COUNTS)
        return [scatter / at_rest_counts for scatter in self.find_scatters_counts(2 * LONG_SPANS)]


def _has_settled(ratios: Sequence[float]) -> bool:
    """Return whether readings scatter as little as at rest, or somewhat more without a decrease from span to span.

    `ratios` are those of `_RecentReadings.over_rest`.
    """
    if not ratios:
        return False
    return (
        ratios[0] <= MAX_QUIET_RATIO
        or (ratios[0] <= MAX_STEADY_RATIO and _is_steady(ratios, 1, MIN_STEADY_DECREASE))
        or (ratios[0] <= MAX_LONG_STEADY_RATIO and _is_steady(ratios, LONG_SPANS, MIN_LONG_STEADY_DECREASE))
    )


def _is_steady(ratios: Sequence[float], spans: int, least: float) -> bool:
    """Return whether the scatter no longer decreases: the newest ratios add up to nearly as much as those before them.

    `spans` is the number of ratios in either sum; `least` is the smallest ratio of the sums that counts as steady.
    """
    newest, before = ratios[:spans], ratios[spans : 2 * spans]
    return len(before) == spans and sum(newest) >= least * sum(before)


@dataclass(slots=True)
class Settling:
    """The settling of all sensors, fed by the threads of the sources and read by the script's thread."""

    _watched: dict[str, _RecentReadings] = field(default_factory=dict)
    _lock: threading.Lock = field(default_factory=threading.Lock)

    def expect(self, name: str, sensor: RecordedSensor) -> None:
        """Watch a sensor: its accelerations if it sends them, otherwise its rates."""
        enough = max(2, round(SPAN_S * sensor.rate_hz))
        column = sensor.channel(ACCELERATION if sensor.measures(ACCELERATION) else RATE).column
        self._watched[name] = _RecentReadings(name, column, enough, deque(maxlen=2 * LONG_SPANS * enough))

    def add(self, sensor: str, samples: NDArray[Any]) -> None:
        """Add the newest readings (n,) of a watched sensor."""
        watched = self._watched.get(sensor)
        if watched is not None:
            with self._lock:
                watched.recent.extend(samples[watched.column].astype(np.float64))

    def begin(self) -> None:
        """Drop the readings so far; the arm is at rest from now on."""
        with self._lock:
            for watched in self._watched.values():
                watched.recent.clear()

    def learn_rest(self) -> bool:
        """Add the present scatter to the scatters at rest; return whether each sensor has enough scatters at rest."""
        with self._lock:
            for watched in self._watched.values():
                if scatters := watched.find_scatters_counts(1):
                    watched.at_rest_counts += scatters
                    watched.recent.clear()
            return all(len(watched.at_rest_counts) >= SPANS_AT_REST for watched in self._watched.values())

    def find_unsettled(self) -> dict[str, float | None]:
        """Return, by name, each unsettled sensor's scatter divided by that at rest; None if it has too few readings."""
        with self._lock:
            over_rest = {watched.name: watched.over_rest() for watched in self._watched.values()}
        return {name: next(iter(ratios), None) for name, ratios in over_rest.items() if not _has_settled(ratios)}
