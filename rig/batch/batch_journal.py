"""The journal of a batch: a line for each entry, complete on the disk before the next step."""

import json
import os
from collections.abc import Iterator
from dataclasses import asdict, dataclass, field
from pathlib import Path

from rig.batch.batch_state import Batch, BatchEnded, Begun, Entry, PartBegun, PartEnded, after, state_of
from rig.config.files.regular_file import UnfitFile, read_regular_file
from rig.config.files.safe_writing import open_to_append
from rig.data.run_folder import empty_folder, folder_of_its_own, refuse_links, refuse_unwritable
from rig.data.validation import parse_json, validate
from rig.errors import Refused

JOURNAL = "batch.jsonl"
MAX_BYTES = 16_000_000
_KINDS: dict[str, type[Entry]] = {
    "batch_begun": Begun,
    "part_begun": PartBegun,
    "part_ended": PartEnded,
    "batch_ended": BatchEnded,
}
_NAMES = {kind: name for name, kind in _KINDS.items()}


@dataclass(slots=True)
class Journal:
    """The journal in a batch's folder, with the batch that its entries describe."""

    folder: Path
    batch: Batch
    _path: Path = field(init=False)

    def __post_init__(self) -> None:
        self._path = self.folder / JOURNAL

    def enter(self, entry: Entry) -> None:
        """Write an entry to the disk before returning. Raise ValueError if it cannot follow the last entry."""
        self.batch = after(self.batch, entry)
        _append(self._path, entry)


def open_journal(out: Path | None, parent: Path, entry: Begun) -> Journal:
    """Continue or begin the batch in the folder `out`; without `out` begin one in a new folder below `parent`.

    Raise Refused `run_folder`, and what `resume_journal` raises; `no_batch` if the begun batch is simulated and this
    one is not, or the reverse.
    """
    if out is not None and (out / JOURNAL).exists():
        journal = resume_journal(out)
        if journal.batch.begun.simulated != entry.simulated:
            begun = "in a simulated laboratory" if journal.batch.begun.simulated else "on a real rig"
            raise _unusable(out, f"it was begun {begun}")
        return journal
    folder = empty_folder(out) if out is not None else folder_of_its_own(parent, "batch")
    with refuse_unwritable(folder):
        try:
            _append(folder / JOURNAL, entry)
        except OSError:
            (folder / JOURNAL).unlink(missing_ok=True)  # an incomplete entry starts no batch, and would prevent one
            raise
    return Journal(folder, state_of([entry]))


def resume_journal(folder: Path) -> Journal:
    """Return the journal in `folder` without an incomplete last line.

    Raise Refused `no_batch`, and what `refuse_links` raises.
    """
    path = folder / JOURNAL
    try:
        text = read_regular_file(path, MAX_BYTES, follow_links=False)
        complete = text[: text.rfind(b"\n") + 1]
        batch = state_of(_entries(complete))
        if len(complete) < len(text):
            os.truncate(path, len(complete))
    except (OSError, UnfitFile, ValueError, TypeError, KeyError, AttributeError, RecursionError) as error:
        raise _unusable(folder, str(error)) from error
    part = folder if batch.in_hand is None else folder / batch.in_hand.folder
    refuse_links(*folder.iterdir(), *(part.iterdir() if part.is_dir() else ()))
    return Journal(folder, batch)


def _unusable(folder: Path, why: str) -> Refused:
    return Refused(
        "no_batch",
        f"{folder / JOURNAL} cannot be continued: {why}",
        "Begin a new batch in another folder: rig station CONFIG --out DIR",
    )


def _entries(text: bytes) -> Iterator[Entry]:
    for line in text.splitlines():
        fields = parse_json(line)
        kind = _KINDS[fields.pop("entry")]
        yield validate(kind, fields, "entry")


def _append(path: Path, entry: Entry) -> None:
    """Append the entry as a line of JSON, and wait until it is on the disk."""
    line = json.dumps({"entry": _NAMES[type(entry)], **asdict(entry)}, ensure_ascii=False) + "\n"
    try:
        with os.fdopen(open_to_append(path), "ab") as file:
            file.write(line.encode())
            file.flush()
            os.fsync(file.fileno())
    except OSError as error:
        error.filename = error.filename or str(path)  # an error of a full disk does not name the file
        raise
