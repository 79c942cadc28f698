"""The results of a history that are to be recomputed, by a few queries."""

from collections import defaultdict
from collections.abc import Iterable, Mapping
from dataclasses import replace
from typing import TypeVar

from sqlalchemy import Connection, select

from rig.history.entered.finished_run import EnteredRecording
from rig.history.entered.issued_certificate import IssuedCertificate
from rig.history.recompute.result_comparison import StatedResult
from rig.history.storage import schema
from rig.history.store import History, Past, Selection, chosen, replacement_condition

Value = TypeVar("Value")
_RUN = schema.run.c


def list_stated_results(history: History, selection: Selection) -> tuple[StatedResult, ...]:
    """Return all valid results in the order of time, and replaced results that a certificate in force uses.

    Voided calibrations, and runs that have only voided calibrations, are left out. Runs without calibrations, such as a
    verification alone, are included unless a serial number or part is selected.
    """
    pasts: dict[int, list[Past]] = defaultdict(list)
    for past in history.calibrations(selection, replaced_too=True):
        pasts[past.run_id].append(past)
    # A serial number or a part selects calibrations, and so the runs that have them; other criteria select runs.
    includes_all = selection.serial_number is None and selection.part is None
    query = select(
        _RUN.id,
        _RUN.content_sha256,
        _RUN.started_utc,
        _RUN.rig,
        _RUN.verdict,
        replacement_condition().label("replaced"),
    )
    runs = chosen(query.order_by(_RUN.started_utc, _RUN.id), replace(selection, serial_number=None, part=None))
    with history.engine.connect() as connection:
        rows = connection.execute(runs).all()
        recordings, places, certificates = (_recordings(connection), _places(connection), _certificates(connection))
    return tuple(
        StatedResult(
            row.id,
            row.content_sha256,
            row.started_utc,
            row.rig,
            row.verdict,
            tuple(past for past in pasts.get(row.id, ()) if past.voided is None),
            recordings.get(row.id, ()),
            places.get(row.id, ()),
            certificates.get(row.id, ()),
        )
        for row in rows
        if (any(past.voided is None for past in pasts[row.id]) if row.id in pasts else includes_all)
        and (not row.replaced or row.id in certificates)
    )


def _recordings(connection: Connection) -> Mapping[int, tuple[EnteredRecording, ...]]:
    columns = schema.recording.c
    query = select(columns.run_id, columns.name, columns.bytes, columns.sha256).order_by(columns.name)
    return _group_by_run(
        (row.run_id, EnteredRecording(row.name, row.bytes, row.sha256)) for row in connection.execute(query)
    )


def _places(connection: Connection) -> Mapping[int, tuple[tuple[str, str], ...]]:
    columns = schema.location.c
    query = select(columns.run_id, columns.computer, columns.path).order_by(columns.id.desc())
    return _group_by_run((row.run_id, (row.computer, row.path)) for row in connection.execute(query))


def _certificates(connection: Connection) -> Mapping[int, tuple[IssuedCertificate, ...]]:
    """Return the certificates in force: those without marks on their pages, and not replaced in this history."""
    rows = connection.execute(select(schema.certificate).order_by(schema.certificate.c.id)).all()
    replaced_numbers = {row.replaces for row in rows if not row.marks}  # an invalid one does not replace a valid one
    return _group_by_run(
        (row.run_id, IssuedCertificate(row.number, row.title, row.issued, row.replaces, row.marks))
        for row in rows
        if row.number not in replaced_numbers and not row.marks
    )


def _group_by_run(pairs: Iterable[tuple[int, Value]]) -> dict[int, tuple[Value, ...]]:
    groups: dict[int, list[Value]] = defaultdict(list)
    for key, value in pairs:
        groups[key].append(value)
    return {key: tuple(values) for key, values in groups.items()}
