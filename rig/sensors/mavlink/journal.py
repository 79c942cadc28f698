"""Two sets of an autopilot's parameters, the old and the new: a file that restores them, and one while they change.

The journal lies in a folder of the user's own, by the autopilot's number, from before the first parameter is written
until all are read back. So whoever connects next, however the writing ended, hears of a set that is neither.
"""

import json
import os
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path
from typing import Any

from rig.config.files.own_folder import own_folder
from rig.errors import Refused
from rig.sensors.mavlink.parameters import REAL32, WHOLE, Parameter

SCHEMA = "rig.autopilot/1"


@dataclass(frozen=True, slots=True)
class Change:
    """Parameters of one autopilot as they were, `old`, and as they are to be, `new`; both hold the same names.

    `place` is its number, or its port where it tells none. `kept` is the file that restores them.
    """

    place: str
    firmware: int
    old: Mapping[str, Parameter]
    new: Mapping[str, Parameter]
    kept: Path

    def state(self, parameters: Mapping[str, Parameter]) -> str:
        """Which of them `parameters` are, bit by bit: "old", "new" or, where it is neither, "mixture"."""
        fields = {name: each.field for name, each in parameters.items()}
        for name, meant in (("new", self.new), ("old", self.old)):
            if fields == {each: parameter.field for each, parameter in meant.items()}:
                return name
        return "mixture"

    def written(self) -> str:
        """The text of the file: four bytes of each value in hexadecimal, and what they mean for who reads it."""
        sets = {
            name: {each.name: {"type": each.type, "bytes": each.field.hex(), "value": each.value} for each in one}
            for name, one in (("old", self.old.values()), ("new", self.new.values()))
        }
        document = {"schema": SCHEMA, "autopilot": self.place, "firmware": self.firmware, "kept": str(self.kept)}
        return json.dumps({**document, **sets}, indent=2) + "\n"

    def keep(self) -> None:
        """Write the file that restores them. Raises Refused `autopilot_not_kept`; one that is there is not replaced."""
        try:
            _write(self.kept, self.written(), exclusive=True)
        except OSError as error:
            raise Refused(
                "autopilot_not_kept",
                f"the old parameters cannot be kept in {self.kept}: {error.strerror or error}",
                "Choose another file with --old; nothing was changed",
            ) from error

    def begin(self) -> None:
        """Enter it in the journal. Raises Refused `autopilot_not_kept`."""
        try:
            folder().mkdir(mode=0o700, parents=True, exist_ok=True)
            _write(_journal(self.place), self.written(), exclusive=False)
        except OSError as error:
            raise Refused(
                "autopilot_not_kept",
                f"the change cannot be entered in {folder()}: {error.strerror or error}",
                "Make that folder writable; nothing was changed",
            ) from error

    def end(self) -> None:
        """Take it out of the journal."""
        with suppress(FileNotFoundError):
            _journal(self.place).unlink()


def begun(place: str) -> Change | None:
    """The change of that autopilot that the journal holds. Raises Refused `not_an_autopilot_file`."""
    path = _journal(place)
    return change_in(path) if path.exists() else None


def change_in(path: Path) -> Change:
    """The change in a file. Raises Refused `not_an_autopilot_file`."""
    try:
        document = json.loads(path.read_text(encoding="utf-8"))
        if document["schema"] != SCHEMA:
            raise ValueError(f"its schema is {document['schema']!r}")
        old, new = (_parameters(document[name], int(document["firmware"])) for name in ("old", "new"))
        if old.keys() != new.keys() or not old:
            raise ValueError("its two sets have not the same names")
        return Change(str(document["autopilot"]), int(document["firmware"]), old, new, Path(document["kept"]))
    except (OSError, ValueError, KeyError, TypeError, AttributeError) as error:
        raise Refused(
            "not_an_autopilot_file",
            f"{path} does not hold the parameters of an autopilot: {error}",
            "Give the file that `rig autopilot store` named",
        ) from None


def folder() -> Path:
    """Where the journals lie. Raises as `own_folder`."""
    return own_folder() / "autopilots"


def _journal(place: str) -> Path:
    return folder() / f"{sha256(place.encode()).hexdigest()[:32]}.json"


def _parameters(document: Mapping[str, Any], firmware: int) -> dict[str, Parameter]:
    found = {name: Parameter(str(name), int(each["type"]), bytes.fromhex(each["bytes"]), firmware)
             for name, each in document.items()}  # fmt: skip
    for each in found.values():
        if len(each.field) != 4 or not (each.type in WHOLE or each.type == REAL32):
            raise ValueError(f"{each.name} is no parameter")
    return found


def _write(path: Path, text: str, *, exclusive: bool) -> None:
    """Whole or not at all, and on the disk when it returns."""
    if exclusive and path.exists():
        raise FileExistsError(17, "there is such a file already")
    new = path.with_name(f".{path.name}.{os.getpid()}")
    with new.open("w", encoding="utf-8") as file:
        file.write(text)
        file.flush()
        os.fsync(file.fileno())
    new.replace(path)
    if os.name == "posix":
        inside = os.open(path.parent, os.O_RDONLY)
        try:
            os.fsync(inside)
        finally:
            os.close(inside)
