"""Reads entries back, by another connection than the one that wrote them, before they are reported as entered."""

import json

from sqlalchemy import Connection, Table, select

from rig.errors import Refused
from rig.history.storage import continuity, journal, schema
from rig.history.storage.address import HistoryAddress
from rig.history.storage.journal import Head


def refuse_lost(connection: Connection, address: HistoryAddress, before: Head, after: Head) -> None:
    """Check that the entries in the journal's lines after `before`, up to `after`, are present and unchanged.

    Raise Refused `entry_not_kept` for a missing or changed entry or last line, and what `continuity.refuse_another`
    raises.
    """
    if not journal.has(connection, after):
        raise _entry_not_kept(address, f"entry {after.number} of its journal")
    lines = schema.journal.c
    entered = select(lines.kind, lines.key).where(lines.number > before.number, lines.number <= after.number)
    for line in connection.execute(entered.order_by(lines.number)).all():
        refuse_missing(connection, address, journal.ENTRY_TABLES[line.kind], *json.loads(line.key))
    continuity.refuse_another(address, connection)


def refuse_missing(connection: Connection, address: HistoryAddress, table: Table, *key: int | str) -> None:
    """Raise Refused `entry_not_kept` if an entry is missing or changed."""
    if (broken := journal.unlike(connection, table, *key)) is not None:
        raise _entry_not_kept(address, f"{broken.what}: {broken.why}")


def _entry_not_kept(address: HistoryAddress, what: str) -> Refused:
    return Refused(
        "entry_not_kept",
        f"the history {address.label} has not kept an entry: {what}",
        "Look with `rig history verify`, restore the history from a backup, and enter the run with "
        "`rig history import`",
    )
