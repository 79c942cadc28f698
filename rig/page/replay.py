"""A recorded run as the events it was, in the controller's time, for whoever looks on later."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from rig.analysis.check import Check
from rig.analysis.partial_results import so_far
from rig.data.recording.events import (
    DwellFinished,
    DwellStarted,
    RestFinished,
    RestStarted,
    SweepFinished,
    SweepStarted,
)
from rig.data.recording.run_file import RunData
from rig.data.result_file import ResultDocument
from rig.motion.state import ARM_STATE_DTYPE, ArmState, JointState, State
from rig.motion.steps import Dwell, Plan, Rest, Step, Sweep
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

FRAME_S = 0.1  # between two looks at what was recorded
NEWEST = 8  # samples whose mean is shown


@dataclass(frozen=True, slots=True)
class Moment:
    """What happened `at_s` seconds after the recording began, by the controller's clock."""

    at_s: float
    event: RunEvent | Look


@dataclass(frozen=True, slots=True)
class _Done:
    """A step that was recorded, between two controller times."""

    number: int
    step: Step
    start_s: float
    end_s: float


def moments(run: RunData) -> Iterator[Moment]:
    """All of one recording in its order; nothing of one in which no state of the turner is."""
    if len(run.states) == 0:
        return
    times_s = run.states["time_s"]
    began_s, ended_s = float(times_s[0]), float(times_s[-1])
    steps = _steps(run, ended_s)
    plan = Plan(tuple(each.step for each in steps), _state(run.states[0]).q_rad, run.settings.home_q_rad)
    modes: dict[str, str] = {name: sensor.mode for name, sensor in run.sensors.items()}
    raw = "calibrated" not in modes.values()
    yield Moment(0.0, PhaseStarted(run.settings.procedure, plan, modes))
    samples = {name: _Samples(run, name) for name in run.sensors}

    def seen(host_time_s: float) -> tuple[SensorSamples, ...]:
        return tuple(each.until(host_time_s) for each in samples.values())

    happened = sorted(_happened(run, steps), key=lambda moment: moment[0])
    for time_s in [*np.arange(began_s, ended_s, FRAME_S).tolist(), ended_s]:
        while happened and happened[0][0] <= time_s:
            _, event = happened.pop(0)
            yield Moment(time_s - began_s, event)
            if raw and isinstance(event, StepFinished) and isinstance(event.step, Sweep | Dwell):
                yield Moment(time_s - began_s, look_of(so_far([_until(run, time_s)])))
        place = min(int(np.searchsorted(times_s, time_s)), len(run.states) - 1)
        state = _state(run.states[place])
        yield Moment(time_s - began_s, SamplesTaken(seen(state.host_time_s)))
        yield Moment(time_s - began_s, ArmSeen(state, None))
        if under_way := [each for each in steps if each.start_s <= time_s]:
            yield Moment(
                time_s - began_s,
                _progress(under_way[-1], len(steps), state, time_s=time_s, began_s=began_s, ended_s=ended_s),
            )
    yield Moment(ended_s - began_s, SamplesTaken(seen(np.inf)))


def ended(result: ResultDocument) -> Iterator[RunEvent]:
    """What was told when the run had its result."""
    for each in result.checks:
        yield Checked(
            Check(each.name, each.value, each.limit, each.unit, each.means, each.uncertainty, each.guard_band)
        )
    yield VerdictReached(result.verdict == "pass")


def _steps(run: RunData, ended_s: float) -> list[_Done]:
    """The sweeps, rests and dwells of a recording; one without an end was interrupted."""
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
            done.append(_Done(len(done) + 1, step, time_s, ended_s))
    return [replace(each, step=_lasting(each)) for each in done]


def _lasting(done: _Done) -> Step:
    """A rest does not say in the recording how long it was meant to be."""
    return Rest("rest", done.end_s - done.start_s) if isinstance(done.step, Rest) else done.step


def _happened(run: RunData, steps: Sequence[_Done]) -> Iterator[tuple[float, RunEvent]]:
    for each in steps:
        yield each.start_s, StepStarted(each.number, len(steps), each.step)
        yield each.end_s, StepFinished(each.number, len(steps), each.step, each.end_s - each.start_s)
    for recorded in run.events:
        if recorded.controller_time_s is not None and not isinstance(recorded.event, _OF_STEPS):
            yield recorded.controller_time_s, recorded.event


_OF_STEPS = (SweepStarted, SweepFinished, RestStarted, RestFinished, DwellStarted, DwellFinished)


def _until(run: RunData, time_s: float) -> RunData:
    """The recording as it was then, as far as steps go."""
    return replace(run, events=tuple(e for e in run.events if (e.controller_time_s or 0.0) <= time_s))


def _progress(done: _Done, count: int, state: State, *, time_s: float, began_s: float, ended_s: float) -> Progress:
    took_s = done.end_s - done.start_s
    return Progress(
        number=done.number,
        count=count,
        step=done.step,
        fraction=min(1.0, (time_s - done.start_s) / took_s) if took_s > 0 else 1.0,
        elapsed_s=time_s - began_s,
        remaining_s=max(0.0, ended_s - time_s),
        arm_speed_rad_s=max(map(abs, state.qd_rad_s), default=0.0),
    )


def _state(row: Any) -> State:
    """A state as it was recorded: an arm's where it tells what such states tell, else what the joints did."""
    values: dict[str, Any] = {name: row[name].tolist() for name in row.dtype.names}
    joints = {name: tuple(values.get(name, ())) for name in ("q_rad", "qd_rad_s")}
    if row.dtype == ARM_STATE_DTYPE:
        return ArmState(**{**values, **joints})
    return JointState(values["time_s"], values["host_time_s"], **joints)


class _Samples:
    """One sensor's samples as they had come by some time."""

    def __init__(self, run: RunData, name: str) -> None:
        self._name, self._samples = name, run.samples[name]
        self._sensor = run.sensors[name]

    def until(self, host_time_s: float) -> SensorSamples:
        count = int(np.searchsorted(self._samples["host_time_s"], host_time_s, side="right"))
        newest = self._samples[max(0, count - NEWEST) : count]
        if count == 0:
            return SensorSamples(self._name, 0, 0, {})
        return SensorSamples(self._name, count, int(newest["sequence"][-1]) + 1 - count, self._sensor.means(newest))
