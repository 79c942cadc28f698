"""A history's tables are made, or brought up to date, when it is opened; one of a newer program is refused.

Each step is a function from a connection to the next version, all in one transaction. Steps only add: what was entered
stays.
"""

from collections.abc import Callable, Mapping
from datetime import UTC, datetime

from sqlalchemy import Connection, Table, insert, inspect, select, text, update

from rig.errors import Refused
from rig.history import journal, schema
from rig.history.sqlite_file import APPLICATION_ID
from rig.history.triggers import create_triggers


def migrate_1_to_2(connection: Connection) -> None:
    """Calibrations can be voided."""
    schema.voided.create(connection)


def migrate_2_to_3(connection: Connection) -> None:
    """Who ran the rig, a note, and certificates' numbers: of runs before, nobody said."""
    for name, length in (("operator", schema.NAME), ("note", schema.NOTE)):
        connection.execute(text(f"ALTER TABLE run ADD COLUMN {name} VARCHAR({length})"))
    schema.certificate.create(connection)
    schema.certificate_file.create(connection)


def migrate_3_to_4(connection: Connection) -> None:
    """Rows are kept as they are: by triggers, and by a journal that begins with what is there."""
    _add_coverage_factor(connection)  # the journal reads rows as they are today
    schema.document.create(connection)
    schema.journal.create(connection)
    journal.note_all(connection)
    create_triggers(connection)


def migrate_4_to_5(connection: Connection) -> None:
    """U has a coverage factor by its degrees of freedom: of results before it is 2."""
    _add_coverage_factor(connection)


def migrate_5_to_6(connection: Connection) -> None:
    """Lines of the journal are chained; those before stay as they are, and the next one seals them."""
    if "chain_sha256" not in _columns(connection, schema.journal):  # an older history's journal was made as it is today
        connection.execute(text(f"ALTER TABLE journal ADD COLUMN chain_sha256 VARCHAR({schema.HASH})"))


def _add_coverage_factor(connection: Connection) -> None:
    """Add the coverage factor, unless an earlier step has."""
    if "coverage_factor" not in _columns(connection, schema.parameter):
        connection.execute(text("ALTER TABLE parameter ADD COLUMN coverage_factor FLOAT"))


def _columns(connection: Connection, table: Table) -> set[str]:
    return {column["name"] for column in inspect(connection).get_columns(table.name)}


MIGRATIONS: Mapping[int, Callable[[Connection], None]] = {
    1: migrate_1_to_2,
    2: migrate_2_to_3,
    3: migrate_3_to_4,
    4: migrate_4_to_5,
    5: migrate_5_to_6,
}


def version_of(connection: Connection, label: str) -> int:
    """The version of the tables there are, 0 for none. Raises Refused `not_a_history`, `history_too_new`."""
    tables = inspect(connection).get_table_names()
    if not tables:
        return 0
    found = None
    if schema.meta.name in tables:
        columns = {column["name"] for column in inspect(connection).get_columns(schema.meta.name)}
        if columns == {"key", "value"}:
            found = connection.scalar(select(schema.meta.c.value).where(schema.meta.c.key == "version"))
    if found is None or not found.isdecimal():
        raise Refused(
            "not_a_history",
            f"{label} holds {', '.join(sorted(tables)[:5])}, which do not belong to a history",
            "Give a history, or a file or database that is new",
        )
    if int(found) > schema.VERSION:
        raise Refused(
            "history_too_new",
            f"{label} is of version {found}, made by a newer program; this one knows version {schema.VERSION}",
            "Install the newer program here as well; the history was not changed",
        )
    return int(found)


def bring_up_to_date(connection: Connection, label: str) -> None:
    """Make the tables or migrate them, in the connection's transaction. Raises Refused as `version_of`."""
    journal.alone(connection)
    if connection.dialect.name == "sqlite":
        connection.execute(text(f"PRAGMA application_id = {APPLICATION_ID}"))
    version = version_of(connection, label)
    if version == 0:
        schema.metadata.create_all(connection)
        create_triggers(connection)
        created = {"key": "created_utc", "value": datetime.now(UTC).isoformat(timespec="microseconds")}
        connection.execute(insert(schema.meta), [created, {"key": "version", "value": str(schema.VERSION)}])
        return
    for number in range(version, schema.VERSION):
        MIGRATIONS[number](connection)
    if version < schema.VERSION:
        newest = update(schema.meta).where(schema.meta.c.key == "version").values(value=str(schema.VERSION))
        connection.execute(newest)
