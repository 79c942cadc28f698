"""The commands of `rig history`, carried out."""

import json
import sys
from argparse import Namespace
from collections.abc import Iterator, Sequence
from contextlib import AbstractContextManager, suppress
from pathlib import Path

from rich.console import Console

from rig.commands.config_arguments import read_history_name
from rig.commands.report_folder import draw_into
from rig.config.files.regular_file import UnfitFile
from rig.data.run_folder import RESULT, recordings
from rig.errors import Refused, RigError
from rig.history.documents import change_entry, history_csv, history_document, rigs_document
from rig.history.entered.finished_run import PAGE, FinishedRun, read_finished_run
from rig.history.series import Change, changes_between, effects, rig_states, subjects, trends
from rig.history.storage.address import HistoryAddress, default_history_address, resolve_address
from rig.history.storage.continuity import is_there
from rig.history.store import History, Past, Selection, open_history
from rig.history.terminal.change_words import comparison_in_words
from rig.history.terminal.history_tables import (
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

DISAGREEMENT_STATUS = 1
MAX_NUMBER_DIGITS = 18  # a database's numbers have no more; serial numbers do


def list_calibrations(options: Namespace) -> int:
    """Print calibrations, and a serial number's trends; return 0.

    Raise Refused `not_in_history`, and what `open_named_history` raises.
    """
    selection, address = _read_selection(options), _read_address(options)
    pasts = list[Past]()
    if selection.serial_number is not None or is_there(address):
        with _open_existing(address) as history:
            pasts = _select_pasts(history, selection)
    series = {subject: trends(past) for subject, past in subjects(pasts).items()}
    if options.csv:
        for line in history_csv(pasts).rstrip("\n").split("\n"):
            say(line)
    elif options.json:
        document = history_document(pasts, series if selection.serial_number is not None else None)
        print(json.dumps(document, indent=2, allow_nan=False))
    elif not pasts:
        say(f"No calibration is in {address.label} yet; `rig run` enters each one.")
    else:
        console = Console(highlight=False)
        console.print(calibrations_table(pasts))
        for subject, trends_of in series.items() if selection.serial_number is not None else ():
            console.print(trends_table(subject, list(trends_of.values())))
            for line in trend_lines(trends_of):
                console.print(plain(line))
    return 0


def show(options: Namespace) -> int:
    """Print one calibration, or all of a sensor's last run, and the run's folders; return 0. Raise `not_in_history`."""
    with open_named_history(options) as history:
        pasts = _find_shown(history, options.calibration)
        (kept,) = history.kept(pasts[-1].run_id)
    if options.json:
        print(json.dumps(json.loads(kept.result), indent=2))
        return 0
    console = Console(highlight=False)
    console.print(calibrations_table(pasts))
    for past in pasts:
        console.print(parameters_table(past))
    for line in run_lines(pasts[-1], kept):
        console.print(plain(line))
    for computer, path in kept.places:
        console.print(plain(f"stored on {computer} in {path}"))
    for recording in kept.recordings:
        console.print(plain(f"{recording.name}: {recording.size} bytes, SHA-256 {recording.sha256}"))
    return 0


def _find_shown(history: History, named: str) -> list[Past]:
    """Return the calibration with the number `named` or, if `named` is a serial number, those in its last run.

    Raise Refused `not_in_history`.
    """
    if named.isdecimal() and len(named) <= MAX_NUMBER_DIGITS:
        with suppress(Refused):
            return [history.calibration(int(named))]
    pasts = _select_pasts(history, Selection(named))
    return [past for past in pasts if past.run_id == pasts[-1].run_id]


def plot(options: Namespace) -> int:
    """Draw a serial number's series; return 0. Raise Refused `not_in_history`, `missing_extra`, `report_folder`."""
    with open_named_history(options) as history:
        pasts = _select_pasts(history, _read_selection(options))

    def draw(folder: Path) -> list[Path]:
        from rig.history.series_plots import draw_trends

        return draw_trends({subject: trends(past) for subject, past in subjects(pasts).items()}, folder)

    for path in draw_into(options.out, draw, "--out"):
        say(str(path))
    return 0


def _draw_changes(title: str, changes: Sequence[Change], folder: Path, name: str) -> list[Path]:
    from rig.history.series_plots import draw_changes

    return draw_changes(title, changes, folder, name)


def rigs(options: Namespace) -> int:
    """Print a comparison of the rigs by check standards and shared sensors. Return 1 if a rig is out of control."""
    with open_named_history(options) as history:
        pasts = history.calibrations(Selection(part=options.part, since=options.since))
    states, rig_effects = rig_states(pasts), effects(pasts)
    alarmed = any(chart.out_of_control for state in states for chart in state.charts.values() if chart.alarm.size)
    if options.json:
        print(json.dumps(rigs_document(states, rig_effects), indent=2, allow_nan=False))
        return DISAGREEMENT_STATUS if alarmed else 0
    console = Console(highlight=False)
    if any(state.charts for state in states):
        console.print(states_table(states))
    else:
        console.print("no check standard was calibrated often enough on one rig; history.check_standards names them")
    if rig_effects:
        console.print(effects_table(rig_effects))
    else:
        console.print("no two rigs have calibrated the same sensors often enough to be compared")
    return DISAGREEMENT_STATUS if alarmed else 0


def import_runs(options: Namespace) -> int:
    """Enter runs whose results agree with their recordings, and report each. Return 1 if any was refused, else 0."""
    from rig.station.words import calibrations_in_words

    new = existing = refused = 0
    with open_history(_read_address(options)) as history:
        for folder in _find_run_folders(options.folders, unsolved=options.solve):
            try:
                run = _recompute_finished(folder, history, solve=options.solve)
                entered = history.enter(run)
            except (RigError, UnfitFile, OSError) as error:
                refused += 1
                say(f"{folder}: {error}", sys.stderr)
                continue
            new, existing = new + entered.new, existing + (not entered.new)
            numbers = calibrations_in_words([past.id for past in history.select_run(entered.run_id)])
            say(f"{folder}: {'entered' if entered.new else 'already there'} as {numbers}")
            if entered.new and run.certificate is None and (folder / PAGE).exists():
                reason = f"its {PAGE} is not the one this version writes of its result, and was not entered"
                say(f"{folder}: {reason}; rig report writes it again", sys.stderr)
    say(f"{new} entered, {existing} already there, {refused} refused")
    return DISAGREEMENT_STATUS if refused else 0


def verify(options: Namespace) -> int:
    """Compare rows with journal and results, and files with hashes; print differences; return 1 if there are any."""
    from rig.history.integrity import STATES, WRONG_STATES, examine_history

    counts = dict.fromkeys(STATES, 0)
    with open_named_history(options) as history:
        for finding in examine_history(history):
            counts[finding.state] += 1
            if finding.state != "ok":
                say(f"{finding.state}: {finding.what}: {finding.why}")
        end = history.head()
    say(f"journal: entry {end.number}, chained to all before by SHA-256 {end.sha256}")
    say(", ".join(f"{count} {state}" for state, count in counts.items()))
    return DISAGREEMENT_STATUS if any(counts[state] for state in WRONG_STATES) else 0


def compare(options: Namespace) -> int:
    """Print how two calibrations of one sensor differ, and with `--plot` draw the differences; return 0.

    Raise Refused `not_in_history`, `not_comparable`, and what `plot` raises.
    """
    with open_named_history(options) as history:
        first, second = history.calibration(options.first), history.calibration(options.second)
        before, now = ([*history.select_run(past.run_id), past] for past in (first, second))
    if first.subject != second.subject:
        raise Refused(
            "not_comparable",
            f"{first.id} is of {title_of(first.subject)}, {second.id} of {title_of(second.subject)}",
            "Give two calibrations of one sensor at one range",
        )
    changes = changes_between(before, now)[second.subject]
    title = f"{title_of(first.subject)}: {first.id} and {second.id}"
    if options.plot is not None:
        name = f"compare_{first.id}_{second.id}"
        for path in draw_into(options.plot, lambda folder: _draw_changes(title, changes, folder, name), "--plot"):
            say(str(path), sys.stderr)
    if options.json:
        numbers = {"before": first.id, "now": second.id}
        document = {**numbers, "parameters": {change.name: change_entry(change) for change in changes}}
        print(json.dumps(document, indent=2, allow_nan=False))
        return 0
    Console(highlight=False).print(changes_table(title, changes))
    say(comparison_in_words(changes))
    return 0


def void(options: Namespace) -> int:
    """Mark a calibration as void; return 0. Raise Refused `bad_option`, `not_in_history`, `already_voided`."""
    if not options.reason.strip():
        raise Refused("bad_option", "--reason is blank", "Say in a few words why the calibration is void")
    with open_named_history(options) as history:
        history.void(options.number, options.reason)
    say(f"calibration {options.number} is void")
    return 0


def open_named_history(options: Namespace) -> AbstractContextManager[History]:
    """Return a context manager that opens the named history.

    Raise Refused `no_history` if there is none, because opening would make an empty one; any that `open_history`
    raises; and, if a configuration names the history, any that `load` raises.
    """
    return _open_existing(_read_address(options))


def _open_existing(address: HistoryAddress) -> AbstractContextManager[History]:
    if not is_there(address):
        what = f"there is no history {address.label}"
        raise Refused("no_history", what, "Name another with --history or RIG_HISTORY; `rig history import` makes one")
    return open_history(address)


def _read_address(options: Namespace) -> HistoryAddress:
    return default_history_address(read_history_name(options.history)) or resolve_address(None)


def _read_selection(options: Namespace) -> Selection:
    return Selection(options.serial_number, options.part, options.since, options.rig)


def _select_pasts(history: History, selection: Selection) -> list[Past]:
    """Return the selected calibrations. Raise Refused `not_in_history` if the chosen sensor has none."""
    pasts = history.calibrations(selection)
    if not pasts and selection.serial_number is not None:
        raise Refused(
            "not_in_history",
            f"no calibration of {selection.serial_number} in the history matches",
            "List all with `rig history`, or enter runs with `rig history import`",
        )
    return pasts


def _find_run_folders(folders: list[Path], *, unsolved: bool) -> Iterator[Path]:
    """Yield the run folders among and within `folders`; with `unsolved`, also folders without a result.

    A folder without any run is yielded too, so that it is refused by name.
    """
    for folder in folders:
        inner = {file.parent for file in folder.rglob(RESULT)}
        if unsolved:
            inner |= {file.parent for file in folder.rglob("*.h5") if recordings(file.parent, "raw")}
        yield from sorted(inner) or [folder]


def _recompute_finished(folder: Path, history: History, *, solve: bool) -> FinishedRun:
    """Return the run. Its result is recomputed from its recordings, unless the history already has the result.

    A result.json alone proves nothing, so it must agree with the recordings; with `solve` a result.json that does not
    agree is replaced. Raise Refused `no_recording`, `result_not_of_recording`, and the errors of the recordings'
    solution.
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
    from rig.history.entered.recomputed_result import differing_parts
    from rig.history.integrity import MAX_SHOWN
    from rig.plans.recorded_run import judge_phases, open_run
    from rig.report.document import document_of

    document = document_of(judge_phases(open_run(folder)))
    differing = list[str]() if claimed is None else differing_parts(claimed.document, document)
    if claimed is not None and not differing:
        return claimed
    if not solve:
        more = f", and {len(differing) - MAX_SHOWN} more" if len(differing) > MAX_SHOWN else ""
        raise Refused(
            "result_not_of_recording",
            f"the {RESULT} in {folder} does not agree with its recordings: {'; '.join(differing[:MAX_SHOWN])}{more}",
            "Enter the result of the recordings by `rig history import --solve DIR`; a result of an older "
            "version may differ too",
        )
    return read_finished_run(folder, document)
