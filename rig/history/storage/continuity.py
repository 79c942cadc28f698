"""Identity of the histories that this process has opened, to detect another history at the same address.

A history is identified by its file, its time of creation, and the last seen entry of its journal, which remains for
ever because entries are only added.
"""

from dataclasses import dataclass
from pathlib import Path

from sqlalchemy import URL, Connection, select

from rig.config.files.regular_file import FileIdentity, file_identity
from rig.errors import Refused
from rig.history.storage import journal, schema
from rig.history.storage.address import HistoryAddress
from rig.history.storage.journal import Head

REMEDY = "Restore the history, then enter what is missing with `rig history import`; a new program uses what is there"


@dataclass(frozen=True, slots=True)
class _Identity:
    """The identity of an opened history: `file`, time of creation, and last line of the journal."""

    file: FileIdentity | None
    created_utc: str | None
    head: Head


_identities: dict[Path | URL, _Identity] = {}


def is_there(address: HistoryAddress) -> bool:
    """Return whether there is a history; True for a server, which is not asked. Raise as `refuse_another_file` does."""
    refuse_another_file(address)
    return not isinstance(address.where, Path) or address.where.exists()


def refuse_another_file(address: HistoryAddress) -> None:
    """Raise Refused `history_gone`, `history_exchanged` if the file of a known history is gone or was replaced."""
    identity = _identities.get(address.where)
    if identity is not None and isinstance(address.where, Path):
        refuse_unlike(identity.file, address.where, address.label)


def refuse_unlike(before: FileIdentity | None, file: Path, label: str) -> None:
    """Raise Refused `history_gone`, `history_exchanged` for a file whose identity differs from the earlier one."""
    now = file_identity(file)
    if now is None and before is not None:
        raise _history_gone(label)
    if now != before:
        raise _history_exchanged(label)


def refuse_emptied(address: HistoryAddress) -> None:
    """Raise Refused `history_gone` for a history that had tables before and no longer has any."""
    if address.where in _identities:
        raise _history_gone(address.label)


def refuse_another(address: HistoryAddress, connection: Connection) -> None:
    """Raise Refused `history_exchanged` for a history that lacks its earlier entries; otherwise store its identity."""
    identity, created_utc = _identities.get(address.where), _read_created_utc(connection)
    if identity is not None and (identity.created_utc != created_utc or not journal.has(connection, identity.head)):
        raise _history_exchanged(address.label)
    file = file_identity(address.where) if isinstance(address.where, Path) else None
    _identities[address.where] = _Identity(file, created_utc, journal.head(connection))


def _history_gone(label: str) -> Refused:
    return Refused("history_gone", f"the history {label} existed before and is gone", REMEDY)


def _history_exchanged(label: str) -> Refused:
    why = f"the history {label} has been replaced by another one since this program last used it"
    return Refused("history_exchanged", why, REMEDY)


def _read_created_utc(connection: Connection) -> str | None:
    value: str | None = connection.scalar(select(schema.meta.c.value).where(schema.meta.c.key == "created_utc"))
    return value
