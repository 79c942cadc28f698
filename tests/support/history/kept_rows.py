"""Changes by a person with write access to a history's tables, who first removes the triggers."""

import sqlite3
from collections.abc import Sequence
from contextlib import closing

from sqlalchemy import Connection, text

from rig.history.storage import continuity


def drop_triggers(connection: Connection) -> None:
    """Remove all triggers."""
    if connection.dialect.name == "postgresql":
        connection.execute(text("DROP FUNCTION history_keeps_its_rows CASCADE"))
        return
    for name in connection.scalars(text("SELECT name FROM sqlite_master WHERE type = 'trigger'")).all():
        connection.execute(text(f"DROP TRIGGER {name}"))


def forge(file: str, *statements: str, values: Sequence[str] = ()) -> None:
    """Execute statements in a history's file without its triggers, which exist again afterwards.

    `values` are those of the first statement.
    """
    with closing(sqlite3.connect(file)) as other:
        triggers = other.execute("SELECT name, sql FROM sqlite_master WHERE type = 'trigger'").fetchall()
        for name, _ in triggers:
            other.execute(f"DROP TRIGGER {name}")
        for number, statement in enumerate(statements):
            assert other.execute(statement, values if number == 0 else ()).rowcount > 0, statement
        for _, trigger in triggers:
            other.execute(trigger)
        other.commit()
    forget_histories()


def forget_histories() -> None:
    """Make this process forget all histories it has seen, like a new process."""
    continuity._identities.clear()
