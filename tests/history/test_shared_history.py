"""Many processes enter runs into one history at the same time, on SQLite and on PostgreSQL."""

from collections.abc import Iterator
from pathlib import Path

import pytest
from sqlalchemy import delete, text

from rig.history import schema
from rig.history.engine import WRITES
from rig.history.issued import Issued
from rig.history.store import open_history
from support.forked import forked
from support.kept_rows import as_of_another_process, drop_triggers
from support.past_runs import enter_many, finished
from support.postgres import postgresql

ISSUED = Issued("RIG-1", "Calibration certificate", "2025-01-06", None, "", (("certificate.html", "ab" * 32),))
PROCESSES, ENTRIES, FEW = 8, 250, 20
pytestmark = pytest.mark.slow


@pytest.fixture(params=["sqlite", "postgresql"])
def url(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[str]:
    if request.param == "sqlite":
        yield str(tmp_path / "history.sqlite")
        return
    with postgresql() as found:
        yield found


@pytest.mark.proof
def test_of_what_eight_processes_enter_nothing_is_lost_and_nothing_stands_twice(url: str, thorough: bool) -> None:
    """The tables are made by whoever comes first."""
    entries = ENTRIES if thorough else FEW
    with forked().Pool(PROCESSES) as pool:
        new = pool.starmap(enter_many, [(url, worker, entries) for worker in range(PROCESSES)])
        assert new == [entries] * PROCESSES
        again = pool.starmap(enter_many, [(url, worker % 2, 20) for worker in range(PROCESSES)])
        assert again == [0] * PROCESSES
    with open_history(url) as history:
        with history.engine.connect() as connection:
            runs, calibrations, parameters = (
                connection.execute(text(f"SELECT count(*) FROM {table}")).scalar_one()
                for table in ("run", "calibration", "parameter")
            )
        assert (runs, calibrations, parameters) == (PROCESSES * entries, PROCESSES * entries, PROCESSES * entries * 10)
        assert list(history.broken()) == []
        assert len({each.started_utc for each in history.calibrations()}) == PROCESSES * entries


def test_a_history_of_version_1_is_migrated_there_too(url: str) -> None:
    with open_history(url) as history:
        history.enter(finished(0))
        before = history.calibrations()
        with history.engine.connect().execution_options(**{WRITES: True}) as connection, connection.begin():
            drop_triggers(connection)
            for table in (schema.journal, schema.document, schema.certificate_file, schema.certificate, schema.voided):
                table.drop(connection)
            for column in ("operator", "note"):
                connection.execute(text(f"ALTER TABLE run DROP COLUMN {column}"))
            connection.execute(text("ALTER TABLE parameter DROP COLUMN coverage_factor"))
            connection.execute(delete(schema.meta).where(schema.meta.c.key == "version"))
            connection.execute(schema.meta.insert().values(key="version", value="1"))
    as_of_another_process()
    with open_history(url) as history:
        assert history.calibrations() == before
        history.void(before[0].id, "to see that it can be")
        assert history.certify(finished(0).content_sha256, ISSUED)
        assert [each.certificates for each in history.kept()] == [(ISSUED,)]
        assert list(history.broken()) == []
