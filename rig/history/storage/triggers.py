"""Triggers of the database that refuse changes and removals of rows by any program.

They protect against mistakes and against roles without the right to drop triggers, not against the owner of the
database. `unlike_made` detects missing or changed triggers.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from sqlalchemy import Connection, Table, UniqueConstraint, text

from rig.history.storage import schema
from rig.history.storage.journal import Broken

REFUSAL = "a history keeps its rows as they were entered"
# A migration changes the version in `meta`; nothing else there changes.
NEWER_VERSION = (
    "OLD.key = 'schema_version' AND NEW.key = 'schema_version' "
    "AND CAST(NEW.value AS INTEGER) > CAST(OLD.value AS INTEGER)"
)
FUNCTION = "history_keeps_its_rows"
_BODY = f" BEGIN RAISE EXCEPTION USING MESSAGE = '{REFUSAL}: ' || TG_OP || ' of ' || TG_TABLE_NAME; END "
# Bits of pg_trigger.tgtype for the properties of a trigger (PostgreSQL's catalog/pg_trigger.h).
_BITS: Mapping[str, int] = {"ROW": 1, "BEFORE": 2, "DELETE": 8, "UPDATE": 16, "TRUNCATE": 32}
_FIRES = ("O", "A")  # pg_trigger.tgenabled: fires in sessions without replication, or in all
_MADE_BY_SERVER = text(
    "SELECT c.relname, t.tgname, t.tgenabled, t.tgtype, t.tgqual IS NOT NULL, p.prosrc FROM pg_trigger t "
    "JOIN pg_class c ON c.oid = t.tgrelid JOIN pg_proc p ON p.oid = t.tgfoid "
    "WHERE NOT t.tgisinternal AND c.relnamespace = current_schema()::regnamespace"
)


@dataclass(frozen=True, slots=True)
class _ServerTrigger:
    """A trigger of PostgreSQL: its events, its level (for each row or statement), and its condition, if any."""

    table: Table
    name: str
    events: tuple[str, ...]
    level: str = "STATEMENT"
    condition: str = ""

    @property
    def statement(self) -> str:
        when = f"WHEN ({self.condition}) " if self.condition else ""
        fires = f"BEFORE {' OR '.join(self.events)} ON {self.table} FOR EACH {self.level} {when}"
        return f"CREATE TRIGGER {self.name} {fires}EXECUTE FUNCTION {FUNCTION}()"

    @property
    def bits(self) -> int:
        return sum(_BITS.get(word, 0) for word in ("BEFORE", self.level, *self.events))


def create_triggers(connection: Connection) -> None:
    """Create the triggers on all tables of a new history."""
    if connection.dialect.name == "postgresql":
        connection.exec_driver_sql(f"CREATE FUNCTION {FUNCTION}() RETURNS trigger LANGUAGE plpgsql AS $${_BODY}$$")
        for trigger in _server_triggers():
            connection.exec_driver_sql(trigger.statement)
        return
    for statement in _file_triggers().values():
        connection.exec_driver_sql(statement)


def unlike_made(connection: Connection) -> Iterator[Broken]:
    """Yield triggers that are missing, disabled, or different from the original ones."""
    if connection.dialect.name == "postgresql":
        yield from _unlike_made_by_server(connection)
        return
    query = text("SELECT name, sql FROM sqlite_master WHERE type = 'trigger'")
    existing = {row.name: row.sql for row in connection.execute(query)}
    for name, statement in _file_triggers().items():
        if name not in existing:
            yield _report_missing_trigger(name)
        elif existing[name].split() != statement.split():
            yield _report_changed_trigger(name)


def _unlike_made_by_server(connection: Connection) -> Iterator[Broken]:
    """Yield PostgreSQL's triggers that are missing, disabled or changed."""
    existing = {(table, name): row for table, name, *row in connection.execute(_MADE_BY_SERVER)}
    for trigger in _server_triggers():
        name, row = f"{trigger.name} of {trigger.table}", existing.get((trigger.table.name, trigger.name))
        if row is None:
            yield _report_missing_trigger(name)
            continue
        fires, bits, conditional, body = row
        if fires not in _FIRES:
            yield Broken(f"trigger {name}", "changed", "it is disabled, so that rows can be changed or removed")
        elif (bits, conditional, body) != (trigger.bits, bool(trigger.condition), _BODY):
            yield _report_changed_trigger(name)


def _report_missing_trigger(name: str) -> Broken:
    return Broken(f"trigger {name}", "missing", "it was dropped, so that rows can be changed or removed")


def _report_changed_trigger(name: str) -> Broken:
    return Broken(f"trigger {name}", "changed", "it is not the one with which the history was made")


def _file_triggers() -> Mapping[str, str]:
    """Return the statements that make SQLite's triggers, by the triggers' names."""
    statements: dict[str, str] = {}
    for table in schema.metadata.sorted_tables:
        unless = f"WHEN NOT ({NEWER_VERSION})" if table is schema.meta else ""
        refused = f"BEGIN SELECT RAISE(ABORT, '{REFUSAL}'); END"
        # INSERT OR REPLACE removes a row without firing the trigger of removal.
        exists = f"EXISTS (SELECT 1 FROM {table} WHERE {_same_row(table)})"
        for name, fires in {
            f"{table}_not_changed": f"BEFORE UPDATE ON {table} {unless}",
            f"{table}_not_removed": f"BEFORE DELETE ON {table}",
            f"{table}_not_replaced": f"BEFORE INSERT ON {table} WHEN {exists}",
        }.items():
            statements[name] = f"CREATE TRIGGER {name} {fires} {refused}"
    return statements


def _same_row(table: Table) -> str:
    """Return the SQL condition under which a row of `table` has the new row's primary key or one of its unique keys."""
    keys = [list(table.primary_key.columns)]
    keys += [list(unique.columns) for unique in table.constraints if isinstance(unique, UniqueConstraint)]
    keys += [list(index.columns) for index in table.indexes if index.unique]
    return " OR ".join(
        "(" + " AND ".join(f'{table}."{column.name}" = NEW."{column.name}"' for column in key) + ")" for key in keys
    )


def _server_triggers() -> Iterator[_ServerTrigger]:
    for table in schema.metadata.sorted_tables:
        if table is schema.meta:
            yield _ServerTrigger(table, "not_changed", ("UPDATE",), "ROW", f"NOT ({NEWER_VERSION})")
            yield _ServerTrigger(table, "not_removed", ("DELETE", "TRUNCATE"))
        else:
            yield _ServerTrigger(table, "not_changed", ("UPDATE", "DELETE", "TRUNCATE"))
