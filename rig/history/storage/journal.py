"""The journal of entries: a line for each entry, with the hash of its rows, numbered without gaps and chained.

So a row changed, added or removed outside of the rig is detected. A changed line is detected too: a line contains its
own hash and the hash of the chain before it. A user who may write all tables can write a consistent new journal, or cut
off its end. Only a `Head` stored elsewhere, such as the one in a signed certificate, detects that.
"""

import hashlib
import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Any, Literal

from sqlalchemy import Connection, Table, insert, select, text

from rig.history.storage import schema

LOCK_NUMBER = 7_245_118  # an arbitrary common number: writers wait for one another
ENTRY_TABLES: Mapping[str, Table] = {
    table.name: table
    for table in (schema.run, schema.location, schema.voided, schema.certificate, schema.certificate_file)
}


@dataclass(frozen=True, slots=True)
class Broken:
    """An inconsistency of a history: `what` is inconsistent, whether it has changed or is missing, and `why`."""

    what: str
    state: Literal["changed", "missing"]
    why: str


@dataclass(frozen=True, slots=True)
class Head:
    """A line of the journal: its number, and the SHA-256 of the chain of all lines up to it."""

    number: int
    sha256: str


def lock_out_writers(connection: Connection) -> None:
    """Lock out other writers until the transaction ends; on SQLite, a writing transaction is exclusive anyway."""
    if connection.dialect.name == "postgresql":
        connection.execute(text("SELECT pg_advisory_xact_lock(:lock)"), {"lock": LOCK_NUMBER})


def note(connection: Connection, table: Table, *key: int | str) -> None:
    """Add a line with the hash of the row of `table` that has this primary `key`. Call `lock_out_writers` before.

    The hash of a run's row also covers the rows of the run's recordings, documents, calibrations and parameters.
    """
    before = head(connection)
    line = {
        "number": before.number + 1,
        "kind": table.name,
        "key": json.dumps(key),
        "sha256": _sha256(connection, table, key),
        "entered_utc": datetime.now(UTC).isoformat(timespec="milliseconds"),
    }
    connection.execute(insert(schema.journal).values({**line, "chain_sha256": _link(before.sha256, line)}))


def head(connection: Connection) -> Head:
    """Return number and hash of the last line; number 0 if the journal is empty."""
    lines = schema.journal.c
    newest = select(lines.number, lines.chain_sha256).order_by(lines.number.desc()).limit(1)
    last = connection.execute(newest).one_or_none()
    return Head(0, "") if last is None else Head(last.number, last.chain_sha256)


def has(connection: Connection, earlier: Head) -> bool:
    """Return whether the journal has a line with this number and chain hash."""
    lines = schema.journal.c
    if earlier.number == 0:
        return True
    chain: str | None = connection.scalar(select(lines.chain_sha256).where(lines.number == earlier.number))
    return chain == earlier.sha256


def holds(connection: Connection, earlier: Head) -> bool:
    """Return whether all lines up to an `earlier` end of the journal, perhaps years old, are unchanged."""
    lines = select(schema.journal).where(schema.journal.c.number <= earlier.number).order_by(schema.journal.c.number)
    chain = ""
    for line in connection.execute(lines):
        chain = _link(chain, line._mapping)
    return chain == earlier.sha256


def _link(before: str, line: Mapping[Any, Any]) -> str:
    """Return the SHA-256 of a line together with the chain before it."""
    parts = [before, *(line[name] for name in ("number", "kind", "key", "sha256", "entered_utc"))]
    return hashlib.sha256(json.dumps(parts, separators=(",", ":")).encode()).hexdigest()


def broken(connection: Connection) -> Iterator[Broken]:
    """Yield all rows that differ from the journal or that it lacks, and all gaps and breaks in its chain."""
    remaining = {
        (name, json.dumps(tuple(key))): (table, tuple(key))
        for name, table in ENTRY_TABLES.items()
        for key in connection.execute(select(*table.primary_key)).all()
    }
    before, chain = 0, ""
    for line in connection.execute(select(schema.journal).order_by(schema.journal.c.number)).all():
        if line.number > before + 1:
            yield Broken(f"journal {before + 1} to {line.number - 1}", "missing", "these entries are unknown")
        before, chain = line.number, _link(chain, line._mapping)
        if line.chain_sha256 != chain:
            yield Broken(f"journal {line.number}", "changed", "it does not follow from the lines before it")
            chain = line.chain_sha256
        what, row = f"{line.kind} {line.key}", remaining.pop((line.kind, line.key), None)
        if row is None:
            yield Broken(what, "missing", f"entered {line.entered_utc}, and no longer there")
        elif _sha256(connection, *row) != line.sha256:
            yield Broken(what, "changed", f"its rows have changed since their entry, {line.entered_utc}")
    for kind, key in remaining:
        yield Broken(f"{kind} {key}", "changed", "it exists, but the journal does not have it")


def unlike(connection: Connection, table: Table, *key: int | str) -> Broken | None:
    """Return the difference of the row with the primary `key` from the journal; None if there is no difference."""
    lines = schema.journal.c
    query = select(lines.sha256).where(lines.kind == table.name, lines.key == json.dumps(key))
    entered = connection.scalar(query)
    what = f"{table.name} {json.dumps(key)}"
    if entered is None:
        return Broken(what, "changed", "the journal does not have it")
    if entered != _sha256(connection, table, key):
        return Broken(what, "changed", "its rows have changed since their entry")
    return None


def _sha256(connection: Connection, table: Table, key: tuple[int | str, ...]) -> str:
    rows = [[name, row] for name, row in _rows(connection, table, key)]
    canonical = json.dumps(rows, sort_keys=True, separators=(",", ":"), ensure_ascii=False)
    return hashlib.sha256(canonical.encode()).hexdigest()


def _rows(connection: Connection, table: Table, key: tuple[int | str, ...]) -> Iterator[tuple[str, dict[str, Any]]]:
    """Yield the table's name and the values of the row with this `key`, and for a run also of every row of its parts.

    Null values are left out, so that a column added later changes no hash.
    """
    condition = [column == value for column, value in zip(table.primary_key, key, strict=True)]
    questions = [(table.name, select(table).where(*condition))]
    if table is schema.run:
        (number,) = key
        for part in (schema.recording, schema.document, schema.calibration):
            query = select(part).where(part.c.run_id == number).order_by(*part.primary_key)
            questions.append((part.name, query))
        joined = schema.parameter.join(schema.calibration)
        query = select(schema.parameter).select_from(joined).where(schema.calibration.c.run_id == number)
        questions.append((schema.parameter.name, query.order_by(*schema.parameter.primary_key)))
    for name, question in questions:
        for row in connection.execute(question):
            yield name, {column: value for column, value in row._asdict().items() if value is not None}
