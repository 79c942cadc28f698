"""Numbers of a history's rows, without gaps, so that a removed row is detected."""

from collections.abc import Iterator

from sqlalchemy import Connection, Table, func, select

from rig.history.storage import schema
from rig.history.storage.journal import Broken

NUMBERED_TABLES = (schema.run, schema.location, schema.calibration, schema.certificate)


def next_number(connection: Connection, table: Table) -> int:
    """Return the number of the next row, in a transaction during which no other connection can write."""
    return int(connection.scalar(select(func.coalesce(func.max(table.c.id), 0))) or 0) + 1


def gaps(connection: Connection) -> Iterator[Broken]:
    """Yield the gaps in the row numbers of the history's tables."""
    for table in NUMBERED_TABLES:
        before = 0
        for number in connection.scalars(select(table.c.id).order_by(table.c.id)):
            if number > before + 1:
                missing = f"{before + 1}" if number == before + 2 else f"{before + 1} to {number - 1}"
                yield Broken(f"{table.name} {missing}", "missing", "rows are numbered without gaps")
            before = number
