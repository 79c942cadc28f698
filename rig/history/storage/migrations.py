"""Creation of a history's tables when it is opened, or their migration from an older version.

A migration is a function that brings the tables of a connection to the next version. All migrations run in one
transaction and only add, so that entries remain unchanged. Versions without a migration are refused.
"""

from collections.abc import Callable, Mapping
from datetime import UTC, datetime

from sqlalchemy import Connection, insert, inspect, select, text, update

from rig.errors import Refused
from rig.history.storage import journal, schema
from rig.history.storage.triggers import create_triggers

VERSION_KEY = "schema_version"
DEVELOPMENT_KEY = "version"  # key in tables before 0.1.0, which are not migrated

MIGRATIONS: Mapping[int, Callable[[Connection], None]] = {}  # version 1 is the first released version


def version_of(connection: Connection, label: str) -> int:
    """Return a history's version, 0 if empty. Raise Refused `not_a_history`, `history_too_old`, `history_too_new`."""
    tables = inspect(connection).get_table_names()
    if not tables:
        return 0
    entries = _meta(connection) if schema.meta.name in tables else {}
    if VERSION_KEY not in entries and DEVELOPMENT_KEY in entries:
        raise too_old(label)
    version = entries.get(VERSION_KEY) or ""
    if not version.isdecimal():
        raise Refused(
            "not_a_history",
            f"{label} has the tables {', '.join(sorted(tables)[:5])}, which do not belong to a history",
            "Give a history, or a new file or database",
        )
    if int(version) > schema.VERSION:
        raise Refused(
            "history_too_new",
            f"{label} is of version {version}, made by a newer program; this one supports version {schema.VERSION}",
            "Install the newer program here as well; the history was not changed",
        )
    return int(version)


def bring_up_to_date(connection: Connection, label: str) -> None:
    """Make or migrate a history's tables in the connection's transaction. Raise Refused as `version_of` does."""
    journal.lock_out_writers(connection)
    version = version_of(connection, label)
    if version == 0:
        _make(connection)
        return
    for number in range(version, schema.VERSION):
        MIGRATIONS[number](connection)
    if version < schema.VERSION:
        newest = update(schema.meta).where(schema.meta.c.key == VERSION_KEY).values(value=str(schema.VERSION))
        connection.execute(newest)


def too_old(label: str) -> Refused:
    """Return the refusal of a history from a program before 0.1.0."""
    return Refused(
        "history_too_old",
        f"{label} was made by a program before 0.1.0, and this one does not read its tables; it was not changed",
        "Move it away, or name a new history with --history or RIG_HISTORY; then enter the run folders there with "
        "`rig history import DIR`",
    )


def _make(connection: Connection) -> None:
    if connection.dialect.name == "sqlite":
        connection.execute(text(f"PRAGMA application_id = {schema.APPLICATION_ID}"))
    schema.metadata.create_all(connection)
    create_triggers(connection)
    created = {"key": "created_utc", "value": datetime.now(UTC).isoformat(timespec="microseconds")}
    connection.execute(insert(schema.meta), [created, {"key": VERSION_KEY, "value": str(schema.VERSION)}])


def _meta(connection: Connection) -> dict[str, str | None]:
    """Return the content of `meta`; empty if a table of that name has other columns."""
    if {column["name"] for column in inspect(connection).get_columns(schema.meta.name)} != {"key", "value"}:
        return {}
    return {row.key: row.value for row in connection.execute(select(schema.meta))}
