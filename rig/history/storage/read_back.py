"""Reads entries back before anybody says that they are there; the connection is none of those that wrote them."""

import json

from sqlalchemy import Connection, Table, select

from rig.errors import Refused
from rig.history.storage import continuity, journal, schema
from rig.history.storage.address import Place
from rig.history.storage.journal import Head


def refuse_lost(connection: Connection, place: Place, before: Head, after: Head) -> None:
    """Refuse what was entered between two ends of the journal and is not there as it was entered.

    Raises Refused `entry_not_kept`, and as `continuity.refuse_another`.
    """
    if not journal.has(connection, after):
        raise _not_kept(place, f"entry {after.number} of its journal")
    lines = schema.journal.c
    entered = select(lines.kind, lines.key).where(lines.number > before.number, lines.number <= after.number)
    for line in connection.execute(entered.order_by(lines.number)).all():
        refuse_missing(connection, place, journal.ENTERED[line.kind], *json.loads(line.key))
    continuity.refuse_another(place, connection)


def refuse_missing(connection: Connection, place: Place, table: Table, *key: int | str) -> None:
    """Refuse an entry that is not there as it was entered. Raises Refused `entry_not_kept`."""
    if (broken := journal.unlike(connection, table, *key)) is not None:
        raise _not_kept(place, f"{broken.what}: {broken.why}")


def _not_kept(place: Place, what: str) -> Refused:
    return Refused(
        "entry_not_kept",
        f"the history {place.label} does not hold what was entered: {what}",
        "Look with `rig history verify`, bring the history back from a back-up, and enter the run with "
        "`rig history import`",
    )
