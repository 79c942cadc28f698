"""The database itself says no to whoever changes or takes away a row, by whatever program.

It guards against mistakes and against roles without the right to drop triggers, not against the owner of the database.
"""

from collections.abc import Iterator

from sqlalchemy import Connection, Table, UniqueConstraint

from rig.history import schema

NO = "a history keeps its rows as they were entered"
# A migration says so in `meta`; nothing else there changes.
NEWER = "OLD.key = 'version' AND NEW.key = 'version' AND CAST(NEW.value AS INTEGER) > CAST(OLD.value AS INTEGER)"


def create_triggers(connection: Connection) -> None:
    """Create the triggers on every table of a history, which has none yet."""
    statements = _postgresql() if connection.dialect.name == "postgresql" else _sqlite()
    for statement in statements:
        connection.exec_driver_sql(statement)


def _sqlite() -> Iterator[str]:
    for table in schema.metadata.sorted_tables:
        unless = f"WHEN NOT ({NEWER})" if table is schema.meta else ""
        refused = f"BEGIN SELECT RAISE(ABORT, '{NO}'); END"
        yield f"CREATE TRIGGER {table}_not_changed BEFORE UPDATE ON {table} {unless} {refused}"
        yield f"CREATE TRIGGER {table}_not_removed BEFORE DELETE ON {table} {refused}"
        # INSERT OR REPLACE removes a row without asking the trigger above.
        there = f"EXISTS (SELECT 1 FROM {table} WHERE {_same_row(table)})"
        yield f"CREATE TRIGGER {table}_not_replaced BEFORE INSERT ON {table} WHEN {there} {refused}"


def _same_row(table: Table) -> str:
    """Where a row of `table` has a key of the new one."""
    keys = [list(table.primary_key.columns)]
    keys += [list(each.columns) for each in table.constraints if isinstance(each, UniqueConstraint)]
    keys += [list(index.columns) for index in table.indexes if index.unique]
    return " OR ".join(
        "(" + " AND ".join(f'{table}."{column.name}" = NEW."{column.name}"' for column in key) + ")" for key in keys
    )


def _postgresql() -> Iterator[str]:
    raised = f"RAISE EXCEPTION USING MESSAGE = '{NO}: ' || TG_OP || ' of ' || TG_TABLE_NAME"
    yield (f"CREATE FUNCTION history_keeps_its_rows() RETURNS trigger LANGUAGE plpgsql AS $$ BEGIN {raised}; END $$")
    said = "EXECUTE FUNCTION history_keeps_its_rows()"
    for table in schema.metadata.sorted_tables:
        if table is schema.meta:
            yield f"CREATE TRIGGER not_changed BEFORE UPDATE ON {table} FOR EACH ROW WHEN (NOT ({NEWER})) {said}"
            yield f"CREATE TRIGGER not_removed BEFORE DELETE OR TRUNCATE ON {table} FOR EACH STATEMENT {said}"
        else:
            changes = "UPDATE OR DELETE OR TRUNCATE"
            yield f"CREATE TRIGGER not_changed BEFORE {changes} ON {table} FOR EACH STATEMENT {said}"
