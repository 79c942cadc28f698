"""Many processes enter runs into one history at the same time, on SQLite and on PostgreSQL."""

from pathlib import Path

import pytest
from sqlalchemy import Connection, text

from rig.errors import Refused
from rig.history.storage import migrations, schema
from rig.history.storage.sqlite_engine import WRITE_OPTION
from rig.history.store import open_history
from support.history.kept_rows import drop_triggers, forget_histories
from support.history.past_runs import enter_many, finish_run
from support.history.postgres import new_database
from support.processes.forked import find_fork_server

PROCESSES, ENTRIES, FEW = 8, 250, 5  # `make test`: two processes, as few as get in each other's way, and few entries
pytestmark = pytest.mark.slow


@pytest.fixture(params=["sqlite", "postgresql"])
def url(request: pytest.FixtureRequest, tmp_path: Path) -> str:
    if request.param == "sqlite":
        return str(tmp_path / "history.sqlite")
    return new_database(request.getfixturevalue("server"))


@pytest.mark.proof
def test_of_what_several_processes_enter_nothing_is_lost_and_nothing_stands_twice(url: str, thorough: bool) -> None:
    """The tables are made by whoever comes first."""
    processes, entries = (PROCESSES, ENTRIES) if thorough else (2, FEW)
    with find_fork_server().Pool(processes) as pool:
        new = pool.starmap(enter_many, [(url, worker, entries) for worker in range(processes)])
        assert new == [entries] * processes
        again = pool.starmap(enter_many, [(url, worker % 2, FEW) for worker in range(processes)])
        assert again == [0] * processes
    with open_history(url) as history:
        with history.engine.connect() as connection:
            runs, calibrations, parameters = (
                connection.execute(text(f"SELECT count(*) FROM {table}")).scalar_one()
                for table in ("run", "calibration", "parameter")
            )
        assert (runs, calibrations, parameters) == (processes * entries, processes * entries, processes * entries * 10)
        assert list(history.broken()) == []
        assert len({calibration.started_utc for calibration in history.calibrations()}) == processes * entries


def test_a_later_version_has_one_place_for_its_migration(url: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Of a program whose tables are one version on: the file says so, its rows stay, and this program refuses it."""

    def add_a_column(connection: Connection) -> None:
        connection.execute(text("ALTER TABLE voided ADD COLUMN voided_by VARCHAR(400)"))

    with open_history(url) as history:
        history.enter(finish_run(0))
        history.void(1, "another sensor was mounted")
        before = history.calibrations()
    forget_histories()
    with monkeypatch.context() as newer:
        newer.setattr(schema, "VERSION", schema.VERSION + 1)
        newer.setattr(migrations, "MIGRATIONS", {schema.VERSION - 1: add_a_column})
        with open_history(url) as history:
            assert history.calibrations() == before
            assert list(history.broken()) == []
            with history.engine.connect() as connection:
                assert connection.execute(text("SELECT voided_by FROM voided")).all() == [(None,)]
    forget_histories()
    with pytest.raises(Refused, match=rf"history_too_new: .*version {schema.VERSION + 1}"), open_history(url):
        pass


def test_a_server_s_history_from_before_version_1_is_refused(url: str) -> None:
    with (
        open_history(url) as history,
        history.engine.connect().execution_options(**{WRITE_OPTION: True}) as connection,
        connection.begin(),
    ):
        drop_triggers(connection)
        connection.execute(text("UPDATE meta SET key = 'version', value = '6' WHERE key = 'schema_version'"))
    forget_histories()
    with pytest.raises(Refused, match="history_too_old"), open_history(url):
        pass


def test_every_older_version_has_its_migration() -> None:
    assert list(migrations.MIGRATIONS) == list(range(1, schema.VERSION))
