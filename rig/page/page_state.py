"""What the page shows, made of a run's events. No thread, no clock, and of files only the result that is told of."""

from collections.abc import Iterator
from dataclasses import asdict
from typing import Any

from rig.analysis.check import Check
from rig.data.installed_kinds import measured
from rig.data.quantity import TEMPERATURE, Quantity, Scalar, Unit, select_displayed
from rig.data.recording.events import BoardNotObserved, BoardObserved
from rig.data.recording.hand_events import (
    HandAsked,
    HandBegunAnew,
    HandMoveRefused,
    HandMoveTaken,
    HandRested,
    HandRestRefused,
)
from rig.data.result_file import read_result
from rig.data.run_folder import CERTIFICATE, RESULT
from rig.motion.geometry import NOMINAL
from rig.motion.steps import Dwell, Rest, Step, Sweep
from rig.page import by_hand
from rig.page.about import About
from rig.page.arm import connected, geometry, stance
from rig.page.history import History, rounded
from rig.page.outcome import after_fault, after_verdict, outcome_rows, since_rows
from rig.page.rows import Look, along, dwell_row, observation_row, parameter_rows
from rig.report.words.mounts import mount_lines
from rig.station.events import (
    Advice,
    Answered,
    ArmConnected,
    ArmSeen,
    AttitudeRead,
    CalibrationStored,
    Checked,
    Crashed,
    DocumentWritten,
    Failed,
    HandSeen,
    Interrupted,
    ObservationMade,
    PhaseRecorded,
    PhaseStarted,
    PreflightPassed,
    Progress,
    Prompt,
    Remembered,
    RunEvent,
    SamplesTaken,
    SensorSamples,
    StepFinished,
    StepStarted,
    VerdictReached,
)
from rig.station.words import line

LINES = 40  # of what was said last
ENDINGS = (VerdictReached, Failed, Interrupted, Crashed)


