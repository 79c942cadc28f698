"""A recorded run, converted to events at the controller's times."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from rig.analysis.check import Check
from rig.analysis.partial_results import so_far
from rig.data.recording.recorded_events import (
    DwellFinished,
    DwellStarted,
    RestFinished,
    RestStarted,
    SweepFinished,
    SweepStarted,
)
from rig.data.recording.run_data import RunData
from rig.data.result_file import ResultDocument
from rig.motion.state_rows import ARM_STATE_DTYPE
from rig.motion.steps import Dwell, Plan, Rest, Step, Sweep
from rig.motion.turner_state import ArmState, JointState, State
from rig.page.rows import Look, look_of
from rig.station.events import (
    ArmSeen,
    Checked,
    PhaseStarted,
    Progress,
    RunEvent,
    SamplesTaken,
    SensorSamples,
    StepFinished,
    StepStarted,
    VerdictReached,
)

FRAME_S = 0.1  # interval of the frames, in the recording's time
MEAN_SAMPLES = 8  # the newest, in a displayed mean


@dataclass(frozen=True, slots=True)
class Moment:
    """An event `at_s` seconds after the recording began, by the controller's clock."""

    at_s: float
    event: RunEvent | Look


@dataclass(frozen=True, slots=True)
class _Done:
    """A recorded step, between two controller times."""

    number: int
    step: Step
    start_s: float
    end_s: float


def moments(run: RunData) -> Iterator[Moment]:
    """Yield the events of a recording with their times, in order; nothing if it has no state of the turner."""
    if len(run.states) == 0:
        return
    times_s = run.states["time_s"]
    start_s, end_s = float(times_s[0]), float(times_s[-1])
    steps = _list_steps(run, end_s)
    plan = Plan(tuple(done.step for done in steps), _state(run.states[0]).q_rad, run.settings.home_q_rad)
    modes: dict[str, str] = {name: sensor.mode for name, sensor in run.sensors.items()}
    raw = "calibrated" not in modes.values()
    yield Moment(0.0, PhaseStarted(run.settings.procedure, plan, modes))
    samples = {name: _ReplayedSamples(run, name) for name in run.sensors}

    def samples_until(host_time_s: float) -> tuple[SensorSamples, ...]:
        return tuple(sensor_samples.until(host_time_s) for sensor_samples in samples.values())

    events = sorted(_iterate_events(run, steps), key=lambda moment: moment[0])
    for time_s in [*np.arange(start_s, end_s, FRAME_S).tolist(), end_s]:
        while events and events[0][0] <= time_s:
            _, event = events.pop(0)
            yield Moment(time_s - start_s, event)
            if raw and isinstance(event, StepFinished) and isinstance(event.step, Sweep | Dwell):
                yield Moment(time_s - start_s, look_of(so_far([_cut_at(run, time_s)])))
        index = min(int(np.searchsorted(times_s, time_s)), len(run.states) - 1)
        state = _state(run.states[index])
        yield Moment(time_s - start_s, SamplesTaken(samples_until(state.host_time_s)))
        yield Moment(time_s - start_s, ArmSeen(state, None))
        if under_way := [done for done in steps if done.start_s <= time_s]:
            yield Moment(
                time_s - start_s,
                _progress(under_way[-1], len(steps), state, time_s=time_s, start_s=start_s, end_s=end_s),
            )
    yield Moment(end_s - start_s, SamplesTaken(samples_until(np.inf)))


def end_events(result: ResultDocument) -> Iterator[RunEvent]:
    """Yield the checks and the verdict of a finished run as events."""
    for c in result.checks:
        yield Checked(Check(c.name, c.value, c.limit, c.unit, c.means, c.uncertainty, c.guard_band))
    yield VerdictReached(result.verdict == "pass")


def _list_steps(run: RunData, end_s: float) -> list[_Done]:
    """Return the sweeps, rests and dwells of a recording, including interrupted ones."""
    done: list[_Done] = []
    for recorded in run.events:
        event, time_s = recorded.event, recorded.controller_time_s
        if time_s is None:
            continue
        step: Step | None = None
        match event:
            case SweepStarted(sweep):
                step = sweep
            case RestStarted():
                step = Rest("rest", 0.0)
            case DwellStarted(dwell):
                step = dwell
            case SweepFinished() | RestFinished() | DwellFinished() if done:
                done[-1] = replace(done[-1], end_s=time_s)
        if step is not None:
            done.append(_Done(len(done) + 1, step, time_s, end_s))
    return [replace(recorded, step=_set_rest_duration(recorded)) for recorded in done]


def _set_rest_duration(done: _Done) -> Step:
    """Return the step; a rest gets its duration, which the recording does not state."""
    return Rest("rest", done.end_s - done.start_s) if isinstance(done.step, Rest) else done.step


def _iterate_events(run: RunData, steps: Sequence[_Done]) -> Iterator[tuple[float, RunEvent]]:
    for done in steps:
        yield done.start_s, StepStarted(done.number, len(steps), done.step)
        yield done.end_s, StepFinished(done.number, len(steps), done.step, done.end_s - done.start_s)
    for recorded in run.events:
        if recorded.controller_time_s is not None and not isinstance(recorded.event, _OF_STEPS):
            yield recorded.controller_time_s, recorded.event


_OF_STEPS = (SweepStarted, SweepFinished, RestStarted, RestFinished, DwellStarted, DwellFinished)


def _cut_at(run: RunData, time_s: float) -> RunData:
    """Return the recording with the events up to `time_s`."""
    return replace(run, events=tuple(e for e in run.events if (e.controller_time_s or 0.0) <= time_s))


def _progress(done: _Done, count: int, state: State, *, time_s: float, start_s: float, end_s: float) -> Progress:
    """Return the progress at `time_s` in the step `done`, one of `count` steps of a run from `start_s` to `end_s`."""
    took_s = done.end_s - done.start_s
    return Progress(
        number=done.number,
        count=count,
        step=done.step,
        fraction=min(1.0, (time_s - done.start_s) / took_s) if took_s > 0 else 1.0,
        elapsed_s=time_s - start_s,
        remaining_s=max(0.0, end_s - time_s),
        arm_speed_rad_s=max(map(abs, state.qd_rad_s), default=0.0),
    )


def _state(row: Any) -> State:
    """Return a recorded state: an arm's state if it has all its fields, else one of joints only."""
    values: dict[str, Any] = {name: row[name].tolist() for name in row.dtype.names}
    joints: dict[str, Any] = {name: tuple(values.get(name, ())) for name in ("q_rad", "qd_rad_s")}
    if row.dtype == ARM_STATE_DTYPE:
        return ArmState(**{**values, **joints})
    return JointState(values["time_s"], values["host_time_s"], **joints)


class _ReplayedSamples:
    """One sensor's recorded samples; `until` summarises those up to a time."""

    def __init__(self, run: RunData, name: str) -> None:
        self._name, self._samples = name, run.samples[name]
        self._sensor = run.sensors[name]

    def until(self, host_time_s: float) -> SensorSamples:
        count = int(np.searchsorted(self._samples["host_time_s"], host_time_s, side="right"))
        newest = self._samples[max(0, count - MEAN_SAMPLES) : count]
        if count == 0:
            return SensorSamples(self._name, 0, 0, {})
        return SensorSamples(self._name, count, int(newest["sequence"][-1]) + 1 - count, self._sensor.means(newest))
