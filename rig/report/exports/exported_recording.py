"""Recordings for exports: of a turner with joints, of a hand, or of external files.

Only a turner with joints has a recorded motion and a common clock. Other recordings have readings on the clock that
stamped them, and the motion that a file states.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from rig.data.quantity import ACCELERATION, RATE, Quantity
from rig.data.recording.motion_file import MotionKind
from rig.data.recording.run_data import RunData
from rig.errors import Refused
from rig.estimation.arrays import Array
from rig.observation.average import Average
from rig.observation.by_hand.rests_and_moves import microsecond_of
from rig.observation.observed_run import ObservedRun, observe_runs
from rig.report.exports.columns import ExportTable, readings_table, split

OMITTED_NOTE = "Not here: counts, the board's and the computer's times, events, settings; they are in run.h5."
OMITTED_FROM_FILES_NOTE = "Not here: statements that came with the files; they are in run.h5."
UPWARDS_NOTE = "Accelerations are upwards at rest. "
TURNS_NOTE = "Turns by an angle about a unit vector in the flange's frame; those of angle 0 are rests."
MOTION: Final[Mapping[MotionKind, str]] = {
    "sweeps": "Turns about a unit vector in a frame fixed to the carrier; rows without speed and angle are rests.",
    "attitudes": "Unit quaternions that take body to table coordinates, and the file's other columns, in body axes.",
}


@dataclass(frozen=True, slots=True)
class WithMotion:
    """The observed recording of a turner with joints, and the name of the clock to which its times refer."""

    observed: ObservedRun
    clock: str = "the arm controller's clock"

    @property
    def run(self) -> RunData:
        """The recording."""
        return self.observed.run

    def time_s(self, sensor: str) -> Array:
        """Return the times (n,) of all samples of a sensor, s."""
        return self.observed.time_s(sensor)

    def since_s(self, sensor: str) -> Array:
        """Return the times (n,) of all samples of a sensor since the turner's first state, s."""
        since_s: Array = self.time_s(sensor) - self.observed.motion.time_s[0]
        return since_s

    def noise(self, sensor: str, quantity: Quantity) -> Sequence[Array]:
        """Return the standard deviation (3,) of single samples in each rest or, for accelerations, in each dwell."""
        sensor_observations = self.observed.sensors[sensor]
        if quantity == ACCELERATION:
            return [dwell.reading.noise for dwell in sensor_observations.dwells]
        return [rest.noise_rad_s for rest in sensor_observations.rests]

    def tables(self) -> Iterator[ExportTable]:
        """Yield a table of the arm's joints, then tables of each sensor's readings, accelerations and sweeps."""
        remark = f"Times are seconds of {self.clock}. {OMITTED_NOTE}"
        yield ExportTable("arm", self.observed.motion.table(), f"Joint angles and rates, from the ground up. {remark}")
        for name, sensor in self.run.sensors.items():
            forces = [
                channel
                for channel in sensor.channels
                if sensor.measures(RATE) and channel.quantity == ACCELERATION.name
            ]
            others = [channel for channel in sensor.channels if channel not in forces]
            for after, channels, more in (("", others, ""), ("_acceleration", forces, UPWARDS_NOTE)):
                if channels:
                    table = readings_table(self.run, name, channels, self.time_s(name), more + remark)
                    yield replace(table, name=name + after)
            if sensor.measures(RATE):
                yield ExportTable(f"{name}_sweeps", self._sweeps(name), f"{TURNS_NOTE} {remark}")

    def _sweeps(self, name: str) -> dict[str, Array]:
        observations = self.observed.sensors[name]
        rows = [(*_interval_of(turn.average), *turn.axis_flange, turn.angle_rad) for turn in observations.revolutions]
        rows += [(*_interval_of(rest), 0.0, 0.0, 0.0, 0.0) for rest in observations.rests]
        names = ("start_s", "end_s", "axis_x", "axis_y", "axis_z", "angle_rad")
        return split(names, np.array(sorted(rows), dtype=np.float64).reshape(-1, len(names)))


@dataclass(frozen=True, slots=True)
class ReadingsAlone:
    """A recording without a recorded motion, from a session by hand or from files."""

    run: RunData

    @property
    def clock(self) -> str:
        """The name of the clock of the times, in words."""
        return "the clock that stamped the readings"

    def time_s(self, sensor: str) -> Array:
        """Return the times (n,) of all samples of a sensor, s; times from a file are unchanged."""
        samples = self.run.samples[sensor]
        if self.run.external is not None:
            times_of_file: Array = samples["host_time_s"]
            return times_of_file
        times_s: Array = microsecond_of(self.run.sensors[sensor]) * samples["board_time_us"].astype(np.float64)
        return times_s

    def since_s(self, sensor: str) -> Array:
        """Return the times (n,) of all samples of a sensor since the first one, s."""
        time_s = self.time_s(sensor)
        return time_s - time_s[:1]

    def noise(self, sensor: str, quantity: Quantity) -> Sequence[Array]:
        """Return no noise, because the times at rest are unknown."""
        return ()

    def tables(self) -> Iterator[ExportTable]:
        """Yield a table of each sensor's readings and, if a file describes the motion, a table of this motion."""
        external = self.run.external
        remark = f"Times are seconds of {self.clock}. {OMITTED_NOTE if external is None else OMITTED_FROM_FILES_NOTE}"
        for name, sensor in self.run.sensors.items():
            more = UPWARDS_NOTE if sensor.measures(ACCELERATION) else ""
            yield readings_table(self.run, name, sensor.channels, self.time_s(name), more + remark)
        if external is not None and external.tells in MOTION:
            yield ExportTable(
                f"{external.item.name}_{external.tells}", external.motion, f"{MOTION[external.tells]} {remark}"
            )


Exported = WithMotion | ReadingsAlone


def export_recordings(runs: Sequence[RunData]) -> tuple[Exported, ...]:
    """Return the recordings of one run for export.

    Raise Fault as `observe_runs` does; Refused `nothing_to_export` without a finished step, or without readings.
    """
    recordings: tuple[Exported, ...]
    if all(run.turner is not None and run.turner.joints for run in runs):
        recordings, missing = tuple(map(WithMotion, observe_runs(runs))), "no sweep or dwell was finished"
    else:
        recordings = tuple(ReadingsAlone(run) for run in runs if any(map(len, run.samples.values())))
        missing = "no reading was recorded"
    if not recordings:
        raise Refused("nothing_to_export", missing, "Resume the run")
    return recordings


def _interval_of(average: Average) -> tuple[float, float]:
    return average.start_s, average.end_s
