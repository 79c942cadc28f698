"""Arriving samples and states: passed on to the recording, counted, and kept for the next computations."""

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
from rig.motion.turner_state import State
from rig.runner.settling import Settling
from rig.station.events import SensorSamples

KEPT_PARTS = 3
CLOCK_DATA_S = 300.0  # before a sweep, from which its clock is determined: more take longer and add nothing
FULL_RATE_S = 5.0  # beginning of a dwell, in which every state of the arm is recorded
REST_INTERVAL_S = 0.25  # after that: all states of an arm at rest for hours would fill the disk


@dataclass(slots=True)
class SensorCount:
    """The number of samples that one sensor has delivered so far.

    - `lost`: the number missing in its sequence numbers.
    - `latest`: the mean readings of the newest samples, by quantity.
    - `read_s`: the time of the latest readings, by the clock that stamps them.
    """

    name: str
    sensor: RecordedSensor
    samples: int = 0
    lost: int = 0
    latest: Mapping[str, tuple[float, ...]] = field(default_factory=dict)
    read_s: float = 0.0
    _next_sequence: int = 0

    def add(self, samples: NDArray[Any]) -> None:
        """Count samples (n,), whose means become the `latest` readings."""
        sequence = samples["sequence"]
        last = int(sequence[-1])
        self.lost += last + 1 - self._next_sequence - len(sequence)
        self._next_sequence = last + 1
        self.samples += len(sequence)
        self.latest = self.sensor.means(samples)
        self.read_s = 1e-6 * float(samples["board_time_us"].mean())

    @property
    def summary(self) -> SensorSamples:
        """The counts as an event for the page and the terminal."""
        return SensorSamples(self.name, self.samples, self.lost, self.latest)


@dataclass(frozen=True, slots=True)
class _Part:
    """The data that arrived between two calls of `Acquisition.keep`: `batches` of samples by sensor, and `states`."""

    batches: defaultdict[str, list[np.ndarray]]
    states: list[State]


@dataclass(slots=True)
class _Thinning:
    """The selection, by time, of the states to record while the arm is at rest."""

    began_s: float | None = None
    last_s: float = 0.0

    def keeps(self, time_s: float) -> bool:
        """Return whether to record the state at `time_s`.

        All states are recorded for `FULL_RATE_S`, then one in each `REST_INTERVAL_S`. Call this for each state in
        order.
        """
        if self.began_s is None:
            self.began_s = time_s
        if time_s - self.began_s > FULL_RATE_S and time_s - self.last_s < REST_INTERVAL_S:
            return False
        self.last_s = time_s
        return True


@dataclass(slots=True)
class Acquisition:
    """The data that the reader threads of sources and turner deliver, and that the script's thread reads.

    The keys of `counts` are sensor names. Data that arrive before there is a `recorder` are not recorded. After the
    first call of `keep`, the data received since the last `KEPT_PARTS` calls of `keep` also stay in memory.
    """

    counts: dict[str, SensorCount] = field(default_factory=dict)
    recorder: RunRecorder | None = None
    settling: Settling = field(default_factory=Settling)
    _kept: deque[_Part] = field(default_factory=lambda: deque(maxlen=KEPT_PARTS))
    _lock: threading.Lock = field(default_factory=threading.Lock)
    _thinning: "_Thinning | None" = None
    _heard: "SimpleQueue[tuple[str, NDArray[Any]]] | None" = None

    def expect(self, name: str, sensor: RecordedSensor) -> None:
        """Count the samples of a sensor from now on, and watch its settling if it has rates."""
        self.counts[name] = SensorCount(name, sensor)
        if sensor.measures(RATE):
            self.settling.expect(name, sensor)

    def on_samples(self, sensor: str, samples: NDArray[Any]) -> None:
        """Store samples (n,) of a sensor that `counts` contains."""
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
        """Store a state of the turner."""
        with self._lock:
            if self._kept:
                self._kept[-1].states.append(state)
        thinning = self._thinning
        if self.recorder is not None and (thinning is None or thinning.keeps(state.time_s)):
            self.recorder.add_state(state)

    @contextmanager
    def thin_states(self) -> Iterator[None]:
        """Record only a few of the arm's states after the first seconds of the block, in which the arm is at rest.

        Page and supervision still receive all states.
        """
        self._thinning = _Thinning()
        try:
            yield
        finally:
            self._thinning = None

    def hear(self) -> "SimpleQueue[tuple[str, NDArray[Any]]]":
        """Return a queue that receives all samples from now on, in pairs of a sensor's name and its samples (n,)."""
        self._heard = SimpleQueue()
        return self._heard

    def keep(self) -> None:
        """Begin a new part in memory for data that arrive from now on; only the latest `KEPT_PARTS` parts remain."""
        with self._lock:
            self._kept.append(_Part(defaultdict(list), []))

    def collect_kept(self, sensor: str) -> tuple[np.ndarray, list[State], int]:
        """Return the samples (n,) of one sensor and the states of the arm in memory, and the number of new states.

        States since the latest `keep` are new. Older states and samples go back at most `CLOCK_DATA_S` before the first
        new state, even if the arm has waited for longer.
        """
        with self._lock:
            batches = [batch for part in self._kept for batch in part.batches[sensor]]
            states = [state for part in self._kept for state in part.states]
            new = len(self._kept[-1].states) if self._kept else 0
        samples = np.concatenate(batches or [np.empty(0, self.counts[sensor].sensor.sample_dtype)])
        if not new or not len(samples):
            return samples, states, new
        from_s = states[-new].time_s - CLOCK_DATA_S
        span_us = round(1e6 * (states[-1].time_s - from_s))
        recent = samples["board_time_us"] + np.uint64(span_us) >= samples["board_time_us"][-1]
        return samples[recent], [state for state in states if state.time_s >= from_s], new

    def collect_newest(self, sensor: str) -> np.ndarray:
        """Return the samples (n,) of one sensor that arrived since the latest `keep`."""
        with self._lock:
            batches = list(self._kept[-1].batches[sensor]) if self._kept else []
        return np.concatenate(batches or [np.empty(0, self.counts[sensor].sensor.sample_dtype)])

    def samples(self) -> tuple[SensorSamples, ...]:
        """Return the numbers of samples and of lost samples of every sensor so far."""
        with self._lock:
            return tuple(count.summary for count in self.counts.values())

    def find_newest_readings(self, quantity: Scalar) -> dict[str, tuple[float, float]]:
        """Return, by name, time (s) and value of the latest reading of each sensor that measures `quantity`."""
        with self._lock:
            heard = {name: (count.read_s, count.latest.get(quantity.name)) for name, count in self.counts.items()}
        return {name: (read_s, value[0]) for name, (read_s, value) in heard.items() if value is not None}

    def find_silent(self) -> list[str]:
        """Return the names of the sensors that have delivered nothing yet."""
        with self._lock:
            return [count.name for count in self.counts.values() if count.samples == 0]
