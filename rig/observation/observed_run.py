"""An observed recording: the arm's motion, and each sensor's time base, revolutions and rests."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from datetime import datetime
from itertools import pairwise
from types import MappingProxyType
from typing import TYPE_CHECKING

import numpy as np

from rig.data.quantity import RATE, Quantity
from rig.data.recording.run_data import RunData
from rig.data.recording.settings import ObservationThresholds
from rig.errors import name_sensor
from rig.estimation.arrays import Array, median
from rig.observation.average import Stream, convert_stream
from rig.observation.clocks.time_base import TimeBase
from rig.observation.finished_steps import complete_dwells, complete_sweeps
from rig.observation.motion.arm_motion import ArmMotion, motion_of, turner_of
from rig.observation.observe import SensorObservations, observe_sensor

if TYPE_CHECKING:
    from rig.estimation.temperature.temperature_polynomials import OverTemperature

NO_ROTATIONS: Mapping[int, Array] = MappingProxyType({})  # every stage is mounted as its settings say


@dataclass(frozen=True, slots=True)
class Delay:
    """The delay of one sensor's filter relative to another's, s, and its standard deviation."""

    delay_s: float
    std_s: float


@dataclass(frozen=True, slots=True)
class ObservedRun:
    """One recording with the observations of its `sensors`, by name.

    If there are `polynomials` of a sensor, they correct its readings to one temperature. `clock_offset_s` converts the
    recording's times to the clock of the run's first recording.
    """

    run: RunData
    motion: ArmMotion
    sensors: Mapping[str, SensorObservations]
    polynomials: Mapping[str, Mapping[Quantity, "OverTemperature"]] = field(default_factory=dict)
    clock_offset_s: float = 0.0

    def stream(self, sensor: str) -> Stream:
        """Return a sensor's samples in rad/s on the arm's clock."""
        stream = convert_stream(self.run.samples[sensor], self.run.sensors[sensor], self.sensors[sensor].time_base)
        return stream.correct_to_reference(self.polynomials[sensor]) if sensor in self.polynomials else stream

    def time_s(self, sensor: str, gyroscope: str | None = None) -> Array:
        """Return the times (n,) of all samples of a sensor on the arm's clock.

        The time base of `gyroscope` converts the times. The default is the sensor's own time base or, without one, the
        time base of the first gyroscope on the same clock. If there is none at all, arrival times at the computer
        relate samples to arm states, to within milliseconds.
        """
        bases = {name: observations.time_base for name, observations in self.sensors.items()}
        return times_s(self.run, sensor, bases, gyroscope)

    def delay(self, sensor: str, behind: str) -> Delay | None:
        """Return the delay of `sensor` against the sensor `behind`; None unless one clock stamps the samples of both.

        With one clock, the time bases of both differ only by the delays of their filters.
        """
        if not all(self.run.sensors[name].on_board for name in (sensor, behind)):
            return None
        late, reference = self.sensors[sensor].time_base, self.sensors[behind].time_base
        middle = np.array([reference.reference_s])
        delay_s = float(reference.controller_time_s(middle)[0] - late.controller_time_s(middle)[0])
        return Delay(delay_s, float(np.hypot(reference.offset_std_s, late.offset_std_s)))


def one_clock(run: RunData, sensor: str, other: str) -> bool:
    """Return whether one clock stamps the samples of both sensors of a recording."""
    return run.sensors[sensor].clock == run.sensors[other].clock


def times_s(run: RunData, sensor: str, bases: Mapping[str, TimeBase], gyroscope: str | None = None) -> Array:
    """Return the times (n,) of all samples of a sensor on the arm's clock, by the gyroscopes' time bases.

    See `ObservedRun.time_s` for the choice among `bases`.
    """
    samples = run.samples[sensor]
    stamps_s: Array = samples["board_time_us"] * 1e-6
    candidates = (gyroscope, sensor) if gyroscope else (sensor, *bases)
    base = next((name for name in candidates if name in bases and one_clock(run, sensor, name)), None)
    if base is not None:
        return bases[base].controller_time_s(stamps_s)
    came_s = np.interp(samples["host_time_s"], run.states["host_time_s"], run.states["time_s"])
    return stamps_s + median(came_s - stamps_s) if len(stamps_s) else stamps_s


def observe_run(
    run: RunData, thresholds: ObservationThresholds, superseded: Collection[int] = (), correction: Array | None = None
) -> ObservedRun:
    """Return a recording with the observations of every gyroscope.

    Raise Fault as `motion_of` and `observe_sensor` do. `correction` (3, 3): rotation of the item from its nominal
    mount, if determined.
    """
    motion = motion_of(run, correction)
    sensors = dict[str, SensorObservations]()
    for name in run.measuring(RATE):
        with name_sensor(name, run.sensors):
            sensors[name] = observe_sensor(run, name, motion, thresholds, superseded)
    return ObservedRun(run, motion, sensors)


def observe_runs(runs: Sequence[RunData], corrections: Mapping[int, Array] = NO_ROTATIONS) -> tuple[ObservedRun, ...]:
    """Return the observations of each recording with a finished sweep or dwell; if one was repeated, the last counts.

    The first recording's thresholds apply to all. `corrections` contains, by stage of the procedure, the rotation
    (3, 3) of the item from its nominal mount. Raise as `turner_of` does, and Fault as `observe_run` does.
    """
    for run in runs:
        turner_of(run)
    recordings = [
        observe_run(
            run, runs[0].settings.observation, _find_superseded(runs, index), corrections.get(run.settings.stage)
        )
        for index, run in enumerate(runs)
        if _complete_steps(run) - _find_superseded(runs, index)
    ]
    offsets_s = _clock_offsets_s(recordings)
    return tuple(
        replace(recording, clock_offset_s=offset_s) for recording, offset_s in zip(recordings, offsets_s, strict=True)
    )


def _clock_offsets_s(recordings: Sequence[ObservedRun]) -> list[float]:
    """Return the number of seconds to add to each recording's times for times on the first recording's clock.

    The clocks differ if the controller restarted in between. The computer's clock relates them. But a recording begins
    after the previous one has ended, even if the computer's clock disagrees, because that clock may have been set, or
    the arm may be simulated faster than real time.
    """
    offsets_s = [0.0] * bool(recordings)
    for last, recording in pairwise(recordings):
        first_s = float(recordings[0].motion.time_s[0])
        by_computer_s = (_start_time(recording) - _start_time(recordings[0])).total_seconds() + first_s
        ended_s = float(last.motion.time_s[-1]) + offsets_s[-1]
        offsets_s.append(max(by_computer_s, ended_s) - float(recording.motion.time_s[0]))
    return offsets_s


def _start_time(recording: ObservedRun) -> datetime:
    return datetime.fromisoformat(recording.run.provenance.started_utc)


def _find_superseded(runs: Sequence[RunData], index: int) -> frozenset[int]:
    """Return the sweeps and dwells that recordings after `index`, of the same stage, contain completely."""
    stage = runs[index].settings.stage
    return frozenset[int]().union(*(_complete_steps(run) for run in runs[index + 1 :] if run.settings.stage == stage))


def _complete_steps(run: RunData) -> frozenset[int]:
    return complete_sweeps(run) | complete_dwells(run)
