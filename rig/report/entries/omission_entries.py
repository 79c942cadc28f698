"""Omitted parts of a recording, and notes on how the recording was read and solved: entries and lines."""

from collections.abc import Iterator
from typing import TYPE_CHECKING

from rig.data.entries.result_types import ErrorEntry, OmittedEntry
from rig.data.quantity import ACCELERATION
from rig.data.result_file import ResultDocument
from rig.report.entry import entry

if TYPE_CHECKING:
    from rig.analysis.outcome import Outcome
    from rig.estimation.by_hand import HandSolution

OMITTED = "omitted"  # a move by hand that gives no information


def list_omissions(outcome: "Outcome") -> dict[str, tuple[OmittedEntry, ...]]:
    """Return the omitted parts of the recording, by sensor; a sensor without omissions has no entry."""
    by_sensor = {
        name: [entry(OmittedEntry, part, quantity=quantity and quantity.name) for quantity, part in sensor.omitted]
        for name, sensor in outcome.external.items()
    }
    for name, result in outcome.results.items():
        if result.by_hand is not None:
            by_sensor.setdefault(name, []).extend([*_rests(result.by_hand), *_moves(result.by_hand)])
    return {name: tuple(parts) for name, parts in by_sensor.items() if parts}


def list_unsolved_entries(outcome: "Outcome") -> dict[str, dict[str, ErrorEntry]]:
    """Return why recorded quantities have no solution, by sensor and quantity."""
    reasons: dict[str, dict[str, ErrorEntry]] = {}
    faults = [(name, *failure) for name, sensor in outcome.external.items() for failure in sensor.unsolved.items()]
    faults += [(name, ACCELERATION, fault) for name, fault in outcome.accelerometer_faults.items()]
    faults += [(kind.name, kind.quantity, kind.fault) for kind in outcome.installed_kinds if kind.fault is not None]
    for name, quantity, fault in faults:
        reasons.setdefault(name, {})[quantity.name] = ErrorEntry(error=str(fault))
    return reasons


def notes(outcome: "Outcome") -> dict[str, tuple[str, ...]]:
    """Return remarks on unusual ways in which recordings were read and solved, by sensor."""
    return {name: sensor.notes for name, sensor in outcome.external.items() if sensor.notes}


def omission_lines(result: ResultDocument, sensor: str | None = None) -> Iterator[str]:
    """Yield a line for each omission and each note, of all sensors or of one."""
    for name, parts in result.omitted.items():
        if sensor in (None, name):
            prefix = f"{name}: " if len(result.omitted) > 1 else ""
            yield from (f"{prefix}left out: {_words(part)}" for part in parts)
    for name, remarks in result.notes.items():
        if sensor in (None, name):
            yield from remarks


def _words(entry: OmittedEntry) -> str:
    return f"{entry.count} of {entry.total} {entry.what}, {entry.reason}; the first {entry.first}"


def _rests(solution: "HandSolution") -> Iterator[OmittedEntry]:
    """Yield the entry of the rests that were left out because the body crept, if any."""
    if solution.creeping_s:
        start_s, end_s = solution.creeping_s[0]
        yield OmittedEntry(
            quantity=None,
            what="rests",
            count=len(solution.creeping_s),
            total=len(solution.rests) + len(solution.creeping_s),
            reason="bias_jumped: the body crept, which the gyroscope's other readings before and after show",
            first=f"from {start_s:.1f} to {end_s:.1f} s",
        )


def _moves(solution: "HandSolution") -> Iterator[OmittedEntry]:
    """Yield the entry of the moves that were left out, if any."""
    from rig.estimation.by_hand.solution import MOVES_LEFT_OUT

    omissions = [number for number, move in enumerate(solution.moves, 1) if move.kind == OMITTED]
    reasons = [warning for warning in solution.turned.warnings if warning.startswith(MOVES_LEFT_OUT)]
    if omissions:
        yield OmittedEntry(
            quantity=None,
            what="moves",
            count=len(omissions),
            total=len(solution.moves),
            reason="; ".join(reasons) or ("too long" if solution.creeping_s else "not accepted"),
            first=f"move {omissions[0]}",
        )