class Shown:
    """The page's sections by name, each of plain numbers and texts, and the `changed` ones since somebody looked.

    Samples, states and progress come fifty times a second, and somebody looks ten times: the newest are kept as they
    came, and made into sections by `sections`.
    """

    def __init__(self, about: About) -> None:
        self._sections: dict[str, Any] = {
            "about": asdict(about),
            "state": {"kind": "connecting", "text": "Connecting to arm and board"},
            "step": None,
            "arm": {**geometry(NOMINAL), **about.arm},
            "sensors": [],
            "prompt": None,
            "hand": None,
            "observations": [],
            "parameters": [],
            "checks": [],
            "lines": [],
            "certificate": False,
            "outcome": [],
            "mounts": [],
            "since": None,
            "next": None,
            "ended": None,
        }
        self.history = History()
        self._changed: set[str] = set(self._sections)
        self._about, self._parts = about, about.parts
        self._checks: list[Check] = []
        self._stored = False
        self._modes: dict[str, str] = {}
        self._samples: tuple[SensorSamples, ...] = ()
        self._fresh = False  # the samples are newer than the arm's state
        self._newest: dict[type, SamplesTaken | ArmSeen | Progress | HandSeen] = {}  # not in the sections yet
        self._seen: dict[tuple[str, int], dict[str, Any]] = {}
        self._turns: dict[int, dict[str, Any]] = {}
        self._prompts = 0
        self._solved = False
        self.ended = False

    @property
    def sections(self) -> dict[str, Any]:
        """Everything as it is now."""
        for event in self._newest.values():
            match event:
                case SamplesTaken(sensors):
                    self.put("sensors", [self._row_of(sensor) for sensor in sensors])
                case ArmSeen(state, missed_states):
                    self.put("arm", {**self._sections["arm"], **stance(state), "missed": missed_states})
                case Progress():
                    self.put("step", _progress(event))
                case HandSeen():
                    self.put("hand", {**(self._sections["hand"] or {}), **by_hand.seen(event)})
                    self.put("step", by_hand.step(event))
        self._newest.clear()
        return self._sections

    def changed(self) -> dict[str, Any]:
        """The sections that have changed since this was asked last."""
        sections = self.sections
        changed = {name: sections[name] for name in self._changed}
        self._changed.clear()
        return changed

    def put(self, name: str, value: Any) -> None:
        """Replace a section."""
        self._sections[name] = value
        self._changed.add(name)

    def take(self, event: RunEvent) -> None:
        """Show what has happened."""
        match event:
            case SamplesTaken(sensors):
                self._newest[SamplesTaken] = event
                self._samples, self._fresh = sensors, True
            case ArmSeen(state):
                self._newest[ArmSeen] = event
                # The arm is seen once more when it was let go, and no sample came with that.
                if self._fresh and self.history.due(state.time_s):
                    self.history.add(state.time_s, _values(self._samples))
                self._fresh = False
            case Progress():
                self._newest[Progress] = event
            case HandAsked() | HandRested() | HandMoveTaken() | HandMoveRefused() | HandRestRefused() | HandBegunAnew():
                self.put("hand", by_hand.told(self.sections["hand"] or {}, event))
                if isinstance(event, HandAsked):
                    self._state("by_hand", event.instruction.words)
                self._said(event)
            case HandSeen(time_s=time_s):
                self._newest[HandSeen] = event
                if self._fresh and self.history.due(time_s):
                    self.history.add(time_s, _values(self._samples))
                self._fresh = False
            case _:
                self._told(event)
                self._said(event)

    def _said(self, event: RunEvent) -> None:
        if (text := line(event)) is not None:
            self.put("lines", [*self.sections["lines"], text][-LINES:])

    def look(self, look: Look) -> None:
        """What the recording so far amounts to: each sweep's observation or refusal, and the parameters."""
        for each in look.observations:
            self._observation(each)
        if not self._solved:
            self.put("parameters", look.parameters)

    def _told(self, event: RunEvent) -> None:
        """What happens once, after all that came before is in the sections."""
        sections = self.sections
        match event:
            case ArmConnected(report):
                self.put("arm", {**sections["arm"], **connected(report)})
            case PhaseStarted(procedure, plan, sensors):
                self._modes = sensors
                self._turns = {each.index: _turn(each) for each in plan.sweeps}
                self.history.clear()
                self._samples = ()
                self.put("sensors", [])
                self.put("step", {"number": 0, "count": len(plan.steps), "name": procedure, "kind": "waiting",
                                  "fraction": 0.0, "elapsed_s": 0.0, "remaining_s": plan.duration_s})  # fmt: skip
                self._state("connected", f"Before the first motion of {procedure}")
            case PreflightPassed():
                self._state("ready", "Pre-flight passed: plan and arm are within limits")
            case Prompt(announcement, to_do, to_tick):
                self._prompts += 1
                asked = {"announcement": list(announcement), "to_do": to_do, "to_tick": to_tick}
                self.put("prompt", {"number": self._prompts, **asked})
                self._state("asking", "The operator is asked")
            case Answered(agreed):
                self.put("prompt", None)
                self._state("ready", "The operator agreed" if agreed else "The operator did not agree")
            case StepStarted(number, count, step):
                self.put("step", {**(sections["step"] or {}), **_place(number, count, step)})
                self._state(_kind(step), step.name)
            case StepFinished():
                self._state("ready", "Between two steps")
            case PhaseRecorded(sensors, _):
                self.put("sensors", [self._row_of(sensor) for sensor in sensors])
                self.put("hand", None)
                self._state("judging", "Recorded; averaging, solving, judging")
            case BoardObserved(sensor, sweep, speed_rad_s, observation):
                seen = {"sensor": sensor, "sweep": sweep, "by": "board", "speed_rad_s": speed_rad_s}
                self._observation({**seen, "mean_rad_s": rounded(observation.mean_rad_s)})
            case BoardNotObserved(sensor, sweep, reason):
                self._observation({"sensor": sensor, "sweep": sweep, "by": "board", "refused": reason})
            case ObservationMade() | AttitudeRead():
                self._observation(_row(event))
            case _:
                self._ended(event)

    def _ended(self, event: RunEvent) -> None:
        """What is told when nothing moves any more."""
        match event:
            case Checked(check):
                self._checks.append(check)
                row = {
                    name: getattr(check, name) for name in ("name", "value", "limit", "unit", "uncertainty", "passed")
                }
                self.put("checks", [*self.sections["checks"], row])
            case VerdictReached(passed):
                held = sum(check["passed"] for check in self.sections["checks"])
                text = f"{held} of {len(self.sections['checks'])} checks passed"
                self._state("passed" if passed else "failed", text)
                self.put("next", after_verdict(self._about, self._checks, passed=passed, stored=self._stored))
            case CalibrationStored():
                self._stored = True
            case Remembered(since=since):
                self.put("since", since_rows(since))
            case DocumentWritten(path) if path.name == CERTIFICATE:
                self.put("certificate", True)
            case DocumentWritten(path) if path.name == RESULT:
                result = read_result(path)
                self.put("parameters", parameter_rows(result))
                self.put("outcome", outcome_rows(result, self._parts))
                self.put("mounts", list(mount_lines(result)))
                self._solved = True
            case Failed(error):
                self._state("refused" if error.exit_status == 2 else "fault", str(error))
            case Interrupted(text):
                self._state("stopped", text)
            case Crashed(traceback):
                self._state("fault", f"A defect of the program: {traceback.strip().splitlines()[-1]}")
            case Advice(_, command, repeats):
                self.put("next", after_fault(command, repeats=repeats))
        if isinstance(event, ENDINGS):
            self.ended = True
            self.put("hand", None)
            self.put("prompt", None)

    def _state(self, kind: str, text: str) -> None:
        self.put("state", {"kind": kind, "text": text})

    def _row_of(self, sensor: SensorSamples) -> dict[str, Any]:
        return {
            "name": sensor.sensor,
            "part": self._parts.get(sensor.sensor, ""),
            "mode": self._modes.get(sensor.sensor, "raw"),
            "samples": sensor.samples,
            "lost": sensor.lost,
            "temperature_c": next(iter(sensor.latest.get(TEMPERATURE.name, ())), None),
            "units": {of.named(of.name): [of.name, shown.name] for of, shown in _quantities(sensor)},
        }

    def _observation(self, row: dict[str, Any]) -> None:
        """The host's own takes the place of what the board said of the same sweep, never the other way."""
        key = row["sensor"], row["sweep"]
        before = self._seen.get(key, {})
        if before.get("by") != "host" or row["by"] == "host":
            self._seen[key] = {**self._turns.get(row["sweep"], {}), **before, **row}
            self.put("observations", [self._seen[each] for each in sorted(self._seen, key=lambda k: (k[1], k[0]))])


