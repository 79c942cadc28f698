"""Recordings as exports take them: what turned had joints, or a hand turned, or somebody else's files tell all.

Only of the first a motion is recorded beside the readings, and one clock for all of them is found. Of the others what
there is is exported: readings on the clock that stamped them, and what the file of the motion told.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final, Protocol

import numpy as np

from rig.data.quantity import ACCELERATION, RATE, Quantity
from rig.data.recording.motion_file import MotionKind
from rig.data.recording.run_file import RunData
from rig.errors import Refused
from rig.estimation.arrays import Array
from rig.observation.average import Average
from rig.observation.by_hand.runs import microsecond_of
from rig.observation.observed_run import ObservedRun, observe_runs
from rig.report.exports.columns import Table, readings_table, split

LOST = "Not here: counts, the board's and the computer's times, events, settings; they are in run.h5."
LOST_OF_FILES = "Not here: what was said beside the files; it is in run.h5."
UPWARDS = "Accelerations are upwards at rest. "
TURNED = "Turns by an angle about a unit vector in the flange's frame; those of angle 0 are rests."
TOLD: Final[Mapping[MotionKind, str]] = {
    "sweeps": "Turns about a unit vector in a frame fixed to the carrier; those of no speed or no angle are rests.",
    "attitudes": "Unit quaternions that take body to table coordinates, and what was told beside, in body coordinates.",
}


class Exported(Protocol):
    """One recording, and whose clock its times are of."""

    @property
    def run(self) -> RunData:
        """The recording."""
        ...

    @property
    def clock(self) -> str:
        """Whose clock it is, in words."""
        ...

    def time_s(self, sensor: str) -> Array:
        """Times (n,) of all samples of a sensor, s."""
        ...

    def since_s(self, sensor: str) -> Array:
        """Times (n,) of all samples of a sensor since the recording began, s."""
        ...

    def noise(self, sensor: str, quantity: Quantity) -> Sequence[Array]:
        """Noise (3,) of one sample, of each time when the sensor is known to have stood still."""
        ...

    def tables(self) -> Iterator[Table]:
        """All that tables hold of it."""
        ...


@dataclass(frozen=True, slots=True)
class WithMotion:
    """An `Exported` recording of what turned by its joints, once observed."""

    observed: ObservedRun
    clock: str = "the arm controller's clock"

    @property
    def run(self) -> RunData:
        """The recording."""
        return self.observed.run

    def time_s(self, sensor: str) -> Array:
        """Times (n,) of all samples of a sensor, s."""
        return self.observed.time_s(sensor)

    def since_s(self, sensor: str) -> Array:
        """Times (n,) of all samples of a sensor since the first state, s."""
        since_s: Array = self.time_s(sensor) - self.observed.motion.time_s[0]
        return since_s

    def noise(self, sensor: str, quantity: Quantity) -> Sequence[Array]:
        """Noise (3,) of one sample in each rest, of accelerations in each dwell."""
        seen = self.observed.sensors[sensor]
        if quantity == ACCELERATION:
            return [dwell.reading.noise for dwell in seen.dwells]
        return [rest.noise_rad_s for rest in seen.rests]

    def tables(self) -> Iterator[Table]:
        """The arm, of each sensor its readings, accelerations beside rates apart, of each gyroscope its sweeps too."""
        said = f"Times are seconds of {self.clock}. {LOST}"
        yield Table("arm", self.observed.motion.table(), f"Joint angles and rates, from the ground on. {said}")
        for name, sensor in self.run.sensors.items():
            beside = [each for each in sensor.channels if sensor.measures(RATE) and each.quantity == ACCELERATION.name]
            own = [each for each in sensor.channels if each not in beside]
            for after, channels, more in (("", own, ""), ("_acceleration", beside, UPWARDS)):
                if channels:
                    table = readings_table(self.run, name, channels, self.time_s(name), more + said)
                    yield replace(table, name=name + after)
            if sensor.measures(RATE):
                yield Table(f"{name}_sweeps", self._sweeps(name), f"{TURNED} {said}")

    def _sweeps(self, name: str) -> dict[str, Array]:
        seen = self.observed.sensors[name]
        rows = [(*_span(turn.average), *turn.axis_flange, turn.angle_rad) for turn in seen.revolutions]
        rows += [(*_span(rest), 0.0, 0.0, 0.0, 0.0) for rest in seen.rests]
        names = ("start_s", "end_s", "axis_x", "axis_y", "axis_z", "angle_rad")
        return split(names, np.array(sorted(rows), dtype=np.float64).reshape(-1, len(names)))


@dataclass(frozen=True, slots=True)
class ReadingsAlone:
    """An `Exported` recording of readings that no joints were recorded beside: by hand, or from files."""

    run: RunData

    @property
    def clock(self) -> str:
        """Whose clock it is, in words."""
        return "the clock that stamped the readings"

    def time_s(self, sensor: str) -> Array:
        """Times (n,) of all samples of a sensor, s: of files as they tell them."""
        samples = self.run.samples[sensor]
        if self.run.elsewhere is not None:
            times_of_file: Array = samples["host_time_s"]
            return times_of_file
        times_s: Array = microsecond_of(self.run.sensors[sensor]) * samples["board_time_us"].astype(np.float64)
        return times_s

    def since_s(self, sensor: str) -> Array:
        """Times (n,) of all samples of a sensor since the first of them, s."""
        time_s = self.time_s(sensor)
        return time_s - time_s[:1]

    def noise(self, sensor: str, quantity: Quantity) -> Sequence[Array]:
        """No noise: nobody told when it stood still."""
        return ()

    def tables(self) -> Iterator[Table]:
        """The readings of each sensor in one table, as `rig solve` takes them; what files told of the motion."""
        read = self.run.elsewhere
        said = f"Times are seconds of {self.clock}. {LOST if read is None else LOST_OF_FILES}"
        for name, sensor in self.run.sensors.items():
            more = UPWARDS if sensor.measures(ACCELERATION) else ""
            yield readings_table(self.run, name, sensor.channels, self.time_s(name), more + said)
        if read is not None and read.tells in TOLD:
            yield Table(f"{read.item.name}_{read.tells}", read.motion, f"{TOLD[read.tells]} {said}")


def exported(runs: Sequence[RunData]) -> tuple[Exported, ...]:
    """The recordings of one run, of those with joints as `observe_runs` takes them.

    Raises as `observe_runs`; Refused `nothing_to_export` where they hold no finished sweep or dwell, or no reading.
    """
    found: tuple[Exported, ...]
    if all(run.turner is not None and run.turner.joints for run in runs):
        found, missing = tuple(map(WithMotion, observe_runs(runs))), "no sweep or dwell was finished"
    else:
        found = tuple(ReadingsAlone(run) for run in runs if any(map(len, run.samples.values())))
        missing = "no reading was recorded"
    if not found:
        raise Refused("nothing_to_export", missing, "Resume the run")
    return found


def _span(average: Average) -> tuple[float, float]:
    return average.start_s, average.end_s
