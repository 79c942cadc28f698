"""The state of the page, built from a run's events alone: no threads, no clock, only files that events name."""

from collections.abc import Iterator
from dataclasses import asdict
from typing import Any

from rig.analysis.check import Check
from rig.data.installed_kinds import channel_contents
from rig.data.quantity import TEMPERATURE, DisplayUnit, Quantity, Scalar, select_displayed
from rig.data.recording.hand_events import HandAsked, HandEvent
from rig.data.recording.recorded_events import BoardNotObserved, BoardObserved
from rig.data.result_file import ResultDocument, read_result
from rig.data.run_folder import CERTIFICATE, RESULT, TRUTH_FILE
from rig.motion.geometry import NOMINAL
from rig.motion.steps import Dwell, Rest, Step, Sweep
from rig.page import by_hand
from rig.page.about import About
from rig.page.arm import geometry, stance, turner_section
from rig.page.outcome_screen import after_fault, after_verdict, outcome_rows, since_rows
from rig.page.recent_readings import PageHistory, round_digits
from rig.page.rows import Look, dwell_row, observation_row, parameter_rows, projection
from rig.report.simulated_truth import truth_rows
from rig.report.words.mounting_words import mount_lines
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

LOG_LINES = 40  # the newest, which are shown
ENDING_EVENTS = (VerdictReached, Failed, Interrupted, Crashed)


class PageState:
    """The page's sections by name, in plain numbers and texts, and the `changed` ones since the last request.

    Samples, states and progress come fifty times a second, but the sections are requested ten times a second. So only
    the newest are stored, and `sections` converts them.
    """

    def __init__(self, about: About) -> None:
        """Fill every section with its content before the first event of the run."""
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
        self.history = PageHistory()
        self._changed: set[str] = set(self._sections)
        self._about, self._parts = about, about.parts
        self._checks: list[Check] = []
        self._stored = False
        self._modes: dict[str, str] = {}
        self._samples: tuple[SensorSamples, ...] = ()
        self._fresh = False  # whether samples have come since the arm's newest state
        self._newest: dict[type, SamplesTaken | ArmSeen | Progress | HandSeen] = {}  # not yet in the sections
        self._observations: dict[tuple[str, int], dict[str, Any]] = {}
        self._turns: dict[int, dict[str, Any]] = {}
        self._prompts = 0
        self._solved = False
        self._result: ResultDocument | None = None
        self.ended = False

    @property
    def sections(self) -> dict[str, Any]:
        """All sections as they are now."""
        for event in self._newest.values():
            match event:
                case SamplesTaken(sensors):
                    self.put("sensors", [self._row_of(sensor) for sensor in sensors])
                case ArmSeen(state, missed_states):
                    self.put("arm", {**self._sections["arm"], **stance(state), "missed": missed_states})
                case Progress():
                    self.put("step", _progress(event))
                case HandSeen():
                    self.put("hand", {**(self._sections["hand"] or {}), **by_hand.live_section(event)})
                    self.put("step", by_hand.step(event))
        self._newest.clear()
        return self._sections

    def changed(self) -> dict[str, Any]:
        """Return the sections that have changed since the last call."""
        sections = self.sections
        changed = {name: sections[name] for name in self._changed}
        self._changed.clear()
        return changed

    def put(self, name: str, value: Any) -> None:
        """Replace a section."""
        self._sections[name] = value
        self._changed.add(name)

    def take(self, event: RunEvent) -> None:
        """Update the sections by an event."""
        match event:
            case SamplesTaken(sensors):
                self._newest[SamplesTaken] = event
                self._samples, self._fresh = sensors, True
            case ArmSeen(state):
                self._newest[ArmSeen] = event
                # When the arm is released, one more state comes, without samples.
                self._add_readings(state.time_s)
            case Progress():
                self._newest[Progress] = event
            case _ if isinstance(event, HandEvent):
                self.put("hand", by_hand.update(self.sections["hand"] or {}, event))
                if isinstance(event, HandAsked):
                    self._state("by_hand", event.instruction.words)
                self._add_line(event)
            case HandSeen(time_s=time_s):
                self._newest[HandSeen] = event
                self._add_readings(time_s)
            case _:
                self._take_once(event)
                self._add_line(event)

    def _add_readings(self, time_s: float) -> None:
        if self._fresh and self.history.due(time_s):
            self.history.add(time_s, _values(self._samples))
        self._fresh = False

    def _add_line(self, event: RunEvent) -> None:
        if (text := line(event)) is not None:
            self.put("lines", [*self.sections["lines"], text][-LOG_LINES:])

    def look(self, look: Look) -> None:
        """Show the analysis of the recordings so far: each sweep's observation or refusal, and the parameters."""
        for row in look.observations:
            self._observation(row)
        if not self._solved:
            self.put("parameters", look.parameters)

    def _take_once(self, event: RunEvent) -> None:
        """Update the sections by an event that is not repeated many times a second."""
        sections = self.sections
        match event:
            case ArmConnected(report):
                self.put("arm", {**sections["arm"], **turner_section(report)})
            case PhaseStarted(procedure, plan, sensors):
                self._modes = sensors
                self._turns = {
                    sweep.index: {
                        "joint": sweep.joint_name,
                        "direction": sweep.direction,
                        "along": projection(sweep.axis_flange),
                    }
                    for sweep in plan.sweeps
                }
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
                question = {"announcement": list(announcement), "to_do": to_do, "to_tick": to_tick}
                self.put("prompt", {"number": self._prompts, **question})
                self._state("asking", "Nothing moves until it is given")
            case Answered(agreed):
                self.put("prompt", None)
                self._state("ready", "The operator agreed" if agreed else "The operator did not agree")
            case StepStarted(number, count, step):
                self.put("step", {**(sections["step"] or {}), **_step_fields(number, count, step)})
                self._state(_kind(step), step.name)
            case StepFinished():
                self._state("ready", "Between two steps")
            case PhaseRecorded(sensors, _):
                self.put("sensors", [self._row_of(sensor) for sensor in sensors])
                self.put("hand", None)
                self._state("judging", "Recorded; averaging, solving, judging")
            case BoardObserved(sensor, sweep, speed_rad_s, observation):
                fields = {"sensor": sensor, "sweep": sweep, "by": "board", "speed_rad_s": speed_rad_s}
                self._observation({**fields, "mean_rad_s": round_digits(observation.mean_rad_s)})
            case BoardNotObserved(sensor, sweep, reason):
                self._observation({"sensor": sensor, "sweep": sweep, "by": "board", "refused": reason})
            case ObservationMade() | AttitudeRead():
                self._observation(_row(event))
            case _:
                self._take_ending(event)

    def _take_ending(self, event: RunEvent) -> None:
        """Handle an event that comes after all motion has ended."""
        match event:
            case Checked(check):
                self._checks.append(check)
                row = {
                    name: getattr(check, name) for name in ("name", "value", "limit", "unit", "uncertainty", "passed")
                }
                self.put("checks", [*self.sections["checks"], row])
            case VerdictReached(passed):
                count = sum(check["passed"] for check in self.sections["checks"])
                text = f"{count} of {len(self.sections['checks'])} checks passed"
                self._state("passed" if passed else "failed", text)
                self.put("next", after_verdict(self._about, self._checks, passed=passed, stored=self._stored))
            case CalibrationStored():
                self._stored = True
            case Remembered(since=since):
                self.put("since", since_rows(since))
            case DocumentWritten(path) if path.name == CERTIFICATE:
                self.put("certificate", True)
            case DocumentWritten(path) if path.name == RESULT:
                self._result = result = read_result(path)
                self.put("parameters", parameter_rows(result))
                self.put("outcome", outcome_rows(result, self._parts))
                self.put("mounts", list(mount_lines(result)))
                self._solved = True
            case DocumentWritten(path) if path.name == TRUTH_FILE and self._result is not None:
                truth = truth_rows(path.parent, self._result)
                self.put("outcome", outcome_rows(self._result, self._parts, truth))
            case Failed(error):
                self._state("refused" if error.exit_status == 2 else "fault", str(error))
            case Interrupted(text):
                self._state("stopped", text)
            case Crashed(traceback):
                self._state("fault", f"A defect of the program: {traceback.strip().splitlines()[-1]}")
            case Advice(_, command, repeats):
                self.put("next", after_fault(command, repeats=repeats))
        if isinstance(event, ENDING_EVENTS):
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
            "units": {
                quantity.file_key(quantity.name): [quantity.name, unit.name] for quantity, unit in _quantities(sensor)
            },
        }

    def _observation(self, row: dict[str, Any]) -> None:
        """Show an observation; the host's replaces the board's of the same sweep, but not the reverse."""
        key = row["sensor"], row["sweep"]
        before = self._observations.get(key, {})
        if before.get("by") != "host" or row["by"] == "host":
            self._observations[key] = {**self._turns.get(row["sweep"], {}), **before, **row}
            self.put(
                "observations",
                [self._observations[key] for key in sorted(self._observations, key=lambda k: (k[1], k[0]))],
            )


