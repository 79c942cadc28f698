"""Which results of a history are to be solved again, in a handful of questions however many there are."""

from collections import defaultdict
from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import Any, TypeVar

from sqlalchemy import Connection, Row, Select, select

from rig.history.again.answer import Stated
from rig.history.entered.finished import Recording
from rig.history.entered.issued import Issued
from rig.history.storage import schema
from rig.history.store import History, Past, Selection, chosen, replaced

Value = TypeVar("Value")
_RUN = schema.run.c


def stated_results(history: History, selection: Selection) -> tuple[Stated, ...]:
    """Every result that counts, in the order of time, and replaced ones that a certificate in force relies on.

    Voided calibrations do not count, nor does a run that has no others. Runs without calibrations, such as a
    verification alone, are among them where no serial number and no part is asked for.
    """
    pasts: dict[int, list[Past]] = defaultdict(list)
    for each in history.calibrations(selection, replaced_too=True):
        pasts[each.run_id].append(each)
    of_all = selection.serial_number is None and selection.part is None
    asked = select(_RUN.id, _RUN.content_sha256, _RUN.started_utc, _RUN.rig, _RUN.verdict, replaced().label("replaced"))
    runs = chosen(asked.order_by(_RUN.started_utc, _RUN.id), replace(selection, serial_number=None, part=None))
    with history.engine.connect() as connection:
        rows = connection.execute(runs).all()
        recordings, places, certificates = _recordings(connection), _places(connection), _in_force(connection)
    return tuple(
        Stated(
            row.id,
            row.content_sha256,
            row.started_utc,
            row.rig,
            row.verdict,
            tuple(each for each in pasts.get(row.id, ()) if each.voided is None),
            recordings.get(row.id, ()),
            places.get(row.id, ()),
            certificates.get(row.id, ()),
        )
        for row in rows
        if (any(each.voided is None for each in pasts[row.id]) if row.id in pasts else of_all)
        and (not row.replaced or row.id in certificates)
    )


def _recordings(connection: Connection) -> Mapping[int, tuple[Recording, ...]]:
    columns = schema.recording.c
    asked = select(columns.run_id, columns.name, columns.bytes, columns.sha256).order_by(columns.name)
    return _by_run((row.run_id, Recording(row.name, row.bytes, row.sha256)) for row in _rows(connection, asked))


def _places(connection: Connection) -> Mapping[int, tuple[tuple[str, str], ...]]:
    columns = schema.location.c
    asked = select(columns.run_id, columns.computer, columns.path).order_by(columns.id.desc())
    return _by_run((row.run_id, (row.computer, row.path)) for row in _rows(connection, asked))


def _in_force(connection: Connection) -> Mapping[int, tuple[Issued, ...]]:
    """The certificates to rely on: without a mark, and replaced by none that this history knows."""
    rows = _rows(connection, select(schema.certificate).order_by(schema.certificate.c.id))
    gone = {row.replaces for row in rows if not row.marks}  # one that is not valid replaces none that is
    return _by_run(
        (row.run_id, Issued(row.number, row.title, row.issued, row.replaces, row.marks))
        for row in rows
        if row.number not in gone and not row.marks
    )


def _rows(connection: Connection, asked: Select[Any]) -> list[Row[Any]]:
    return list(connection.execute(asked).all())


def _by_run(pairs: Iterable[tuple[int, Value]]) -> dict[int, tuple[Value, ...]]:
    found: dict[int, list[Value]] = defaultdict(list)
    for key, value in pairs:
        found[key].append(value)
    return {key: tuple(values) for key, values in found.items()}
