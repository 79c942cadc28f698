"""The journal of a batch: a line for each entry, on the disk before anything follows it.

What a kill cut off in the middle of a line was never entered.
"""

import json
import os
from collections.abc import Iterator
from dataclasses import asdict, dataclass, field
from pathlib import Path

from rig.batch.batch import Batch, BatchEnded, Begun, Entry, PartBegun, PartEnded, after, state_of
from rig.config.files.regular_file import UnfitFile, read_regular_file
from rig.config.files.written_file import open_to_append
from rig.data.checked import parse_json, validate
from rig.data.run_folder import empty_folder, folder_of_its_own, refuse_links
from rig.errors import Refused

JOURNAL = "batch.jsonl"
LARGEST_BYTES = 16_000_000
_KINDS: dict[str, type[Entry]] = {
    "batch_begun": Begun,
    "part_begun": PartBegun,
    "part_ended": PartEnded,
    "batch_ended": BatchEnded,
}
_NAMES = {kind: name for name, kind in _KINDS.items()}


@dataclass(slots=True)
class Journal:
    """The journal in a batch's folder, and the batch as it tells it."""

    folder: Path
    batch: Batch
    _path: Path = field(init=False)

    def __post_init__(self) -> None:
        self._path = self.folder / JOURNAL

    def enter(self, entry: Entry) -> None:
        """Write an entry, whole and on the disk when this returns. Raises ValueError for one that cannot follow."""
        self.batch = after(self.batch, entry)
        _append(self._path, entry)


def opened(out: Path | None, parent: Path, entry: Begun) -> Journal:
    """The batch in the folder `out`, gone on with or begun there; without `out` a new one in a folder below `parent`.

    Raises Refused `run_folder` and as `resumed`; `no_batch` where one was measured and the other is simulated.
    """
    if out is not None and (out / JOURNAL).exists():
        journal = resumed(out)
        if journal.batch.begun.simulated != entry.simulated:
            begun = "in a simulated laboratory" if journal.batch.begun.simulated else "on a real rig"
            raise _not_gone_on_with(out, f"it was begun {begun}")
        return journal
    folder = empty_folder(out) if out is not None else folder_of_its_own(parent, "batch")
    try:
        _append(folder / JOURNAL, entry)
    except OSError as error:
        (folder / JOURNAL).unlink(missing_ok=True)  # half an entry begins no batch, and would be in the way of one
        raise Refused("run_folder", f"{folder} cannot be written: {error}", "Choose another with --out") from error
    return Journal(folder, state_of([entry]))


def resumed(folder: Path) -> Journal:
    """The journal that lies in `folder`; half a line at its end is cut off.

    Raises Refused `no_batch`, and as `refuse_links`.
    """
    path = folder / JOURNAL
    try:
        text = read_regular_file(path, LARGEST_BYTES, follow_links=False)
        whole = text[: text.rfind(b"\n") + 1]
        batch = state_of(_entries(whole))
        if len(whole) < len(text):
            os.truncate(path, len(whole))
    except (OSError, UnfitFile, ValueError, TypeError, KeyError, AttributeError, RecursionError) as error:
        raise _not_gone_on_with(folder, str(error)) from error
    part = folder if batch.in_hand is None else folder / batch.in_hand.folder
    refuse_links(*folder.iterdir(), *(part.iterdir() if part.is_dir() else ()))
    return Journal(folder, batch)


def _not_gone_on_with(folder: Path, why: str) -> Refused:
    return Refused(
        "no_batch",
        f"{folder / JOURNAL} cannot be gone on with: {why}",
        "Begin a new batch in another folder: rig station CONFIG --out DIR",
    )


def _entries(text: bytes) -> Iterator[Entry]:
    for line in text.splitlines():
        said = parse_json(line)
        kind = _KINDS[said.pop("entry")]
        yield validate(kind, said, "entry")


def _append(path: Path, entry: Entry) -> None:
    line = json.dumps({"entry": _NAMES[type(entry)], **asdict(entry)}, ensure_ascii=False) + "\n"
    try:
        with os.fdopen(open_to_append(path), "ab") as file:
            file.write(line.encode())
            file.flush()
            os.fsync(file.fileno())
    except OSError as error:
        error.filename = error.filename or str(path)  # a full disk does not say of which file
        raise
