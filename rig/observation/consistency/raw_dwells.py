"""Raw readings of accelerometers and magnetometers in dwells and sweeps. Pure functions."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rig.data.quantity import ACCELERATION
from rig.estimation.arrays import Array
from rig.observation.average import slice_time
from rig.observation.consistency.raw_readings import REST, RawReadings, counts_of
from rig.observation.field_means import read_field_in_dwells
from rig.observation.observed_run import ObservedRun
from rig.observation.reference.dwell_acceleration import DwellReading, gravity_difference
from rig.observation.windows import Window


@dataclass(frozen=True, slots=True)
class RawDwell:
    """The raw readings of one dwell: counts (n, 3) at controller times (n,) within the `window`.

    The arm stood at `q_rad` (6,); `clock_offset_s` converts times to the clock of the first recording.
    `oscillation_counts` (n, 3): the effect of the arm's oscillation, as encoders measure it.
    """

    index: int
    counts: NDArray[np.int64]
    time_s: Array
    window: Window
    q_rad: Array
    clock_offset_s: float
    oscillation_counts: Array | float = 0.0

    @property
    def still_counts(self) -> Array:
        """The counts (n, 3) with the arm's oscillation subtracted."""
        return np.subtract(self.counts, self.oscillation_counts, dtype=np.float64)

    @property
    def middle_s(self) -> float:
        """The middle of the window on the controller's clock, s."""
        return (self.window.start_s + self.window.end_s) / 2


def raw_acceleration_dwells(name: str, recording: ObservedRun, matrix: Array) -> list[RawDwell]:
    """Return a sensor's raw accelerations in each of its dwells; `matrix` (3, 3) converts forces to readings."""
    stream, site = recording.stream(name), recording.run.settings.site
    per_count = matrix / stream.sensor.channel(ACCELERATION).unit_per_count
    dwells = []
    for dwell in recording.sensors[name].dwells:
        inside = slice_time(stream, dwell.window.start_s, dwell.window.end_s)
        counts = counts_of(stream, ACCELERATION, inside)
        attitudes = recording.motion.attitudes(stream.time_s[inside])
        swing = gravity_difference(attitudes, attitudes.mean(axis=0), stream.sensor, site) @ per_count.T
        dwells.append(replace(_raw_dwell(dwell, counts, stream.time_s[inside], recording), oscillation_counts=swing))
    return dwells


def raw_acceleration_sweeps(name: str, recording: ObservedRun) -> list[RawReadings]:
    """Return a sensor's raw accelerations in its revolutions, each with the revolution's number in the recording."""
    stream = recording.stream(name)
    sweeps = []
    for index, turn in enumerate(recording.sensors[name].revolutions):
        if turn.acceleration is not None:
            lsb = stream.sensor.channel(ACCELERATION).unit_per_count
            inside, wave = slice_time(stream, turn.average.start_s, turn.average.end_s), turn.acceleration.harmonic
            counts = counts_of(stream, ACCELERATION, inside)
            sweeps.append(RawReadings(index, counts, wave.residuals_m_s2 / lsb, wave.vibration_m_s2 / lsb))
    return sweeps


def raw_field_dwells(name: str, recording: ObservedRun) -> list[RawDwell]:
    """Return a magnetometer's raw readings in each of its dwells."""
    return [
        _raw_dwell(dwell, counts.astype(np.int64), time_s, recording)
        for dwell, counts, time_s in read_field_in_dwells(recording, name)
    ]


def rests_of_dwells(dwells: Sequence[RawDwell]) -> list[RawReadings]:
    """Return each dwell in the form of the raw readings of a rest; their residuals are those from the dwell's mean."""
    residuals = [dwell.still_counts - dwell.still_counts.mean(axis=0) for dwell in dwells]
    return [RawReadings(REST, dwell.counts, rest, np.zeros(3)) for dwell, rest in zip(dwells, residuals, strict=True)]


def _raw_dwell(dwell: DwellReading, counts: NDArray[np.int64], time_s: Array, recording: ObservedRun) -> RawDwell:
    window = dwell.window
    q_rad = recording.motion.angles((window.start_s + window.end_s) / 2)
    return RawDwell(dwell.index, counts, time_s, window, q_rad, recording.clock_offset_s)