def _quantities(sensor: SensorSamples) -> Iterator[tuple[Quantity | Scalar, Unit]]:
    """What a sensor sends, and the unit it is shown in: that of its bias."""
    known = measured()
    for of in (known[name] for name in select_displayed(sensor.latest)):
        yield of, of.bias if isinstance(of, Quantity) else of.reading


def _values(sensors: tuple[SensorSamples, ...]) -> dict[str, tuple[float, ...]]:
    """The newest readings, by the name of their line."""
    return {
        f"{sensor.sensor}.{of.named(of.name)}": tuple(each / shown.size for each in sensor.latest[of.name])
        for sensor in sensors
        for of, shown in _quantities(sensor)
    }


def _row(made: ObservationMade | AttitudeRead) -> dict[str, Any]:
    if isinstance(made, ObservationMade):
        return observation_row(made.sensor, made.observation)
    return dwell_row(made.read)


def _turn(sweep: Sweep) -> dict[str, Any]:
    return {"joint": sweep.joint_name, "direction": sweep.direction, "along": along(sweep.axis_flange)}


def _kind(step: Step) -> str:
    return {Sweep: "measuring", Dwell: "measuring", Rest: "resting"}.get(type(step), "moving")


def _place(number: int, count: int, step: Step) -> dict[str, Any]:
    return {"number": number, "count": count, "name": step.name, "kind": _kind(step)}


def _progress(progress: Progress) -> dict[str, Any]:
    return {
        **_place(progress.number, progress.count, progress.step),
        "fraction": round(progress.fraction, 4),
        "elapsed_s": round(progress.elapsed_s, 2),
        "remaining_s": round(progress.remaining_s, 2),
    }
