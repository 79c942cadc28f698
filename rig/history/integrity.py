"""Integrity of a history: its entries against the journal, and the files on the disk against the entries."""

import os
import platform
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from typing import Any, Literal, get_args

from pydantic import ValidationError

from rig.config.files.regular_file import UnfitFile
from rig.data.result_file import ResultDocument
from rig.data.run_folder import RESULT, recordings
from rig.history.entered.finished_run import CERTIFICATES, DOCUMENTS, content_sha256, document_sha256, recording_of
from rig.history.entered.index import run_row, unlike
from rig.history.store import History, KeptRun, Past
from rig.report.findings.history_records import HistoryRecord
from rig.station.words import calibrations_in_words

State = Literal["ok", "changed", "missing", "elsewhere", "unknown"]
STATES: Sequence[State] = get_args(State)
WRONG_STATES: Sequence[State] = ("changed", "missing", "unknown")
MAX_SHOWN = 3  # of a run that are reported


@dataclass(frozen=True, slots=True)
class EntryState:
    """The state of a file or an entry, and its reason; `what` is the file's path, or the entry's name and number."""

    what: str
    state: State
    why: str = ""


def examine_history(history: History) -> Iterator[EntryState]:
    """Yield the damages of the triggers and of the journal, then the state of each run and of the run's files.

    A run is `ok` if its rows agree with its result. Files are read at their last known location. A file of another
    computer that is not accessible here is `elsewhere`; a file in a run's folder that was not entered is `unknown`.
    """
    computer = platform.node()
    for entry in history.broken():
        yield EntryState(entry.what, entry.state, entry.why)
    documents = _files_by_folder(history)
    examined_folders: set[Path] = set()
    for run in history.kept():
        pasts = history.select_run(run.run_id)
        why = "; ".join(_contradictions(run, pasts))
        numbers = calibrations_in_words([past.id for past in pasts])
        yield EntryState(f"run {run.run_id}, {numbers}", "changed" if why else "ok", why)
        folder = next((Path(path) for _, path in run.places if Path(path).is_dir()), None)
        yield from _files(run, folder, computer, documents)
        if folder is not None and folder not in examined_folders:
            examined_folders.add(folder)
            yield from _unknown(folder, documents)


def _contradictions(run: KeptRun, pasts: Sequence[Past]) -> Iterator[str]:
    """Yield the first contradictions between a run's result and its rows in the tables, then the number of others."""
    try:
        if content_sha256(run.result) != run.content_sha256:
            yield "the result in the history is not as it was entered"
        document = ResultDocument.model_validate_json(run.result)
    except (ValidationError, ValueError, LookupError, AttributeError, TypeError):
        yield "the result in the history is not a valid one"
        return
    rows = [f"{name} is {run.row[name]}" for name, value in run_row(document).items() if run.row[name] != value]
    differences = [*rows, *unlike(document, list(map(_record, pasts)))]
    yield from differences[:MAX_SHOWN]
    if len(differences) > MAX_SHOWN:
        yield f"and {len(differences) - MAX_SHOWN} more"


def _record(past: Past) -> HistoryRecord:
    values: dict[str, Any] = {field.name: getattr(past, field.name) for field in fields(HistoryRecord)}
    return HistoryRecord(**values | {"parameters": tuple(past.parameters.values())})


def _files_by_folder(history: History) -> Mapping[str, set[tuple[str, str]]]:
    """Return name and SHA-256 of all files that were entered from each folder, by the folder's path.

    A folder whose run was resumed was entered repeatedly, so a name may have several checksums.
    """
    by_folder: dict[str, set[tuple[str, str]]] = {}
    for path, name, sha256 in history.files():
        by_folder.setdefault(path, set()).add((name, sha256))
    return by_folder


def _files(
    run: KeptRun, folder: Path | None, this_computer: str, entered: Mapping[str, set[tuple[str, str]]]
) -> Iterator[EntryState]:
    """Yield the state of each recording and document of the run."""
    if not run.recordings and not run.documents:
        return
    if folder is None:
        other_computers = [name for name, _ in run.places if name != this_computer]
        state: State = "elsewhere" if other_computers else "missing"
        why = f"on {other_computers[0]}" if other_computers else "the folder no longer exists"
        yield EntryState(run.places[0][1] if run.places else f"the folder of run {run.run_id}", state, why)
        return
    for recording in run.recordings:
        file = folder / recording.name
        try:
            recorded = recording_of(file)
        except (UnfitFile, OSError) as error:
            yield _unreadable(file, error)
            continue
        yield _compare(file, recorded.sha256, {recording.sha256})
    allowed = entered.get(str(folder), set())
    for name in sorted(_names(run, folder)):
        try:
            sha256 = document_sha256(folder, name)
        except (UnfitFile, OSError) as error:
            yield _unreadable(folder / name, error)
            continue
        if sha256 is None:
            yield EntryState(str(folder / name), "missing", "it existed when the run was entered")
        else:
            yield _compare(
                folder / name,
                sha256,
                {entered for allowed_name, entered in allowed if allowed_name == name},
            )


def _unknown(folder: Path, entered: Mapping[str, set[tuple[str, str]]]) -> Iterator[EntryState]:
    """Yield the files in a run's folder that were entered with no run, such as a further recording."""
    entered_names = {name for name, _ in entered.get(str(folder), set())}
    recorded = [file.name for readings in ("raw", "calibrated") for file in recordings(folder, readings)]
    present = [name for name in (*DOCUMENTS, *CERTIFICATES) if os.path.lexists(folder / name)]
    for name in (*recorded, *present):
        if name not in entered_names:
            yield EntryState(str(folder / name), "unknown", "no run in this history was entered with it")


def _names(run: KeptRun, folder: Path) -> set[str]:
    """Return the names of the run's documents and, if they are in the folder, of its result and certificates."""
    possible = {RESULT, *(name for certificate in run.certificates for name, _ in certificate.files)}
    return {name for name, _ in run.documents} | {name for name in possible if (folder / name).exists()}


def _compare(file: Path, sha256: str, entered: set[str]) -> EntryState:
    if sha256 in entered:
        return EntryState(str(file), "ok")
    return EntryState(str(file), "changed", f"SHA-256 {sha256[:12]}…, which was not entered for it")


def _unreadable(file: Path, error: Exception) -> EntryState:
    missing = isinstance(error, FileNotFoundError)
    return EntryState(str(file), "missing" if missing else "changed", getattr(error, "strerror", None) or str(error))
