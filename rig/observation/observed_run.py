"""A recording and all it tells: the arm's motion, and of each sensor its time, its revolutions and its rests."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from datetime import datetime
from itertools import pairwise
from types import MappingProxyType

import numpy as np

from rig.data.quantity import RATE, Quantity
from rig.data.recording.run_file import RunData
from rig.data.recording.settings import ObservationThresholds
from rig.estimation.arrays import Array
from rig.estimation.temperature.over_temperature import OverTemperature
from rig.observation.average import Stream, on_clock
from rig.observation.finished import finished_dwells, finished_sweeps
from rig.observation.motion.arm_motion import ArmMotion, motion_of, turner_of
from rig.observation.observe import SensorObservations, observe_sensor
from rig.observation.timebase import TimeBase

AS_STATED: Mapping[int, Array] = MappingProxyType({})  # no stage's mount is known to be off


@dataclass(frozen=True, slots=True)
class Delay:
    """How much one sensor's filter lags another's, s, and the standard deviation of that."""

    delay_s: float
    std_s: float


@dataclass(frozen=True, slots=True)
class ObservedRun:
    """One recording, observed once; `sensors` by name.

    By `polynomials` its readings were taken to one temperature, and are whenever they are asked for. `clock_offset_s`
    takes its times to the clock of the first recording of its run.
    """

    run: RunData
    motion: ArmMotion
    sensors: Mapping[str, SensorObservations]
    polynomials: Mapping[str, Mapping[Quantity, OverTemperature]] = field(default_factory=dict)
    clock_offset_s: float = 0.0

    def stream(self, sensor: str) -> Stream:
        """A sensor's samples in rad/s on the arm's clock."""
        stream = on_clock(self.run.samples[sensor], self.run.sensors[sensor], self.sensors[sensor].time_base)
        return stream.at_reference(self.polynomials[sensor]) if sensor in self.polynomials else stream

    def time_s(self, sensor: str, beside: str | None = None) -> Array:
        """Times (n,) of all samples of any sensor on the arm's clock.

        By the time base of the gyroscope `beside`; left out, by the sensor's own or that of the first gyroscope on the
        same clock. Where there is none, by when samples came to the computer, as the arm's states did: to milliseconds.
        """
        bases = {name: seen.time_base for name, seen in self.sensors.items()}
        return times_s(self.run, sensor, bases, beside)

    def delay(self, sensor: str, behind: str) -> Delay | None:
        """How much `sensor` lags the sensor `behind`; None where no one clock stamps the samples of both.

        Where the board's does, what their time bases differ by is their filters' doing.
        """
        if not all(self.run.sensors[name].on_board for name in (sensor, behind)):
            return None
        late, known = self.sensors[sensor].time_base, self.sensors[behind].time_base
        middle = np.array([known.reference_s])
        delay_s = float(known.controller_time_s(middle)[0] - late.controller_time_s(middle)[0])
        return Delay(delay_s, float(np.hypot(known.offset_std_s, late.offset_std_s)))


def one_clock(run: RunData, sensor: str, other: str) -> bool:
    """Whether one clock stamps the samples of both sensors of a recording."""
    return run.sensors[sensor].clock == run.sensors[other].clock


def times_s(run: RunData, sensor: str, bases: Mapping[str, TimeBase], beside: str | None = None) -> Array:
    """Times (n,) of all samples of a sensor on the arm's clock, by what is known of the gyroscopes' `bases`.

    Which of them, `ObservedRun.time_s` says.
    """
    samples = run.samples[sensor]
    stamps_s: Array = samples["board_time_us"] * 1e-6
    known = (beside, sensor) if beside else (sensor, *bases)
    base = next((each for each in known if each in bases and one_clock(run, sensor, each)), None)
    if base is not None:
        return bases[base].controller_time_s(stamps_s)
    came_s = np.interp(samples["host_time_s"], run.states["host_time_s"], run.states["time_s"])
    return stamps_s + np.median(came_s - stamps_s) if len(stamps_s) else stamps_s


def observe_run(
    run: RunData, thresholds: ObservationThresholds, superseded: Collection[int] = (), turned: Array | None = None
) -> ObservedRun:
    """Observe every gyroscope of a recording; raises Fault as `motion_of` and `observe_sensor` do.

    `turned` (3, 3) is by how the item sits off its nominal mount, where that is known.
    """
    motion = motion_of(run, turned)
    sensors = {name: observe_sensor(run, name, motion, thresholds, superseded) for name in run.measuring(RATE)}
    return ObservedRun(run, motion, sensors)


def observe_runs(runs: Sequence[RunData], turned: Mapping[int, Array] = AS_STATED) -> tuple[ObservedRun, ...]:
    """Every recording of one run that adds a finished sweep or dwell; one that several hold counts in the last one.

    The thresholds are those of the first recording; `turned` is as of `observe_run`, by the stage of the procedure.
    Raises as `turner_of`; Fault as `observe_run` does.
    """
    for run in runs:
        turner_of(run)
    recordings = [
        observe_run(run, runs[0].settings.observation, _repeated(runs, place), turned.get(run.settings.stage))
        for place, run in enumerate(runs)
        if _finished(run) - _repeated(runs, place)
    ]
    offsets_s = _clock_offsets_s(recordings)
    return tuple(
        replace(recording, clock_offset_s=offset_s) for recording, offset_s in zip(recordings, offsets_s, strict=True)
    )


def _clock_offsets_s(recordings: Sequence[ObservedRun]) -> list[float]:
    """Return what takes the times of each recording to the clock of the first: the controller may have been off.

    No recording begins before the last one has ended, whatever the computer's clock says: it may have been set, and an
    accelerated laboratory's time passes faster.
    """
    offsets_s = [0.0] * bool(recordings)
    for last, recording in pairwise(recordings):
        first_s = float(recordings[0].motion.time_s[0])
        by_computer_s = (_started(recording) - _started(recordings[0])).total_seconds() + first_s
        ended_s = float(last.motion.time_s[-1]) + offsets_s[-1]
        offsets_s.append(max(by_computer_s, ended_s) - float(recording.motion.time_s[0]))
    return offsets_s


def _started(recording: ObservedRun) -> datetime:
    return datetime.fromisoformat(recording.run.provenance.started_utc)


def _repeated(runs: Sequence[RunData], place: int) -> frozenset[int]:
    """The sweeps and dwells that recordings after the one at a place may hold as well: those of the same stage."""
    stage = runs[place].settings.stage
    return frozenset[int]().union(*(_finished(run) for run in runs[place + 1 :] if run.settings.stage == stage))


def _finished(run: RunData) -> frozenset[int]:
    return finished_sweeps(run) | finished_dwells(run)
