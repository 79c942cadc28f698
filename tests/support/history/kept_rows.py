"""What somebody does who may change the tables of a history: the triggers go first."""

import sqlite3
from collections.abc import Sequence
from contextlib import closing

from sqlalchemy import Connection, text

from rig.history.storage import continuity


def drop_triggers(connection: Connection) -> None:
    """All of them."""
    if connection.dialect.name == "postgresql":
        connection.execute(text("DROP FUNCTION history_keeps_its_rows CASCADE"))
        return
    for name in connection.scalars(text("SELECT name FROM sqlite_master WHERE type = 'trigger'")).all():
        connection.execute(text(f"DROP TRIGGER {name}"))


def forge(file: str, *statements: str, values: Sequence[str] = ()) -> None:
    """Carry these out in a history's file, without its triggers, which stand there again afterwards; `values` are those
    of the first."""
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
    """Forget what this process has seen of histories, as one that is started later has seen nothing."""
    continuity._identities.clear()
