"""Passes what arrives on to the recording and counts it, for the operator's view and to see that samples flow."""

import threading
from collections import defaultdict
from dataclasses import dataclass, field

import numpy as np

from firmware_host.client import SampleBatch
from firmware_host.samples import SAMPLE_DTYPE
from rig.arm.state import ArmState
from rig.recording import RunRecorder

Vector = tuple[float, float, float]


@dataclass(slots=True)
class SensorCount:
    """What one sensor has delivered so far. `lost` counts the gaps in its sequence numbers."""

    name: str
    sensitivity_rad_s_per_count: float
    samples: int = 0
    lost: int = 0
    rate_rad_s: Vector | None = None
    _next_sequence: int = 0

    def add(self, batch: SampleBatch) -> None:
        """Count one batch; its mean becomes `rate_rad_s`."""
        sequence = batch.samples["sequence"]
        last = int(sequence[-1])
        self.lost += last + 1 - self._next_sequence - len(sequence)
        self._next_sequence = last + 1
        self.samples += len(sequence)
        x, y, z = (batch.samples["counts"].mean(axis=0) * self.sensitivity_rad_s_per_count).tolist()
        self.rate_rad_s = (x, y, z)


@dataclass(slots=True)
class Monitor:
    """Fed by the board's and the arm's reader threads, read by the procedure's. `counts` by the board's sensor index.

    What comes before there is a `recorder` is not kept. From `keep` to `release` all that comes is
    also held in memory.
    """

    counts: dict[int, SensorCount] = field(default_factory=dict)
    recorder: RunRecorder | None = None
    _kept: tuple[defaultdict[int, list[np.ndarray]], list[ArmState]] | None = None
    _lock: threading.Lock = field(default_factory=threading.Lock)

    def on_samples(self, batch: SampleBatch) -> None:
        """Take a batch of samples of a sensor known in `counts`."""
        with self._lock:
            count = self.counts[batch.sensor]
            count.add(batch)
            if self._kept is not None:
                self._kept[0][batch.sensor].append(batch.samples)
        if self.recorder is not None:
            self.recorder.add_samples(count.name, batch.samples)

    def on_state(self, state: ArmState) -> None:
        """Take a state of the arm."""
        with self._lock:
            if self._kept is not None:
                self._kept[1].append(state)
        if self.recorder is not None:
            self.recorder.add_arm_state(state)

    def keep(self) -> None:
        """From now on hold what comes; what was held before goes."""
        with self._lock:
            self._kept = defaultdict(list), []

    def kept(self, sensor: int) -> tuple[np.ndarray, list[ArmState]]:
        """Samples (n,) SAMPLE_DTYPE of one sensor, and arm states, since `keep`; empty when nothing is held."""
        with self._lock:
            batches, states = self._kept or (defaultdict(list), [])
            return np.concatenate(batches[sensor] or [np.empty(0, SAMPLE_DTYPE)]), list(states)

    def release(self) -> None:
        """Hold nothing any more."""
        with self._lock:
            self._kept = None

    def totals(self) -> tuple[int, int, Vector | None]:
        """Samples received, samples lost, and the newest mean reading of the first sensor in rad/s."""
        with self._lock:
            counts = list(self.counts.values())
            return sum(c.samples for c in counts), sum(c.lost for c in counts), counts[0].rate_rad_s

    def silent(self) -> list[str]:
        """The sensors that have delivered nothing yet."""
        with self._lock:
            return [count.name for count in self.counts.values() if count.samples == 0]
