"""The entries in a history for a file that is a certificate or a result, and whether they are unchanged."""

import hashlib
import json
from collections.abc import Iterator
from dataclasses import dataclass

from sqlalchemy import Connection, Table, select

from rig.errors import Refused
from rig.history.entered.finished_run import compact, content_sha256
from rig.history.storage import journal, schema
from rig.history.storage.journal import Head
from rig.history.store import History


@dataclass(frozen=True, slots=True)
class FileEntries:
    """A file in a history: its entries in words, and its problems."""

    entries: tuple[str, ...]
    problems: tuple[Refused, ...]


def find_file_entries(history: History, name: str, content: bytes, anchor: tuple[int, str] | None) -> FileEntries:
    """Return the entries of a file in the history. A file is found by its bytes, a result.json also by its values.

    `anchor` is the last line of the journal when the file was signed, None without a signature. Problems are
    `unknown_to_history` if the history does not have the file, `not_as_entered` if its rows have changed since their
    entry, and `journal_rewritten` if the lines of the journal up to the anchor have changed since the signature.
    """
    with history.engine.connect() as connection:
        rows = list(_entries(connection, content))
        if not rows:
            return FileEntries((), (_unknown(name),))
        problems = [
            _not_as_entered(name, broken)
            for table, key, _ in rows
            if (broken := journal.unlike(connection, table, *key)) is not None
        ]
        if anchor is not None and not journal.holds(connection, Head(*anchor)):
            problems.append(_rewritten(name, anchor))
    return FileEntries(tuple(words for _, _, words in rows if words), tuple(problems))


def _entries(connection: Connection, content: bytes) -> Iterator[tuple[Table, tuple[int | str, ...], str]]:
    """Yield the history's rows about a file: table, key, and a description."""
    sha256 = hashlib.sha256(content).hexdigest()
    files, issued, runs = schema.certificate_file, schema.certificate, schema.run
    query = select(files.c.name, issued).select_from(files.join(issued)).where(files.c.sha256 == sha256)
    run_ids: list[int] = []
    for row in connection.execute(query).all():
        newer = connection.scalars(select(issued.c.number).where(issued.c.replaces == row.number)).all()
        phrases = [f"certificate {row.number} of run {row.run_id}, entered {row.entered_utc[:10]}"]
        phrases += [f"replaced by {number}" for number in newer] + ([row.marks] if row.marks else [])
        yield files, (row.id, row.name, sha256), ""
        yield issued, (row.id,), "; ".join(phrases)
        run_ids.append(row.run_id)
    documents = schema.document.c
    run_ids += connection.scalars(select(documents.run_id).where(documents.sha256 == sha256))
    run_ids += _runs_of(connection, content)
    for number in sorted(set(run_ids)):
        row = connection.execute(select(runs).where(runs.c.id == number)).one()
        void = _list_voided(connection, number)
        yield runs, (number,), "; ".join([f"run {number} of {row.started_utc[:10]}, verdict {row.verdict}", *void])


def _list_voided(connection: Connection, run_id: int) -> list[str]:
    rows = select(schema.voided).join(schema.calibration).where(schema.calibration.c.run_id == run_id)
    return [f"calibration {row.calibration_id} is void: {row.reason}" for row in connection.execute(rows)]


def _runs_of(connection: Connection, content: bytes) -> list[int]:
    """Return the numbers of the runs whose entered result.json equals `content`, apart from white space."""
    runs = schema.run.c
    try:
        text = content.decode()
        query = select(runs.id, runs.result).where(runs.content_sha256 == content_sha256(text))
        result = compact(json.loads(text))  # includes the time of its computation, which the hash omits
    except (ValueError, KeyError, TypeError, AttributeError, RecursionError):
        return []
    return [row.id for row in connection.execute(query) if row.result == result]


def _unknown(name: str) -> Refused:
    why = f"the history has no file with the bytes of {name}"
    return Refused("unknown_to_history", why, "Ask the laboratory which certificate it issued; see `rig history show`")


def _not_as_entered(name: str, broken: journal.Broken) -> Refused:
    why = f"the entry of {name} in the history is not as it was entered: {broken.what}: {broken.why}"
    return Refused("not_as_entered", why, "Look with `rig history verify`, and restore the history from a backup")


def _rewritten(name: str, anchor: tuple[int, str]) -> Refused:
    why = f"{name} was signed after entry {anchor[0]} of a journal, and the history's journal differs there"
    remedy = "Look with `rig history verify`, and compare the history with its backups"
    return Refused("journal_rewritten", why, remedy)
