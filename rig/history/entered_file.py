"""What a history knows of a file: which certificate or result it is, and whether that is still as it was entered."""

import hashlib
import json
from collections.abc import Iterator
from dataclasses import dataclass

from sqlalchemy import Connection, Table, select

from rig.errors import Refused
from rig.history.entered.finished import compact, content_sha256
from rig.history.storage import journal, schema
from rig.history.storage.journal import Head
from rig.history.store import History


@dataclass(frozen=True, slots=True)
class Known:
    """What there is to say of it, in words, and what is wrong, by the names of errors."""

    said: tuple[str, ...]
    problems: tuple[Refused, ...]


def known(history: History, name: str, content: bytes, anchor: tuple[int, str] | None) -> Known:
    """Return what the history has of a file, by its bytes, or by the values of a result.json.

    `anchor` is the journal's entry that its signature names. It is a problem, `unknown_to_history`, if the history has
    no such file; `not_as_entered` if its rows have changed since; `journal_rewritten` if the journal is not the one at
    the time of the signature.
    """
    with history.engine.connect() as connection:
        found = list(_entries(connection, content))
        if not found:
            return Known((), (_unknown(name),))
        problems = [
            _changed(name, broken)
            for table, key, _ in found
            if (broken := journal.unlike(connection, table, *key)) is not None
        ]
        if anchor is not None and not journal.holds(connection, Head(*anchor)):
            problems.append(_rewritten(name, anchor))
    return Known(tuple(words for _, _, words in found if words), tuple(problems))


def _entries(connection: Connection, content: bytes) -> Iterator[tuple[Table, tuple[int | str, ...], str]]:
    """The rows that a file is entered by: table, key, and what they say."""
    sha256 = hashlib.sha256(content).hexdigest()
    files, issued, runs = schema.certificate_file, schema.certificate, schema.run
    asked = select(files.c.name, issued).select_from(files.join(issued)).where(files.c.sha256 == sha256)
    of_runs: list[int] = []
    for row in connection.execute(asked).all():
        newer = connection.scalars(select(issued.c.number).where(issued.c.replaces == row.number)).all()
        said = [f"certificate {row.number} of run {row.run_id}, entered {row.entered_utc[:10]}"]
        said += [f"replaced by {each}" for each in newer] + ([row.marks] if row.marks else [])
        yield files, (row.id, row.name, sha256), ""
        yield issued, (row.id,), "; ".join(said)
        of_runs.append(row.run_id)
    beside = schema.document.c
    of_runs += connection.scalars(select(beside.run_id).where(beside.sha256 == sha256))
    of_runs += _runs_of(connection, content)
    for number in sorted(set(of_runs)):
        row = connection.execute(select(runs).where(runs.c.id == number)).one()
        void = _voided(connection, number)
        yield runs, (number,), "; ".join([f"run {number} of {row.started_utc[:10]}, verdict {row.verdict}", *void])


def _voided(connection: Connection, run_id: int) -> list[str]:
    rows = select(schema.voided).join(schema.calibration).where(schema.calibration.c.run_id == run_id)
    return [f"calibration {row.calibration_id} is void: {row.reason}" for row in connection.execute(rows)]


def _runs_of(connection: Connection, content: bytes) -> list[int]:
    """The runs that were entered with this result.json: with every value of it, and in its order."""
    runs = schema.run.c
    try:
        text = content.decode()
        asked = select(runs.id, runs.result).where(runs.content_sha256 == content_sha256(text))
        said = compact(json.loads(text))  # with the time it was computed, which the hash leaves out
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError):
        return []
    return [row.id for row in connection.execute(asked) if row.result == said]


def _unknown(name: str) -> Refused:
    why = f"the history knows no file like {name}, byte for byte"
    return Refused(
        "unknown_to_history", why, "Ask the laboratory which certificate it has issued; see `rig history show`"
    )


def _changed(name: str, broken: journal.Broken) -> Refused:
    why = f"what the history has of {name} is not what was entered: {broken.what}: {broken.why}"
    return Refused("not_as_entered", why, "Look with `rig history verify`, and bring the history back from a back-up")


def _rewritten(name: str, anchor: tuple[int, str]) -> Refused:
    why = f"{name} was signed after entry {anchor[0]} of a journal, which the history's journal does not have so"
    remedy = "Look with `rig history verify`, and compare the history with its back-ups"
    return Refused("journal_rewritten", why, remedy)
