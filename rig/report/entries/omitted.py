"""What a result leaves out of its recording, and how this was read and solved: entries, and lines for people."""

from collections.abc import Iterator
from typing import TYPE_CHECKING

from rig.analysis.outcome import Outcome
from rig.data.entries.result_types import OmittedEntry
from rig.data.result_file import ResultDocument
from rig.report.entry import entry

if TYPE_CHECKING:
    from rig.estimation.by_hand import HandSolution

LEFT_OUT = "omitted"  # a move by hand that tells nothing


def omitted(outcome: Outcome) -> dict[str, tuple[OmittedEntry, ...]]:
    """Return what was left out, by sensor; those of which all counts are not there."""
    found = {
        name: [entry(OmittedEntry, each, quantity=quantity and quantity.name) for quantity, each in of_files.omitted]
        for name, of_files in outcome.elsewhere.items()
    }
    for name, result in outcome.results.items():
        if result.by_hand is not None:
            found.setdefault(name, []).extend([*_rests(result.by_hand), *_moves(result.by_hand)])
    return {name: tuple(each) for name, each in found.items() if each}


def notes(outcome: Outcome) -> dict[str, tuple[str, ...]]:
    """Return how recordings were read and solved where that is no matter of course, by sensor."""
    return {name: found.notes for name, found in outcome.elsewhere.items() if found.notes}


def omitted_lines(result: ResultDocument, sensor: str | None = None) -> Iterator[str]:
    """Yield a line for all that was left out, and for each note; of one sensor alone if one is named."""
    for name, left_out in result.omitted.items():
        if sensor in (None, name):
            of = f"{name}: " if len(result.omitted) > 1 else ""
            yield from (f"{of}left out: {_words(each)}" for each in left_out)
    for name, said in result.notes.items():
        if sensor in (None, name):
            yield from said


def _words(entry: OmittedEntry) -> str:
    return f"{entry.count} of {entry.total} {entry.what}, {entry.reason}; the first {entry.first}"


def _rests(solution: "HandSolution") -> Iterator[OmittedEntry]:
    if solution.creeping_s:
        start_s, end_s = solution.creeping_s[0]
        yield OmittedEntry(
            quantity=None,
            what="rests",
            count=len(solution.creeping_s),
            total=len(solution.rests) + len(solution.creeping_s),
            reason="bias_jumped: the body crept, for the gyroscope read otherwise than before and after",
            first=f"from {start_s:.1f} to {end_s:.1f} s",
        )


def _moves(solution: "HandSolution") -> Iterator[OmittedEntry]:
    left_out = [number for number, move in enumerate(solution.moves, 1) if move.kind == LEFT_OUT]
    if left_out:
        yield OmittedEntry(
            quantity=None,
            what="moves",
            count=len(left_out),
            total=len(solution.moves),
            reason="; ".join(solution.turned.warnings) or ("too long" if solution.creeping_s else "taken back"),
            first=f"move {left_out[0]}",
        )
