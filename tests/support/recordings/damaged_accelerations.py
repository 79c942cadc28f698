"""A frozen recording's accelerations or fields, damaged on purpose, and what is told of them."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cache

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from rig.analysis.check import Check
from rig.analysis.consistency.contradictions import check_references
from rig.analysis.gyroscope.calibration import observe_recordings
from rig.analysis.reference.acceleration import calibrate_accelerometers
from rig.analysis.reference.magnetic_field import calibrate_magnetometers
from rig.data.quantity import ACCELERATION, FIELD
from rig.data.recording.run_file import RunData
from rig.estimation.arrays import Array
from rig.observation.windows import Window, dwelt, swept
from rig.plans.recorded import open_run
from support.paths import RECORDINGS

ASKEW = np.array([1.0, -0.7, 0.5])
AXIS = np.array([0.6, -0.48, 0.64])  # that no sensor axis has
COUNTS = {"acceleration": "acceleration_counts", "field": "field_counts"}

Mask = NDArray[np.bool_]


@dataclass(frozen=True, slots=True)
class Readings:
    """The `counts` (n, 3) of `sensor`, at controller times (n,), in steps of `count` m/s² or T."""

    run: RunData
    sensor: str
    counts: NDArray[np.int64]
    time_s: Array
    count: float

    @property
    def felt(self) -> Array:
        """(n, 3) m/s² or T."""
        return np.asarray(self.counts * self.count, dtype=np.float64)

    @property
    def late(self) -> Mask:
        """The second half of the run."""
        return self.within(Window(float(self.time_s[0] + self.time_s[-1]) / 2, np.inf))

    @property
    def turning(self) -> Mask:
        """All sweeps."""
        found: Mask = np.any([self.within(each.window) for each in swept(self.run)], axis=0)
        return found

    def dwell(self, place: int) -> Mask:
        """From shortly before to shortly after."""
        window = list(dwelt(self.run))[place].window
        return self.within(Window(window.start_s - 0.05, window.end_s + 0.05))

    def half_of_dwell(self, place: int) -> Mask:
        """The second half."""
        window = list(dwelt(self.run))[place].window
        return self.within(Window((window.start_s + window.end_s) / 2, window.end_s))

    def sweep(self, place: int) -> Mask:
        return self.within(list(swept(self.run))[place].window)

    def within(self, window: Window) -> Mask:
        inside: Mask = (self.time_s >= window.start_s) & (self.time_s < window.end_s)
        return inside

    def feeling(self, felt: Array) -> "Readings":
        return replace(self, counts=np.round(felt / self.count).astype(np.int64))

    def recording(self) -> RunData:
        samples = self.run.samples[self.sensor].copy()
        samples[COUNTS["field" if self.sensor in self.run.measuring(FIELD) else "acceleration"]] = self.counts
        return replace(self.run, samples={**self.run.samples, self.sensor: samples})


Damage = Callable[[Readings], Readings]


@cache
def recorded(folder: str) -> RunData:
    """Return a frozen recording."""
    return open_run(RECORDINGS / folder).movement[0]


@cache
def readings_of(folder: str, sensor: str) -> Readings:
    """An undamaged recording's."""
    run = recorded(folder)
    observed = observe_recordings([run])[0]
    magnetometer = run.measuring(FIELD).get(sensor)
    if magnetometer is not None:
        clock = next(iter(observed.sensors.values())).time_base
        samples = run.samples[sensor]
        time_s = clock.controller_time_s(samples["board_time_us"] * 1e-6)
        counts, count = samples[COUNTS["field"]], magnetometer.channel(FIELD).unit_per_count
        return Readings(run, sensor, counts.astype(np.int64), time_s, count)
    stream = observed.stream(sensor)
    per_count = stream.sensor.channel(ACCELERATION).unit_per_count
    assert per_count is not None
    counts = stream.raw[COUNTS["acceleration"]]
    return Readings(run, sensor, counts.astype(np.int64), stream.time_s, per_count)


@dataclass(frozen=True, slots=True)
class Told:
    """The checks of accelerometers and magnetometers, and why a magnetometer has none."""

    checks: tuple[Check, ...]
    refused: frozenset[str]

    @property
    def failed(self) -> set[str]:
        """The names of those that failed, without the sensor and the piece."""
        return {check.name.split(".")[1] for check in self.checks if not check.passed}


def told_of(run: RunData) -> Told:
    """Raises Fault."""
    recordings = observe_recordings([run])
    accelerometers = calibrate_accelerometers(recordings, run.settings)
    magnetometers = calibrate_magnetometers(recordings, run.settings, accelerometers)
    refused = frozenset(fault.name for fault in magnetometers.faults.values())
    return Told(check_references(recordings, accelerometers, magnetometers.results, run.settings).checks, refused)


def offset(by: float, where: Callable[[Readings], Mask]) -> Damage:
    return lambda seen: seen.feeling(seen.felt + by * ASKEW * where(seen)[:, None])


def bent(change: Callable[[Array], Array]) -> Damage:
    """By what each axis adds that reads so much."""
    return lambda seen: seen.feeling(seen.felt + change(seen.felt))


def scaled(by: float, where: Callable[[Readings], Mask], axes: Sequence[int] = (0, 1, 2)) -> Damage:
    def damage(seen: Readings) -> Readings:
        felt = seen.felt
        felt[np.ix_(where(seen), np.array(axes))] *= by
        return seen.feeling(felt)

    return damage


def turned(angle_deg: float, where: Callable[[Readings], Mask]) -> Damage:
    def damage(seen: Readings) -> Readings:
        felt, there = seen.felt, where(seen)
        felt[there] = felt[there] @ Rotation.from_rotvec(np.radians(angle_deg) * AXIS).as_matrix().T
        return seen.feeling(felt)

    return damage


def converted(change: Callable[[NDArray[np.int64]], NDArray[np.int64]]) -> Damage:
    """By what the converter or the bus does to the bits."""
    return lambda seen: replace(seen, counts=change(seen.counts))


def stuck(axis: int, where: Callable[[Readings], Mask], at: float | None = None) -> Damage:
    """At a value, or at the first reading there."""

    def damage(seen: Readings) -> Readings:
        counts, there = seen.counts.copy(), where(seen)
        counts[there, axis] = counts[there, axis][0] if at is None else round(at / seen.count)
        return replace(seen, counts=counts)

    return damage


def spike(by: float, where: Callable[[Readings], Mask]) -> Damage:
    """One reading, in the middle."""

    def damage(seen: Readings) -> Readings:
        there = np.flatnonzero(where(seen))
        felt = seen.felt
        felt[there[len(there) // 2]] += by * ASKEW
        return seen.feeling(felt)

    return damage
