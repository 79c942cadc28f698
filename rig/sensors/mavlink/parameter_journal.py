"""Two sets of an autopilot's parameters, old and new: a file that restores them, and a journal during the change.

The journal is a file in the user's folder, named by the autopilot's number. It exists from before the first write until
all parameters are read back, so the next connection after an interruption detects a mixed set.
"""

import json
import os
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path
from typing import Any

from rig.config.files.user_folder import rig_folder
from rig.errors import Refused
from rig.sensors.mavlink.parameter_encoding import FORMATS, REAL32, AutopilotParameter

SCHEMA = "rig.autopilot/1"


@dataclass(frozen=True, slots=True)
class ParameterChange:
    """The parameters of one autopilot before a change, `old`, and after it, `new`; both have the same names.

    `autopilot_id` is the autopilot's number, or else its port. `backup` is the file that restores the old parameters.
    """

    autopilot_id: str
    firmware: int
    old: Mapping[str, AutopilotParameter]
    new: Mapping[str, AutopilotParameter]
    backup: Path

    def state(self, parameters: Mapping[str, AutopilotParameter]) -> str:
        """Return "old" or "new" if `parameters` equal the old or the new values bit by bit, otherwise "mixture"."""
        fields = {name: parameter.field for name, parameter in parameters.items()}
        for name, expected in (("new", self.new), ("old", self.old)):
            if fields == {key: parameter.field for key, parameter in expected.items()}:
                return name
        return "mixture"

    def serialize(self) -> str:
        """Return the text of the file: each value as four bytes in hexadecimal, and as a number for human readers."""
        sets = {
            name: {
                entry.name: {"type": entry.type, "bytes": entry.field.hex(), "value": entry.value} for entry in group
            }
            for name, group in (("old", self.old.values()), ("new", self.new.values()))
        }
        head = {"schema": SCHEMA, "autopilot": self.autopilot_id, "firmware": self.firmware, "kept": str(self.backup)}
        return json.dumps({**head, **sets}, indent=2) + "\n"

    def keep(self) -> None:
        """Write the change to the new file `backup`, which can restore the old parameters.

        Raise Refused `autopilot_not_kept`.
        """
        try:
            _write(self.backup, self.serialize(), exclusive=True)
        except OSError as error:
            raise Refused(
                "autopilot_not_kept",
                f"the old parameters cannot be kept in {self.backup}: {error.strerror or error}",
                "Choose another file with --old; nothing was changed",
            ) from error

    def begin(self) -> None:
        """Enter the change in the journal. Raise Refused `autopilot_not_kept`."""
        try:
            folder().mkdir(mode=0o700, parents=True, exist_ok=True)
            _write(_journal_path(self.autopilot_id), self.serialize(), exclusive=False)
        except OSError as error:
            raise Refused(
                "autopilot_not_kept",
                f"the change cannot be entered in {folder()}: {error.strerror or error}",
                "Make that folder writable; nothing was changed",
            ) from error

    def end(self) -> None:
        """Remove the change from the journal."""
        with suppress(FileNotFoundError):
            _journal_path(self.autopilot_id).unlink()


def find_change(autopilot_id: str) -> ParameterChange | None:
    """Return the autopilot's change in the journal, None if it has none. Raise Refused `not_an_autopilot_file`."""
    path = _journal_path(autopilot_id)
    return read_change(path) if path.exists() else None


def read_change(path: Path) -> ParameterChange:
    """Return the change in a file. Raise Refused `not_an_autopilot_file`."""
    try:
        document = json.loads(path.read_text(encoding="utf-8"))
        if document["schema"] != SCHEMA:
            raise ValueError(f"its schema is {document['schema']!r}")
        old, new = (_read_parameters(document[name], int(document["firmware"])) for name in ("old", "new"))
        if old.keys() != new.keys() or not old:
            raise ValueError("its two sets do not have the same names")
        return ParameterChange(str(document["autopilot"]), int(document["firmware"]), old, new, Path(document["kept"]))
    except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
        raise Refused(
            "not_an_autopilot_file",
            f"{path} does not hold the parameters of an autopilot: {error}",
            "Give the file that `rig autopilot store` named",
        ) from None


def folder() -> Path:
    """Return the folder of the journals. Raise as `rig_folder` does."""
    return rig_folder() / "autopilots"


def _journal_path(autopilot_id: str) -> Path:
    return folder() / f"{sha256(autopilot_id.encode()).hexdigest()[:32]}.json"


def _read_parameters(document: Mapping[str, Any], firmware: int) -> dict[str, AutopilotParameter]:
    parameters = {name: AutopilotParameter(str(name), int(entry["type"]), bytes.fromhex(entry["bytes"]), firmware)
             for name, entry in document.items()}  # fmt: skip
    for parameter in parameters.values():
        if len(parameter.field) != 4 or not (parameter.type in FORMATS or parameter.type == REAL32):
            raise ValueError(f"{parameter.name} is not a parameter")
    return parameters


def _write(path: Path, text: str, *, exclusive: bool) -> None:
    """Write a file atomically; return once it is on the disk. If `exclusive`, raise FileExistsError if it exists."""
    if exclusive and path.exists():
        raise FileExistsError(17, "there is such a file already")
    new = path.with_name(f".{path.name}.{os.getpid()}")
    with new.open("w", encoding="utf-8") as file:
        file.write(text)
        file.flush()
        os.fsync(file.fileno())
    new.replace(path)
    if os.name == "posix":
        directory = os.open(path.parent, os.O_RDONLY)
        try:
            os.fsync(directory)
        finally:
            os.close(directory)
