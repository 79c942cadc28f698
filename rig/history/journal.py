"""What was entered, a second time: a line for each entry, with the hash of its rows, numbered without gaps.

So a row that was changed, added or taken away behind the rig's back is seen, and so is a line. Somebody who may write
every table can write a journal that fits: signatures are not here.
"""

import hashlib
import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Any, Literal

from sqlalchemy import Connection, Table, func, insert, select, text

from rig.history import schema

LOCK = 7_245_118  # any number, the same for everybody: writers wait for one another
ENTERED: Mapping[str, Table] = {
    each.name: each
    for each in (schema.run, schema.location, schema.voided, schema.certificate, schema.certificate_file)
}


@dataclass(frozen=True, slots=True)
class Broken:
    """What does not fit: `what` it is, and `why`."""

    what: str
    state: Literal["changed", "missing"]
    why: str


def alone(connection: Connection) -> None:
    """Keep others from writing until the end of the transaction. An SQLite transaction that writes is alone anyway."""
    if connection.dialect.name == "postgresql":
        connection.execute(text("SELECT pg_advisory_xact_lock(:lock)"), {"lock": LOCK})


def note(connection: Connection, table: Table, *key: int | str) -> None:
    """Note that the row with this primary key was entered, a run with all that belongs to it; `alone`."""
    number = connection.scalar(select(func.coalesce(func.max(schema.journal.c.number), 0) + 1))
    line = {
        "number": number,
        "kind": table.name,
        "key": json.dumps(key),
        "sha256": _sha256(connection, table, key),
        "entered_utc": datetime.now(UTC).isoformat(timespec="milliseconds"),
    }
    connection.execute(insert(schema.journal).values(line))


def note_all(connection: Connection) -> None:
    """All that is there, of a history that had no journal."""
    for table in ENTERED.values():
        for key in connection.execute(select(*table.primary_key).order_by(*table.primary_key)).all():
            note(connection, table, *key)


def broken(connection: Connection) -> Iterator[Broken]:
    """What is not as the journal has it, what the journal does not have, and the gaps in it."""
    there = {
        (name, json.dumps(tuple(key))): (table, tuple(key))
        for name, table in ENTERED.items()
        for key in connection.execute(select(*table.primary_key)).all()
    }
    before = 0
    for line in connection.execute(select(schema.journal).order_by(schema.journal.c.number)).all():
        if line.number > before + 1:
            yield Broken(f"journal {before + 1} to {line.number - 1}", "missing", "what was entered then is not known")
        before = line.number
        what, found = f"{line.kind} {line.key}", there.pop((line.kind, line.key), None)
        if found is None:
            yield Broken(what, "missing", f"entered {line.entered_utc}, and not there any more")
        elif _sha256(connection, *found) != line.sha256:
            yield Broken(what, "changed", f"its rows are not those entered {line.entered_utc}")
    for kind, key in there:
        yield Broken(f"{kind} {key}", "changed", "it is there, and the journal does not know it")


def _sha256(connection: Connection, table: Table, key: tuple[int | str, ...]) -> str:
    rows = [[name, row] for name, row in _rows(connection, table, key)]
    said = json.dumps(rows, sort_keys=True, separators=(",", ":"), ensure_ascii=False)
    return hashlib.sha256(said.encode()).hexdigest()


def _rows(connection: Connection, table: Table, key: tuple[int | str, ...]) -> Iterator[tuple[str, dict[str, Any]]]:
    """The row, and of a run those of its parts. Without nulls: a column that comes later changes no hash."""
    own = [column == value for column, value in zip(table.primary_key, key, strict=True)]
    questions = [(table.name, select(table).where(*own))]
    if table is schema.run:
        (number,) = key
        for part in (schema.recording, schema.document, schema.calibration):
            asked = select(part).where(part.c.run_id == number).order_by(*part.primary_key)
            questions.append((part.name, asked))
        of_run = schema.parameter.join(schema.calibration)
        asked = select(schema.parameter).select_from(of_run).where(schema.calibration.c.run_id == number)
        questions.append((schema.parameter.name, asked.order_by(*schema.parameter.primary_key)))
    for name, question in questions:
        for row in connection.execute(question).mappings():
            yield name, {column: value for column, value in row.items() if value is not None}