def _quantities(sensor: SensorSamples) -> Iterator[tuple[Quantity | Scalar, DisplayUnit]]:
    """Yield the quantities of a sensor, each with the displayed unit of its bias, or of a scalar's reading."""
    by_name = channel_contents()
    for quantity in (by_name[name] for name in select_displayed(sensor.latest)):
        yield quantity, quantity.bias if isinstance(quantity, Quantity) else quantity.reading


def _values(sensors: tuple[SensorSamples, ...]) -> dict[str, tuple[float, ...]]:
    """Return the newest readings by the names of their curves."""
    return {
        f"{sensor.sensor}.{quantity.file_key(quantity.name)}": tuple(
            value / unit.size for value in sensor.latest[quantity.name]
        )
        for sensor in sensors
        for quantity, unit in _quantities(sensor)
    }


def _row(event: ObservationMade | AttitudeRead) -> dict[str, Any]:
    if isinstance(event, ObservationMade):
        return observation_row(event.sensor, event.observation)
    return dwell_row(event.read)


def _kind(step: Step) -> str:
    return "measuring" if isinstance(step, Sweep | Dwell) else "resting" if isinstance(step, Rest) else "moving"


def _step_fields(number: int, count: int, step: Step) -> dict[str, Any]:
    return {"number": number, "count": count, "name": step.name, "kind": _kind(step)}


def _progress(progress: Progress) -> dict[str, Any]:
    return {
        **_step_fields(progress.number, progress.count, progress.step),
        "fraction": round(progress.fraction, 4),
        "elapsed_s": round(progress.elapsed_s, 2),
        "remaining_s": round(progress.remaining_s, 2),
    }
