"""What this process knows of the histories it has opened, so that none is taken for another that came in its place.

A history is known by its file, by when it was made, and by the last entry of its journal that was seen: as entries are
only added, it has that one for ever.
"""

from dataclasses import dataclass
from pathlib import Path

from sqlalchemy import URL, Connection, select

from rig.config.files.regular_file import FileIdentity, file_identity
from rig.errors import Refused
from rig.history.storage import journal, schema
from rig.history.storage.address import Place
from rig.history.storage.journal import Head

REMEDY = (
    "Bring the history back, then enter what is missing with `rig history import`; a program that is started now takes "
    "what is there"
)


@dataclass(frozen=True, slots=True)
class _Known:
    file: FileIdentity | None
    created_utc: str | None
    head: Head


_known: dict[Path | URL, _Known] = {}


def is_there(place: Place) -> bool:
    """Return whether there is something to open; of a server that is not known before it is asked.

    Raises Refused as `refuse_another_file`.
    """
    refuse_another_file(place)
    return not isinstance(place.where, Path) or place.where.exists()


def refuse_another_file(place: Place) -> None:
    """Refuse a history's file that is not the one of before. Raises Refused `history_gone`, `history_exchanged`."""
    known = _known.get(place.where)
    if known is not None and isinstance(place.where, Path):
        refuse_unlike(known.file, place.where, place.label)


def refuse_unlike(before: FileIdentity | None, file: Path, label: str) -> None:
    """Refuse a file that is not what lay there before. Raises Refused `history_gone`, `history_exchanged`."""
    now = file_identity(file)
    if now is None and before is not None:
        raise _gone(label)
    if now != before:
        raise _exchanged(label)


def refuse_anew(place: Place) -> None:
    """Refuse to make the tables of a history that had them before. Raises Refused `history_gone`."""
    if place.where in _known:
        raise _gone(place.label)


def refuse_another(place: Place, connection: Connection) -> None:
    """Refuse a history that lacks what it had before, and note what it has now. Raises Refused `history_exchanged`."""
    known, created_utc = _known.get(place.where), _created_utc(connection)
    if known is not None and (known.created_utc != created_utc or not journal.has(connection, known.head)):
        raise _exchanged(place.label)
    file = file_identity(place.where) if isinstance(place.where, Path) else None
    _known[place.where] = _Known(file, created_utc, journal.head(connection))


def _gone(label: str) -> Refused:
    return Refused("history_gone", f"the history {label} was there before, and is not there any more", REMEDY)


def _exchanged(label: str) -> Refused:
    why = f"the history {label} is not the one with which this program has worked before: another lies in its place"
    return Refused("history_exchanged", why, REMEDY)


def _created_utc(connection: Connection) -> str | None:
    found: str | None = connection.scalar(select(schema.meta.c.value).where(schema.meta.c.key == "created_utc"))
    return found
