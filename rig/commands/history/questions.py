"""What the commands of `rig history` do."""

import json
import sys
from argparse import Namespace
from collections.abc import Callable, Iterator, Sequence
from contextlib import AbstractContextManager
from pathlib import Path

from rich.console import Console

from rig.commands.history.named_history import named_history
from rig.config.files.regular_file import UnfitFile
from rig.data.run_folder import RESULT, recordings
from rig.errors import Refused, RigError
from rig.errors.extras import missing_extra
from rig.history.documents import change_entry, history_csv, history_document, rigs_document
from rig.history.entered.finished import PAGE, FinishedRun, read_finished_run
from rig.history.series import Change, changes_between, effects, rig_states, subjects, trends
from rig.history.storage.address import own_history_address, resolve_address
from rig.history.store import History, Past, Selection, open_history
from rig.history.terminal.change_words import comparison_in_words
from rig.history.terminal.tables import (
    calibrations_table,
    changes_table,
    effects_table,
    parameters_table,
    run_lines,
    states_table,
    title_of,
    trend_lines,
    trends_table,
)
from rig.station.plain_text import plain, say

DISAGREE = 1


def listed(options: Namespace) -> int:
    """Print calibrations; of one serial number the trends too. Raises Refused `not_in_history` and as `opened`."""
    selection = _selection(options)
    with opened(options) as history:
        pasts = _selected(history, selection)
    found = {subject: trends(each) for subject, each in subjects(pasts).items()}
    if options.csv:
        for line in history_csv(pasts).rstrip("\n").split("\n"):
            say(line)
    elif options.json:
        document = history_document(pasts, found if selection.serial_number is not None else None)
        print(json.dumps(document, indent=2, allow_nan=False))
    elif not pasts:
        say("No calibration is in this history yet; `rig run` enters each one.")
    else:
        console = Console(highlight=False)
        console.print(calibrations_table(pasts))
        for subject, each in found.items() if selection.serial_number is not None else ():
            console.print(trends_table(subject, list(each.values())))
            for line in trend_lines(each):
                console.print(plain(line))
    return 0


def show(options: Namespace) -> int:
    """Print one calibration, and where its run lies. Raises Refused `not_in_history`."""
    with opened(options) as history:
        past = history.calibration(options.number)
        (kept,) = history.kept(past.run_id)
    if options.json:
        print(json.dumps(json.loads(kept.result), indent=2))
        return 0
    console = Console(highlight=False)
    console.print(calibrations_table([past]))
    console.print(parameters_table(past))
    for line in run_lines(past, kept):
        console.print(plain(line))
    for computer, path in kept.places:
        console.print(plain(f"lies on {computer} in {path}"))
    for recording in kept.recordings:
        console.print(plain(f"{recording.name}: {recording.size} bytes, SHA-256 {recording.sha256}"))
    return 0


def plot(options: Namespace) -> int:
    """Draw the series of a serial number. Raises Refused `not_in_history`, `missing_extra`, `report_folder`."""
    with opened(options) as history:
        pasts = _selected(history, _selection(options))

    def draw(folder: Path) -> list[Path]:
        from rig.history.plots import draw_trends

        return draw_trends({subject: trends(each) for subject, each in subjects(pasts).items()}, folder)

    for path in _draw(options.out, draw):
        say(str(path))
    return 0


def _drawn_changes(title: str, changes: Sequence[Change], folder: Path, name: str) -> list[Path]:
    from rig.history.plots import draw_changes

    return draw_changes(title, changes, folder, name)


def _draw(folder: Path, draw: Callable[[Path], list[Path]]) -> list[Path]:
    """Draw into a folder and return the files. Raise Refused `missing_extra`, `report_folder`."""
    try:
        import matplotlib  # noqa: F401
    except ImportError as error:
        raise missing_extra(error, "study") from error
    try:
        folder.mkdir(parents=True, exist_ok=True)
        return draw(folder)
    except OSError as error:
        why = f"{folder} cannot be written: {error}"
        raise Refused("report_folder", why, "Choose another folder") from error


def rigs(options: Namespace) -> int:
    """Print what check standards and shared sensors say of the rigs. Returns 1 when one is out of control."""
    with opened(options) as history:
        pasts = history.calibrations(Selection(part=options.part, since=options.since))
    states, found = rig_states(pasts), effects(pasts)
    alarmed = any(chart.out_of_control for state in states for chart in state.charts.values() if chart.alarm.size)
    if options.json:
        print(json.dumps(rigs_document(states, found), indent=2, allow_nan=False))
        return DISAGREE if alarmed else 0
    console = Console(highlight=False)
    if any(state.charts for state in states):
        console.print(states_table(states))
    else:
        console.print("no check standard was calibrated often enough on one rig; history.check_standards names them")
    if found:
        console.print(effects_table(found))
    else:
        console.print("no two rigs have calibrated the same sensors often enough to be compared")
    return DISAGREE if alarmed else 0


