"""What somebody does who may change the tables of a history: the triggers go first."""

import sqlite3
from collections.abc import Sequence
from contextlib import closing

from sqlalchemy import Connection, text


def drop_triggers(connection: Connection) -> None:
    """All of them."""
    if connection.dialect.name == "postgresql":
        connection.execute(text("DROP FUNCTION history_keeps_its_rows CASCADE"))
        return
    for name in connection.scalars(text("SELECT name FROM sqlite_master WHERE type = 'trigger'")).all():
        connection.execute(text(f"DROP TRIGGER {name}"))


def forge(file: str, *statements: str, values: Sequence[str] = ()) -> None:
    """Carry these out in a history's file, its triggers dropped; `values` are those of the first."""
    with closing(sqlite3.connect(file)) as other:
        for (name,) in other.execute("SELECT name FROM sqlite_master WHERE type = 'trigger'").fetchall():
            other.execute(f"DROP TRIGGER {name}")
        for number, statement in enumerate(statements):
            assert other.execute(statement, values if number == 0 else ()).rowcount > 0, statement
        other.commit()
