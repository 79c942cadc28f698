"""The numbers of a history's rows: counted up by one, so that a row that was taken away leaves a gap."""

from collections.abc import Iterator

from sqlalchemy import Connection, Table, func, inspect, select

from rig.history import schema
from rig.history.journal import Broken

NUMBERED = (schema.run, schema.location, schema.calibration, schema.certificate)


def next_number(connection: Connection, table: Table) -> int:
    """Return the number of the next row, in a transaction that writes alone."""
    return int(connection.scalar(select(func.coalesce(func.max(table.c.id), 0))) or 0) + 1


def gaps(connection: Connection) -> Iterator[Broken]:
    """Yield the numbers that no row has; none of a table that a sequence of PostgreSQL numbered once.

    A sequence leaves gaps itself: where a transaction ended without its rows, or a server.
    """
    for table in NUMBERED:
        of_database = {each["name"]: each["default"] for each in inspect(connection).get_columns(table.name)}
        if of_database["id"] is not None:
            continue
        before = 0
        for number in connection.scalars(select(table.c.id).order_by(table.c.id)):
            if number > before + 1:
                missing = f"{before + 1}" if number == before + 2 else f"{before + 1} to {number - 1}"
                yield Broken(f"{table.name} {missing}", "missing", "rows are numbered without gaps")
            before = number
