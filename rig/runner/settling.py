"""When the sensors have settled after a motion: their readings scatter hardly more than they did before anything moved.

The arm's controller says that it stands still while what it carries still swings, so the sensors are asked.
"""

import threading
from collections import deque
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rig.data.quantity import ACCELERATION, RATE
from rig.data.recording.recorded_sensor import RecordedSensor
from rig.estimation.arrays import Array

SPAN_S = 0.5  # of readings that are looked at, all of them after the motion
SPANS_AT_REST = (
    6  # what the arm vibrates with where it stands comes and goes: the largest of these is what rest is like
)
QUIET = 1.2  # times the scatter at rest; the scatter of a hundred samples on three axes is known to 4 %
STEADY, NOT_FALLING = 2.0, 0.85  # an arm vibrates differently in each attitude: what stays as it is no swing either
LEAST_COUNTS = 0.5  # of scatter: rounding is no swing


@dataclass(slots=True)
class _Watched:
    """The latest readings of one sensor, (3,) counts each."""

    name: str
    column: str
    enough: int
    recent: deque[Array]
    at_rest_counts: list[float] = field(default_factory=list)

    def scatter_counts(self, before: int = 0) -> float | None:
        """RMS over the axes of the standard deviation of the newest readings, or of those so many spans `before`.

        None while there are too few.
        """
        if len(self.recent) < (before + 1) * self.enough:
            return None
        end = len(self.recent) - before * self.enough
        span = np.array(self.recent)[end - self.enough : end]
        return float(np.sqrt(np.var(span, axis=0).mean()))

    def over_rest(self) -> float | None:
        """The newest scatter over that at rest, None with too few readings."""
        scatter = self.scatter_counts()
        if scatter is None or not self.at_rest_counts:
            return None
        return scatter / max(*self.at_rest_counts, LEAST_COUNTS)

    @property
    def settled(self) -> bool:
        """Whether it scatters as at rest, or not much more and without becoming quieter."""
        ratio, scatter, earlier = self.over_rest(), self.scatter_counts(), self.scatter_counts(before=1)
        if ratio is None or scatter is None:
            return False
        steady = earlier is not None and scatter >= NOT_FALLING * earlier
        return ratio <= QUIET or (ratio <= STEADY and steady)


@dataclass(slots=True)
class Settling:
    """What tells whether sensors have settled: fed by the sources' reader threads, asked by the script's."""

    _watched: dict[str, _Watched] = field(default_factory=dict)
    _lock: threading.Lock = field(default_factory=threading.Lock)

    def expect(self, name: str, sensor: RecordedSensor) -> None:
        """Watch a sensor: its accelerations where it sends them, else its rates."""
        enough = max(2, round(SPAN_S * sensor.rate_hz))
        of = sensor.channel(ACCELERATION if sensor.measures(ACCELERATION) else RATE).column
        self._watched[name] = _Watched(name, of, enough, deque(maxlen=2 * enough))

    def add(self, sensor: str, samples: NDArray[Any]) -> None:
        """Take the newest readings (n,) of a sensor that is watched."""
        watched = self._watched.get(sensor)
        if watched is not None:
            with self._lock:
                watched.recent.extend(samples[watched.column].astype(np.float64))

    def begin(self) -> None:
        """The arm stands from now on: what was read before does not count."""
        with self._lock:
            for watched in self._watched.values():
                watched.recent.clear()

    def learned(self) -> bool:
        """Take what is read now for how it is at rest; False while there is too little of it."""
        with self._lock:
            for watched in self._watched.values():
                scatter = watched.scatter_counts()
                if scatter is not None:
                    watched.at_rest_counts.append(scatter)
                    watched.recent.clear()
            return all(len(watched.at_rest_counts) >= SPANS_AT_REST for watched in self._watched.values())

    def unsettled(self) -> dict[str, float | None]:
        """The sensors that have not settled: name → scatter over that at rest, None with too few readings."""
        with self._lock:
            return {each.name: each.over_rest() for each in self._watched.values() if not each.settled}
