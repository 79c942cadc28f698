"""Whether what a history knows is still what was entered, and what lies on the disk."""

import os
import platform
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, get_args

from pydantic import ValidationError

from rig.config.files.regular_file import UnfitFile
from rig.data.result_file import ResultDocument
from rig.data.run_folder import RESULT, recordings
from rig.history.entered.finished import CERTIFICATES, DOCUMENTS, content_sha256, document_sha256, recording_of
from rig.history.entered.index import run_row, unlike
from rig.history.store import History, Kept, Past
from rig.report.findings.followed import Followed
from rig.station.words import calibrations_in_words

State = Literal["ok", "changed", "missing", "elsewhere", "unknown"]
STATES: Sequence[State] = get_args(State)
WRONG: Sequence[State] = ("changed", "missing", "unknown")
MOST_TOLD = 3


@dataclass(frozen=True, slots=True)
class Found:
    """What became of one thing: of a file `what` is its path, of an entry its number."""

    what: str
    state: State
    why: str = ""


def examined(history: History) -> Iterator[Found]:
    """Triggers, numbers, rows against the journal, every run's against its result, and files against their hashes.

    Files are looked at where they were seen last. What was entered on another computer and is not to be seen from here
    is `elsewhere`; a file of a run that no run was entered with is `unknown`.
    """
    here = platform.node()
    for each in history.broken():
        yield Found(each.what, each.state, each.why)
    documents = _files_by_folder(history)
    looked_at: set[Path] = set()
    for run in history.kept():
        pasts = history.of_run(run.run_id)
        why = "; ".join(_contradictions(run, pasts))
        numbers = calibrations_in_words([each.id for each in pasts])
        yield Found(f"run {run.run_id}, {numbers}", "changed" if why else "ok", why)
        folder = next((Path(path) for _, path in run.places if Path(path).is_dir()), None)
        yield from _files(run, folder, here, documents)
        if folder is not None and folder not in looked_at:
            looked_at.add(folder)
            yield from _unknown(folder, documents)


def _contradictions(run: Kept, pasts: Sequence[Past]) -> Iterator[str]:
    """What in the rows of a run contradicts its result, the first few."""
    try:
        if content_sha256(run.result) != run.content_sha256:
            yield "the result in the history is not what was entered"
        document = ResultDocument.model_validate_json(run.result)
    except (ValidationError, ValueError, LookupError, AttributeError, TypeError):
        yield "the result in the history is none"
        return
    rows = [f"{name} is {run.row[name]}" for name, value in run_row(document).items() if run.row[name] != value]
    found = [*rows, *unlike(document, list(map(_calibrated, pasts)))]
    yield from found[:MOST_TOLD]
    if len(found) > MOST_TOLD:
        yield f"and {len(found) - MOST_TOLD} more"


def _calibrated(past: Past) -> Followed:
    return Followed(
        past.sensor,
        past.quantity,
        past.part,
        past.serial_number,
        past.full_scale,
        past.estimator,
        past.temperature_c,
        tuple(past.parameters.values()),
    )


def _files_by_folder(history: History) -> Mapping[str, set[tuple[str, str]]]:
    """What the files of a folder may be, by its path: a run that was resumed there was entered again."""
    found: dict[str, set[tuple[str, str]]] = {}
    for path, name, sha256 in history.files():
        found.setdefault(path, set()).add((name, sha256))
    return found


def _files(run: Kept, folder: Path | None, here: str, entered: Mapping[str, set[tuple[str, str]]]) -> Iterator[Found]:
    if not run.recordings and not run.documents:
        return
    if folder is None:
        elsewhere = [name for name, _ in run.places if name != here]
        state: State = "elsewhere" if elsewhere else "missing"
        why = f"on {elsewhere[0]}" if elsewhere else "the folder does not exist any more"
        yield Found(run.places[0][1] if run.places else f"the folder of run {run.run_id}", state, why)
        return
    for recording in run.recordings:
        file = folder / recording.name
        try:
            now = recording_of(file)
        except (UnfitFile, OSError) as error:
            yield _unreadable(file, error)
            continue
        yield _held(file, now.sha256, {recording.sha256})
    allowed = entered.get(str(folder), set())
    for name in sorted(_names(run, folder)):
        try:
            sha256 = document_sha256(folder, name)
        except (UnfitFile, OSError) as error:
            yield _unreadable(folder / name, error)
            continue
        if sha256 is None:
            yield Found(str(folder / name), "missing", "it was there when the run was entered")
        else:
            yield _held(folder / name, sha256, {each for known, each in allowed if known == name})


def _unknown(folder: Path, entered: Mapping[str, set[tuple[str, str]]]) -> Iterator[Found]:
    """Yield the files of a run in its folder that no run was entered with.

    With a recording more, the folder gives another result.
    """
    known = {name for name, _ in entered.get(str(folder), set())}
    recorded = [file.name for readings in ("raw", "calibrated") for file in recordings(folder, readings)]
    there = [name for name in (*DOCUMENTS, *CERTIFICATES) if os.path.lexists(folder / name)]
    for name in (*recorded, *there):
        if name not in known:
            yield Found(str(folder / name), "unknown", "no run in this history was entered with it")


def _names(run: Kept, folder: Path) -> set[str]:
    """What was there when the run was entered; and of what may have been written elsewhere, what is there now."""
    possible = {RESULT, *(name for certificate in run.certificates for name, _ in certificate.files)}
    return {name for name, _ in run.documents} | {name for name in possible if (folder / name).exists()}


def _held(file: Path, sha256: str, entered: set[str]) -> Found:
    if sha256 in entered:
        return Found(str(file), "ok")
    return Found(str(file), "changed", f"SHA-256 {sha256[:12]}…, which was never entered of it")


def _unreadable(file: Path, error: Exception) -> Found:
    missing = isinstance(error, FileNotFoundError)
    return Found(str(file), "missing" if missing else "changed", getattr(error, "strerror", None) or str(error))
