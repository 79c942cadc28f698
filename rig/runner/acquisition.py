"""Passes what arrives on to the recording and counts it, for who looks on and to see that samples flow."""

import threading
from collections import defaultdict, deque
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from queue import SimpleQueue
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rig.data.quantity import RATE, Scalar
from rig.data.recording.recorded_sensor import RecordedSensor
from rig.data.recording.run_file import RunRecorder
from rig.motion.state import State
from rig.runner.settling import Settling
from rig.station.events import SensorSamples

KEPT_PARTS = 3
REACHES_BACK_S = 300.0  # before a sweep, of what its clock is found by: more tells no more, and takes longer
WHOLE_S = 5.0  # of a dwell, in which every state of the arm is recorded
STANDING_S = 0.25  # between those recorded after: an arm that stands needs no more, and hours of it would fill the disk


@dataclass(slots=True)
class SensorCount:
    """What one sensor has delivered so far. `lost` counts the gaps in its sequence numbers.

    `latest` are the mean readings of the newest samples, by quantity, and `read_s` is when these were read, by the
    clock that stamps them.
    """

    name: str
    sensor: RecordedSensor
    samples: int = 0
    lost: int = 0
    latest: Mapping[str, tuple[float, ...]] = field(default_factory=dict)
    read_s: float = 0.0
    _next_sequence: int = 0

    def add(self, samples: NDArray[Any]) -> None:
        """Count samples (n,); their means become the `latest` readings."""
        sequence = samples["sequence"]
        last = int(sequence[-1])
        self.lost += last + 1 - self._next_sequence - len(sequence)
        self._next_sequence = last + 1
        self.samples += len(sequence)
        self.latest = self.sensor.means(samples)
        self.read_s = 1e-6 * float(samples["board_time_us"].mean())

    @property
    def seen(self) -> SensorSamples:
        """What the page and the terminal are told of the sensor's samples."""
        return SensorSamples(self.name, self.samples, self.lost, self.latest)


@dataclass(frozen=True, slots=True)
class _Part:
    """What came between two calls of `keep`."""

    batches: defaultdict[str, list[np.ndarray]]
    states: list[State]


@dataclass(slots=True)
class _Thinning:
    """Which states of a dwell are recorded, by their times."""

    began_s: float | None = None
    last_s: float = 0.0

    def keeps(self, time_s: float) -> bool:
        """Asked of each state once, in their order."""
        if self.began_s is None:
            self.began_s = time_s
        if time_s - self.began_s > WHOLE_S and time_s - self.last_s < STANDING_S:
            return False
        self.last_s = time_s
        return True


@dataclass(slots=True)
class Acquisition:
    """What comes from the sources' and the arm's reader threads, read by the script's. `counts` by the sensor's name.

    What comes before there is a `recorder` is not kept. From the first `keep` on, all that came since the last
    `KEPT_PARTS` of them is also held in memory.
    """

    counts: dict[str, SensorCount] = field(default_factory=dict)
    recorder: RunRecorder | None = None
    settling: Settling = field(default_factory=Settling)
    _kept: deque[_Part] = field(default_factory=lambda: deque(maxlen=KEPT_PARTS))
    _lock: threading.Lock = field(default_factory=threading.Lock)
    _thinning: "_Thinning | None" = None
    _heard: "SimpleQueue[tuple[str, NDArray[Any]]] | None" = None

    def expect(self, name: str, sensor: RecordedSensor) -> None:
        """Count the samples of a sensor, before its stream begins; only rates tell whether the arm settled."""
        self.counts[name] = SensorCount(name, sensor)
        if sensor.measures(RATE):
            self.settling.expect(name, sensor)

    def on_samples(self, sensor: str, samples: NDArray[Any]) -> None:
        """Take samples (n,) of a sensor known in `counts`."""
        with self._lock:
            self.counts[sensor].add(samples)
            if self._kept:
                self._kept[-1].batches[sensor].append(samples)
        self.settling.add(sensor, samples)
        if self._heard is not None:
            self._heard.put((sensor, samples))
        if self.recorder is not None:
            self.recorder.add_samples(sensor, samples)

    def on_state(self, state: State) -> None:
        """Take a state of the turner."""
        with self._lock:
            if self._kept:
                self._kept[-1].states.append(state)
        thinning = self._thinning
        if self.recorder is not None and (thinning is None or thinning.keeps(state.time_s)):
            self.recorder.add_state(state)

    @contextmanager
    def standing(self) -> Iterator[None]:
        """The arm stands still for the length of the `with` block: after a while only a few of its states are recorded.

        Whoever watches the arm sees all of them all the same.
        """
        self._thinning = _Thinning()
        try:
            yield
        finally:
            self._thinning = None

    def hear(self) -> "SimpleQueue[tuple[str, NDArray[Any]]]":
        """A queue into which goes, from now on, all that comes: the sensor's name and samples (n,)."""
        self._heard = SimpleQueue()
        return self._heard

    def keep(self) -> None:
        """Hold what comes from now on, as a part of its own; the oldest part goes when there are too many."""
        with self._lock:
            self._kept.append(_Part(defaultdict(list), []))

    def kept(self, sensor: str) -> tuple[np.ndarray, list[State], int]:
        """Samples (n,) of one sensor and arm states that are held, and how many of these are new.

        New are those since the latest `keep`; what is older reaches back `REACHES_BACK_S` from there, however long
        somebody or something was waited for.
        """
        with self._lock:
            batches = [batch for part in self._kept for batch in part.batches[sensor]]
            states = [state for part in self._kept for state in part.states]
            new = len(self._kept[-1].states) if self._kept else 0
        samples = np.concatenate(batches or [np.empty(0, self.counts[sensor].sensor.sample_dtype)])
        if not new or not len(samples):
            return samples, states, new
        from_s = states[-new].time_s - REACHES_BACK_S
        span_us = round(1e6 * (states[-1].time_s - from_s))
        recent = samples["board_time_us"] + np.uint64(span_us) >= samples["board_time_us"][-1]
        return samples[recent], [state for state in states if state.time_s >= from_s], new

    def newest(self, sensor: str) -> np.ndarray:
        """Samples (n,) of one sensor that came since the latest `keep`."""
        with self._lock:
            batches = list(self._kept[-1].batches[sensor]) if self._kept else []
        return np.concatenate(batches or [np.empty(0, self.counts[sensor].sensor.sample_dtype)])

    def samples(self) -> tuple[SensorSamples, ...]:
        """What every sensor has delivered so far."""
        with self._lock:
            return tuple(count.seen for count in self.counts.values())

    def newest_of(self, quantity: Scalar) -> dict[str, tuple[float, float]]:
        """The newest reading of each sensor that has such a one, and before it when it was read, s."""
        with self._lock:
            heard = {name: (each.read_s, each.latest.get(quantity.name)) for name, each in self.counts.items()}
        return {name: (read_s, value[0]) for name, (read_s, value) in heard.items() if value is not None}

    def silent(self) -> list[str]:
        """The sensors that have delivered nothing yet."""
        with self._lock:
            return [count.name for count in self.counts.values() if count.samples == 0]
