"""What was entered, a second time: a line for each entry, with the hash of its rows, numbered without gaps, chained.

So a row that was changed, added or taken away behind the rig's back is seen, and so is a line: each has the hash of
itself and of the chain before it. Somebody who may write every table can write a journal that fits from its beginning,
or leave out its end. That is seen by whoever knows a `Head` of it: a signed certificate names one.
"""

import hashlib
import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from datetime import UTC, datetime
from typing import Any, Literal

from sqlalchemy import Connection, Table, insert, select, text

from rig.history.storage import schema

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


@dataclass(frozen=True, slots=True)
class Head:
    """A line of the journal by its number, and the SHA-256 of the chain that ends there: all lines up to it."""

    number: int
    sha256: str


def alone(connection: Connection) -> None:
    """Keep others from writing until the end of the transaction. An SQLite transaction that writes is alone anyway."""
    if connection.dialect.name == "postgresql":
        connection.execute(text("SELECT pg_advisory_xact_lock(:lock)"), {"lock": LOCK})


def note(connection: Connection, table: Table, *key: int | str) -> None:
    """Note that the row with this primary key was entered, a run with all that belongs to it; `alone`."""
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
    """The end of the journal; number 0 of one that is empty."""
    lines = schema.journal.c
    newest = select(lines.number, lines.chain_sha256).order_by(lines.number.desc()).limit(1)
    last = connection.execute(newest).one_or_none()
    return Head(0, "") if last is None else Head(last.number, last.chain_sha256)


def has(connection: Connection, known: Head) -> bool:
    """Return whether there is a line with that chain. Only this line is read: `holds` reckons the chain."""
    lines = schema.journal.c
    if known.number == 0:
        return True
    chain: str | None = connection.scalar(select(lines.chain_sha256).where(lines.number == known.number))
    return chain == known.sha256


def holds(connection: Connection, known: Head) -> bool:
    """Whether the lines up to that one are those of when it was the end; `known` may be of years ago."""
    lines = select(schema.journal).where(schema.journal.c.number <= known.number).order_by(schema.journal.c.number)
    chain = ""
    for line in connection.execute(lines):
        chain = _link(chain, line._mapping)
    return chain == known.sha256


def _link(before: str, line: Mapping[Any, Any]) -> str:
    """SHA-256 of a line and of the chain before it."""
    said = [before, *(line[name] for name in ("number", "kind", "key", "sha256", "entered_utc"))]
    return hashlib.sha256(json.dumps(said, separators=(",", ":")).encode()).hexdigest()


def broken(connection: Connection) -> Iterator[Broken]:
    """What is not as the journal has it, what the journal does not have, its gaps, and where its chain is broken."""
    there = {
        (name, json.dumps(tuple(key))): (table, tuple(key))
        for name, table in ENTERED.items()
        for key in connection.execute(select(*table.primary_key)).all()
    }
    before, chain = 0, ""
    for line in connection.execute(select(schema.journal).order_by(schema.journal.c.number)).all():
        if line.number > before + 1:
            yield Broken(f"journal {before + 1} to {line.number - 1}", "missing", "what was entered then is not known")
        before, chain = line.number, _link(chain, line._mapping)
        if line.chain_sha256 != chain:
            yield Broken(f"journal {line.number}", "changed", "it does not follow from the lines before it")
            chain = line.chain_sha256
        what, found = f"{line.kind} {line.key}", there.pop((line.kind, line.key), None)
        if found is None:
            yield Broken(what, "missing", f"entered {line.entered_utc}, and not there any more")
        elif _sha256(connection, *found) != line.sha256:
            yield Broken(what, "changed", f"its rows are not those entered {line.entered_utc}")
    for kind, key in there:
        yield Broken(f"{kind} {key}", "changed", "it is there, and the journal does not know it")


def unlike(connection: Connection, table: Table, *key: int | str) -> Broken | None:
    """Whether the row with this primary key, which is there, is not as the journal has it."""
    lines = schema.journal.c
    asked = select(lines.sha256).where(lines.kind == table.name, lines.key == json.dumps(key))
    entered = connection.scalar(asked)
    what = f"{table.name} {json.dumps(key)}"
    if entered is None:
        return Broken(what, "changed", "the journal does not know it")
    if entered != _sha256(connection, table, key):
        return Broken(what, "changed", "its rows are not those entered")
    return None


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
