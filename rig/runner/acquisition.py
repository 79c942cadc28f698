"""Passes what arrives on to the recording and counts it, for who looks on and to see that samples flow."""

import threading
from collections import defaultdict, deque
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from firmware_host.client import SampleBatch
from firmware_host.samples import SAMPLE_DTYPE
from rig.arm.state import ArmState
from rig.data.run_file import RecordedMagnetometer, RecordedSensor, RunRecorder
from rig.runner.settling import Settling
from rig.station.events import SensorSamples, Vector

KEPT_PARTS = 3


@dataclass(slots=True)
class SensorCount:
    """What one sensor has delivered so far. `lost` counts the gaps in its sequence numbers.

    `sensitivity` is rad/s per count, or of a magnetometer, whose samples have another `column`, tesla.
    """

    name: str
    sensitivity: float
    column: Literal["counts", "field_counts"] = "counts"
    samples: int = 0
    lost: int = 0
    latest: Vector | None = None
    _next_sequence: int = 0

    def add(self, batch: SampleBatch) -> None:
        """Count one batch; its mean becomes the `latest` reading."""
        sequence = batch.samples["sequence"]
        last = int(sequence[-1])
        self.lost += last + 1 - self._next_sequence - len(sequence)
        self._next_sequence = last + 1
        self.samples += len(sequence)
        x, y, z = (batch.samples[self.column].mean(axis=0) * self.sensitivity).tolist()
        self.latest = (x, y, z)

    @property
    def seen(self) -> SensorSamples:
        """As it is told."""
        if self.column == "field_counts":
            return SensorSamples(self.name, self.samples, self.lost, None, self.latest)
        return SensorSamples(self.name, self.samples, self.lost, self.latest)


@dataclass(frozen=True, slots=True)
class _Part:
    """What came between two calls of `keep`."""

    batches: defaultdict[int, list[np.ndarray]]
    states: list[ArmState]


@dataclass(slots=True)
class Acquisition:
    """Fed by the board's and the arm's reader threads, read by the script's. `counts` by the board's sensor index.

    What comes before there is a `recorder` is not kept. From the first `keep` on, all that came since the last
    `KEPT_PARTS` of them is also held in memory.
    """

    counts: dict[int, SensorCount] = field(default_factory=dict)
    recorder: RunRecorder | None = None
    settling: Settling = field(default_factory=Settling)
    _kept: deque[_Part] = field(default_factory=lambda: deque(maxlen=KEPT_PARTS))
    _lock: threading.Lock = field(default_factory=threading.Lock)

    def expect(self, index: int, name: str, sensor: RecordedSensor) -> None:
        """Count the samples of a sensor by its index on the board, before the stream begins."""
        self.counts[index] = SensorCount(name, sensor.sensitivity_rad_s_per_count)
        self.settling.expect(index, name, sensor)

    def expect_field(self, index: int, name: str, magnetometer: RecordedMagnetometer) -> None:
        """The same of a magnetometer, which tells nothing of whether the arm has settled."""
        self.counts[index] = SensorCount(name, magnetometer.sensitivity_t_per_count, "field_counts")

    def on_samples(self, batch: SampleBatch) -> None:
        """Take a batch of samples of a sensor known in `counts`."""
        with self._lock:
            count = self.counts[batch.sensor]
            count.add(batch)
            if self._kept:
                self._kept[-1].batches[batch.sensor].append(batch.samples)
        self.settling.add(batch)
        if self.recorder is not None:
            self.recorder.add_samples(count.name, batch.samples)

    def on_state(self, state: ArmState) -> None:
        """Take a state of the arm."""
        with self._lock:
            if self._kept:
                self._kept[-1].states.append(state)
        if self.recorder is not None:
            self.recorder.add_arm_state(state)

    def keep(self) -> None:
        """From now on hold what comes, as a part of its own; the oldest part goes when there are too many."""
        with self._lock:
            self._kept.append(_Part(defaultdict(list), []))

    def kept(self, sensor: int) -> tuple[np.ndarray, list[ArmState], int]:
        """All samples (n,) of one sensor and all arm states that are held, and how many of these are new.

        New are those since the latest `keep`.
        """
        with self._lock:
            batches = [batch for part in self._kept for batch in part.batches[sensor]]
            states = [state for part in self._kept for state in part.states]
            new = len(self._kept[-1].states) if self._kept else 0
        return np.concatenate(batches or [np.empty(0, SAMPLE_DTYPE)]), states, new

    def samples(self) -> tuple[SensorSamples, ...]:
        """What every sensor has delivered so far."""
        with self._lock:
            return tuple(count.seen for count in self.counts.values())

    def silent(self) -> list[str]:
        """The sensors that have delivered nothing yet."""
        with self._lock:
            return [count.name for count in self.counts.values() if count.samples == 0]
