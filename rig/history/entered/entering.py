"""Adds the rows of a run to a history, within the caller's transaction."""

from datetime import UTC, datetime
from typing import TYPE_CHECKING

from sqlalchemy import Connection, insert, select

from rig.history.entered.finished_run import FinishedRun
from rig.history.storage import journal, schema
from rig.history.storage.row_numbers import next_number

if TYPE_CHECKING:
    from rig.report.findings.history_records import HistoryRecord


def enter_run(connection: Connection, finished: FinishedRun, content_sha256: str) -> int:
    """Add a run with its recordings, documents and calibrations, and their line of the journal; return its number."""
    from rig.history.entered.index import run_row
    from rig.report.kinds.kind_registry import history_records

    run_id = next_number(connection, schema.run)
    row = {
        **run_row(finished.document),
        "id": run_id,
        "content_sha256": content_sha256,
        "entered_utc": now_utc(),
        "rig": finished.rig,
        "simulated": finished.simulated,
        "result": finished.text,
        "operator": finished.operator,
        "note": finished.note,
    }
    connection.execute(insert(schema.run).values(row))
    if finished.recordings:
        rows = [{"run_id": run_id, "name": r.name, "bytes": r.size, "sha256": r.sha256} for r in finished.recordings]
        connection.execute(insert(schema.recording), rows)
    if finished.documents:
        rows = [{"run_id": run_id, "name": name, "sha256": sha256} for name, sha256 in finished.documents]
        connection.execute(insert(schema.document), rows)
    for record in history_records(finished.document):
        is_standard = record.serial_number in finished.check_standards
        _enter_calibration(connection, run_id, record, check_standard=is_standard)
    journal.note(connection, schema.run, run_id)
    return run_id


def note_place(connection: Connection, run_id: int, finished: FinishedRun) -> None:
    """Add the location of the run's folder, if it is new to the history."""
    places = schema.location.c
    same = (places.run_id == run_id, places.computer == finished.computer, places.path == finished.path)
    if connection.scalar(select(places.id).where(*same)) is None:
        number = next_number(connection, schema.location)
        where = {"id": number, "run_id": run_id, "computer": finished.computer, "path": finished.path}
        connection.execute(insert(schema.location).values(**where, noted_utc=now_utc()))
        journal.note(connection, schema.location, number)


def now_utc() -> str:
    """Return the present time, UTC to the millisecond."""
    return datetime.now(UTC).isoformat(timespec="milliseconds")


def _enter_calibration(
    connection: Connection, run_id: int, calibration: "HistoryRecord", *, check_standard: bool
) -> None:
    number = next_number(connection, schema.calibration)
    row = schema.fill_row(schema.calibration, calibration, id=number, run_id=run_id, check_standard=check_standard)
    connection.execute(insert(schema.calibration).values(row))
    rows = [schema.fill_row(schema.parameter, p, calibration_id=number) for p in calibration.parameters]
    if rows:
        connection.execute(insert(schema.parameter), rows)
