"""The events of a run in its recording: one type for each kind, written and read only by this module.

In the file an event is a line of JSON: its kind's name, its times, and the fields of its type.
"""

import json
from collections.abc import Iterator
from dataclasses import asdict, dataclass
from typing import Any

from firmware_host.answers import BoardObservation, BoardSolution
from rig.data.recording.hand_events import (
    HandAsked,
    HandBegunAnew,
    HandEvent,
    HandMoveAccepted,
    HandMoveRefused,
    HandRested,
    HandRestRefused,
)
from rig.data.recording.thermal_events import OfTheTemperature, SetMeasured, TemperatureWanted
from rig.data.validation import Finite, parse_json, validate
from rig.errors.quoting import quote
from rig.motion.steps import Dwell, Sweep

MAX_INTEGER = 2**63 - 1
LIMIT = 1e6  # of a sweep's or dwell's numbers in SI units: ten days, and more turns than any joint makes


@dataclass(frozen=True, slots=True)
class SweepStarted:
    """The command to the arm to make a sweep."""

    sweep: Sweep


@dataclass(frozen=True, slots=True)
class SweepFinished:
    """The end of a sweep that the arm has made."""

    sweep: Sweep


@dataclass(frozen=True, slots=True)
class RestStarted:
    """The beginning of a rest of the arm."""


@dataclass(frozen=True, slots=True)
class RestFinished:
    """The end of a rest of the arm."""


@dataclass(frozen=True, slots=True)
class DwellStarted:
    """The beginning of a dwell's measurement, when the arm rests in an attitude and the sensors have settled."""

    dwell: Dwell


@dataclass(frozen=True, slots=True)
class DwellFinished:
    """The end of a dwell's measurement."""

    dwell: Dwell


@dataclass(frozen=True, slots=True)
class BoardObserved:
    """The board's average of a sensor's readings over the revolution of sweep `sweep`, with its mean speed."""

    sensor: str
    sweep: int
    speed_rad_s: float
    observation: BoardObservation


@dataclass(frozen=True, slots=True)
class BoardNotObserved:
    """The reason why the board has no average of the sweep."""

    sensor: str
    sweep: int
    reason: str


@dataclass(frozen=True, slots=True)
class BoardRecalled:
    """The return of a sweep's average to the board that had computed it, when an interrupted run continues."""

    sensor: str
    sweep: int


@dataclass(frozen=True, slots=True)
class BoardSolved:
    """The board's own calibration of a sensor, by one method."""

    sensor: str
    solution: BoardSolution


BoardEvent = BoardObserved | BoardNotObserved | BoardRecalled | BoardSolved
OfTheArm = SweepStarted | SweepFinished | RestStarted | RestFinished | DwellStarted | DwellFinished
Event = OfTheArm | BoardEvent | HandEvent | OfTheTemperature

_KINDS: dict[str, type[Event]] = {
    "sweep_started": SweepStarted,
    "sweep_finished": SweepFinished,
    "rest_started": RestStarted,
    "rest_finished": RestFinished,
    "dwell_started": DwellStarted,
    "dwell_finished": DwellFinished,
    "board_observed": BoardObserved,
    "board_not_observed": BoardNotObserved,
    "board_recalled": BoardRecalled,
    "board_solved": BoardSolved,
    "hand_asked": HandAsked,
    "hand_rested": HandRested,
    "hand_move_taken": HandMoveAccepted,
    "hand_move_refused": HandMoveRefused,
    "hand_rest_refused": HandRestRefused,
    "hand_begun_anew": HandBegunAnew,
    "temperature_wanted": TemperatureWanted,
    "set_measured": SetMeasured,
}
_NAMES = {kind: name for name, kind in _KINDS.items()}


@dataclass(frozen=True, slots=True)
class TimedEvent:
    """An event, its time on the host's monotonic clock, and its time on the controller's clock, None if unknown."""

    event: Event
    host_time_s: float
    controller_time_s: float | None


def encode_event(recorded: TimedEvent) -> bytes:
    """Return an event as a line of a run file, with the line's end."""
    document = {
        "name": _NAMES[type(recorded.event)],
        "host_time_s": recorded.host_time_s,
        "controller_time_s": recorded.controller_time_s,
        "detail": asdict(recorded.event),
    }
    return json.dumps(document).encode() + b"\n"


def decode_events(stream: bytes) -> Iterator[TimedEvent]:
    """Yield the events of a run file, without a last line that a kill cut off.

    Raise ValueError naming the first line that is not an event, or that does not have the form of its kind.
    """
    for number, line in enumerate(stream.split(b"\n")[:-1], start=1):
        if line.strip(b"\0"):
            try:
                yield _decode_document(parse_json(line))
            except (ValueError, RecursionError) as error:
                raise ValueError(f"event {number} cannot be understood: {' '.join(str(error).split())}") from None


def _decode_document(document: Any) -> TimedEvent:
    """Return the event of a line's JSON. Raise ValueError for one that this program does not write."""
    if not isinstance(document, dict) or not isinstance(document.get("detail"), dict):
        raise ValueError("it has no name and no details")
    name, detail = document.get("name"), document["detail"]
    if not isinstance(name, str) or name not in _KINDS:
        raise ValueError(f"there is no event {quote(name)}")
    event = validate(_KINDS[name], _nest_answer(name, detail), name)
    if isinstance(event, SweepStarted | SweepFinished):
        _check_sweep(event.sweep)
    if isinstance(event, DwellStarted | DwellFinished):
        _check_dwell(event.dwell)
    if isinstance(event, BoardObserved):
        _check_observation(event.observation)
    times = validate(_Times, document, name)
    return TimedEvent(event, times.host_time_s, times.controller_time_s)


def _nest_answer(name: str, detail: dict[str, Any]) -> dict[str, Any]:
    """Return an event's fields with the board's answer as one nested value, which schema "rig.run/1" stores flat."""
    answer = {"board_observed": "observation", "board_solved": "solution"}.get(name)
    return {**detail, answer: detail} if answer is not None and answer not in detail else detail


@dataclass(frozen=True, slots=True)
class _Times:
    host_time_s: Finite
    controller_time_s: Finite | None = None


def _check_sweep(sweep: Sweep) -> None:
    """Raise ValueError for a sweep with impossible numbers or indices."""
    low, high = sweep.revolution_rad
    rates = sweep.speed_rad_s, sweep.acceleration_rad_s2, sweep.duration_s
    numbers = (*sweep.axis_flange, *sweep.start_q_rad, *sweep.end_q_rad, low, high, *rates)
    joints = len(sweep.start_q_rad)
    possible = all(abs(number) <= LIMIT for number in numbers) and all(rate >= 1 / LIMIT for rate in rates)
    counted = 0 <= sweep.index <= LIMIT and 0 <= sweep.joint < joints == len(sweep.end_q_rad)
    if not (counted and low < high and possible):
        raise ValueError(f"there is no such sweep as {quote(sweep)}")


def _check_dwell(dwell: Dwell) -> None:
    """Raise ValueError for a dwell that no plan contains."""
    if not (0 <= dwell.index <= LIMIT and all(abs(number) <= LIMIT for number in (*dwell.q_rad, dwell.duration_s))):
        raise ValueError(f"there is no such dwell as {quote(dwell)}")


def _check_observation(observation: BoardObservation) -> None:
    if not all(0 <= n <= MAX_INTEGER for n in (observation.start_us, observation.end_us, observation.samples)):
        raise ValueError(f"there is no such observation as {quote(observation)}")
