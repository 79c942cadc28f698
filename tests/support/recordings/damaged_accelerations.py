"""Accelerations or fields of a frozen recording, damaged on purpose, and the checks that detect it."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cache

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from rig.analysis.check import Check
from rig.analysis.consistency.contradictions import check_references
from rig.analysis.gyroscope.calibration import observe_recordings
from rig.analysis.reference.accelerometer import calibrate_accelerometers
from rig.analysis.reference.magnetometer import calibrate_magnetometers
from rig.data.quantity import ACCELERATION, FIELD
from rig.data.recording.run_data import RunData
from rig.estimation.arrays import Array
from rig.observation.windows import Window, dwelt, swept
from rig.plans.recorded_run import open_run
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
    def values(self) -> Array:
        """The values (n, 3), m/s² or T."""
        return np.asarray(self.counts * self.count, dtype=np.float64)

    @property
    def late(self) -> Mask:
        """The second half of the run."""
        return self.within(Window(float(self.time_s[0] + self.time_s[-1]) / 2, np.inf))

    @property
    def turning(self) -> Mask:
        """All sweeps."""
        mask: Mask = np.any([self.within(sweep.window) for sweep in swept(self.run)], axis=0)
        return mask

    def dwell(self, index: int) -> Mask:
        """Return the mask from shortly before to shortly after a dwell."""
        window = list(dwelt(self.run))[index].window
        return self.within(Window(window.start_s - 0.05, window.end_s + 0.05))

    def half_of_dwell(self, index: int) -> Mask:
        """Return the mask of the second half of a dwell."""
        window = list(dwelt(self.run))[index].window
        return self.within(Window((window.start_s + window.end_s) / 2, window.end_s))

    def sweep(self, index: int) -> Mask:
        return self.within(list(swept(self.run))[index].window)

    def within(self, window: Window) -> Mask:
        inside: Mask = (self.time_s >= window.start_s) & (self.time_s < window.end_s)
        return inside

    def feeling(self, forces: Array) -> "Readings":
        return replace(self, counts=np.round(forces / self.count).astype(np.int64))

    def recording(self) -> RunData:
        samples = self.run.samples[self.sensor].copy()
        samples[COUNTS["field" if self.sensor in self.run.measuring(FIELD) else "acceleration"]] = self.counts
        return replace(self.run, samples={**self.run.samples, self.sensor: samples})


Damage = Callable[[Readings], Readings]


@cache
def load_recording(folder: str) -> RunData:
    """Return a frozen recording."""
    return open_run(RECORDINGS / folder).movement[0]


@cache
def readings_of(folder: str, sensor: str) -> Readings:
    """Return the readings of an undamaged recording."""
    run = load_recording(folder)
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
    """The checks of accelerometers and magnetometers, and the reason why a magnetometer has none."""

    checks: tuple[Check, ...]
    refused: frozenset[str]

    @property
    def failed(self) -> set[str]:
        """The names of those that failed, without the sensor and the piece."""
        return {check.name.split(".")[1] for check in self.checks if not check.passed}


def find_contradictions(run: RunData) -> Told:
    """Check a recording's accelerometers and magnetometers. Raise Fault."""
    recordings = observe_recordings([run])
    accelerometers = calibrate_accelerometers(recordings, run.settings)
    magnetometers = calibrate_magnetometers(recordings, run.settings, accelerometers.results)
    refused = frozenset(fault.name for found in (accelerometers, magnetometers) for fault in found.faults.values())
    found = check_references(recordings, accelerometers.results, magnetometers.results, run.settings)
    return Told(found.checks, refused)


def offset(by: float, where: Callable[[Readings], Mask]) -> Damage:
    return lambda readings: readings.feeling(readings.values + by * ASKEW * where(readings)[:, None])


def bent(change: Callable[[Array], Array]) -> Damage:
    """Add to each axis a function of its reading."""
    return lambda readings: readings.feeling(readings.values + change(readings.values))


def scale(by: float, where: Callable[[Readings], Mask], axes: Sequence[int] = (0, 1, 2)) -> Damage:
    def damage(readings: Readings) -> Readings:
        forces = readings.values
        forces[np.ix_(where(readings), np.array(axes))] *= by
        return readings.feeling(forces)

    return damage


def rotate(angle_deg: float, where: Callable[[Readings], Mask]) -> Damage:
    def damage(readings: Readings) -> Readings:
        forces, chosen = readings.values, where(readings)
        forces[chosen] = forces[chosen] @ Rotation.from_rotvec(np.radians(angle_deg) * AXIS).as_matrix().T
        return readings.feeling(forces)

    return damage


def convert(change: Callable[[NDArray[np.int64]], NDArray[np.int64]]) -> Damage:
    """Change the bits of the readings, as a converter or a bus does."""
    return lambda readings: replace(readings, counts=change(readings.counts))


def stuck(axis: int, where: Callable[[Readings], Mask], value: float | None = None) -> Damage:
    """Hold an axis at a value, or at its first reading."""

    def damage(readings: Readings) -> Readings:
        counts, chosen = readings.counts.copy(), where(readings)
        counts[chosen, axis] = counts[chosen, axis][0] if value is None else round(value / readings.count)
        return replace(readings, counts=counts)

    return damage


def spike(by: float, where: Callable[[Readings], Mask]) -> Damage:
    """Change one reading, in the middle."""

    def damage(readings: Readings) -> Readings:
        chosen = np.flatnonzero(where(readings))
        forces = readings.values
        forces[chosen[len(chosen) // 2]] += by * ASKEW
        return readings.feeling(forces)

    return damage