def imported(options: Namespace) -> int:
    """Enter runs as their recordings give them; tells of each what became of it. Returns 1 when one was refused."""
    from rig.station.words import calibrations_in_words

    new = known = refused = 0
    with opened(options) as history:
        for folder in _run_folders(options.folders, unsolved=options.solve):
            try:
                run = _finished(folder, history, solve=options.solve)
                entered = history.enter(run)
            except (RigError, UnfitFile, OSError) as error:
                refused += 1
                say(f"{folder}: {error}", sys.stderr)
                continue
            new, known = new + entered.new, known + (not entered.new)
            numbers = calibrations_in_words([each.id for each in history.of_run(entered.run_id)])
            say(f"{folder}: {'entered' if entered.new else 'there already'} as {numbers}")
            if entered.new and run.certificate is None and (folder / PAGE).exists():
                said = f"its {PAGE} is not what this version writes of its result, and was not entered"
                say(f"{folder}: {said}; rig report writes it anew", sys.stderr)
    say(f"{new} entered, {known} there already, {refused} refused")
    return DISAGREE if refused else 0


def verify(options: Namespace) -> int:
    """Hold rows against their journal and results, files against hashes; names what is wrong. Returns 1 then."""
    from rig.history.integrity import STATES, WRONG, examine_history

    counts = dict.fromkeys(STATES, 0)
    with opened(options) as history:
        for found in examine_history(history):
            counts[found.state] += 1
            if found.state != "ok":
                say(f"{found.state}: {found.what}: {found.why}")
        end = history.head()
    say(f"journal: entry {end.number}, chained to all before by SHA-256 {end.sha256}")
    say(", ".join(f"{count} {state}" for state, count in counts.items()))
    return DISAGREE if any(counts[state] for state in WRONG) else 0


def compare(options: Namespace) -> int:
    """Print how two calibrations of one sensor differ, and draw it with `--plot`; return 0.

    Raise Refused `not_in_history`, `not_comparable`, and as `plot`.
    """
    with opened(options) as history:
        first, second = history.calibration(options.first), history.calibration(options.second)
        before, now = ([*history.of_run(each.run_id), each] for each in (first, second))
    if first.subject != second.subject:
        raise Refused(
            "not_comparable",
            f"{first.id} is of {title_of(first.subject)}, {second.id} of {title_of(second.subject)}",
            "Give two calibrations of one sensor at one range",
        )
    found = changes_between(before, now)[second.subject]
    title = f"{title_of(first.subject)}: {first.id} and {second.id}"
    if options.plot is not None:
        name = f"compare_{first.id}_{second.id}"
        for path in _draw(options.plot, lambda folder: _drawn_changes(title, found, folder, name)):
            say(str(path), sys.stderr)
    if options.json:
        numbers = {"before": first.id, "now": second.id}
        document = {**numbers, "parameters": {each.name: change_entry(each) for each in found}}
        print(json.dumps(document, indent=2, allow_nan=False))
        return 0
    Console(highlight=False).print(changes_table(title, found))
    say(comparison_in_words(found))
    return 0


def void(options: Namespace) -> int:
    """Say that a calibration does not count. Raises Refused `not_in_history`, `already_voided`."""
    with opened(options) as history:
        history.void(options.number, options.reason)
    say(f"calibration {options.number} does not count any more")
    return 0


def opened(options: Namespace) -> AbstractContextManager[History]:
    """The history that is meant. Raises Refused as `open_history`, and as `load` where a configuration names it."""
    return open_history(own_history_address(named_history(options.history)) or resolve_address(None))


def _selection(options: Namespace) -> Selection:
    return Selection(options.serial_number, options.part, options.since, options.rig)


def _selected(history: History, selection: Selection) -> list[Past]:
    """Raises Refused `not_in_history` where one sensor was asked for and there is none."""
    pasts = history.calibrations(selection)
    if not pasts and selection.serial_number is not None:
        raise Refused(
            "not_in_history",
            f"no calibration of {selection.serial_number} in the history fits",
            "Look with `rig history`, or enter runs with `rig history import`",
        )
    return pasts


def _run_folders(given: list[Path], *, unsolved: bool) -> Iterator[Path]:
    """The run folders given, and those within them; what is no run folder comes as it is, for its own error."""
    for folder in given:
        inner = {file.parent for file in folder.rglob(RESULT)}
        if unsolved:
            inner |= {file.parent for file in folder.rglob("*.h5") if recordings(file.parent, "raw")}
        yield from sorted(inner) or [folder]


def _finished(folder: Path, history: History, *, solve: bool) -> FinishedRun:
    """The run as its recordings give it, which a result.json alone only claims; what is there already is not solved.

    Raises Refused `no_recording`, `result_not_of_recording`, and as the recordings' solution does.
    """
    claimed = None if solve and not (folder / RESULT).exists() else read_finished_run(folder)
    if claimed is not None:
        if history.has(claimed.content_sha256):
            return claimed
        if not claimed.recordings:
            raise Refused(
                "no_recording",
                f"{folder} has a {RESULT} but no recording from which it can be computed",
                "Import the folder with its recordings",
            )
    from rig.history.entered.recomputed import not_given
    from rig.history.integrity import MOST_TOLD
    from rig.plans.recorded import judged, open_run
    from rig.report.document import document_of

    given = document_of(judged(open_run(folder)))
    differing = [] if claimed is None else not_given(claimed.document, given)
    if claimed is not None and not differing:
        return claimed
    if not solve:
        more = f", and {len(differing) - MOST_TOLD} more" if len(differing) > MOST_TOLD else ""
        raise Refused(
            "result_not_of_recording",
            f"the {RESULT} in {folder} does not agree with its recordings: {'; '.join(differing[:MOST_TOLD])}{more}",
            "Enter the result of the recordings by `rig history import --solve DIR`; a result of an older "
            "version may differ too",
        )
    return read_finished_run(folder, given)
