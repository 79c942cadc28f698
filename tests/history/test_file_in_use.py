"""A history's file that a process works on: nothing takes its locks away, and nothing is taken for it."""

import shutil
import sqlite3
import subprocess
import sys
import threading
from collections.abc import Callable
from contextlib import closing
from pathlib import Path

import pytest
from sqlalchemy import event, text

from rig.commands.history.remember import remember
from rig.commands.history.run_serials import recall_sensors
from rig.config.files.regular_file import UnfitFile, read_regular_file
from rig.config.load import load
from rig.errors import Refused
from rig.floor.floor_feed import polled_feed
from rig.history.store import open_history
from rig.notebook.notebook_history import calibrations
from rig.station.events import NotRemembered, Remembered
from support.history.kept_rows import forge, forget_histories
from support.history.past_runs import finish_run
from support.history.postgres import new_database
from support.laboratories.commands import rig, rig_here
from support.paths import CONFIGS, RECORDINGS, ROOT
from support.processes.waiting import wait_for


@pytest.fixture
def file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("RIG_HISTORY", str(tmp_path / "history.sqlite"))
    return tmp_path / "history.sqlite"


def look_at_its_configuration(file: Path) -> None:
    assert recall_sensors(load(CONFIGS / "ci.yaml").config, frozenset()).silent is None


def look_in_a_notebook(file: Path) -> None:
    assert len(calibrations(history=file)) == 1


def look_from_another_thread(file: Path) -> None:
    thread = threading.Thread(target=look_in_a_notebook, args=[file])
    thread.start()
    thread.join()


def verify_it(file: Path) -> None:
    rig_here("history", "verify", "--history", str(file))


def read_a_link_to_it(file: Path) -> None:
    link = file.with_name("run.h5")
    link.symlink_to(file)
    with pytest.raises(UnfitFile, match="the history that is open"):
        read_regular_file(link, 1 << 30)


@pytest.mark.one_in(2)
@pytest.mark.slow
@pytest.mark.parametrize(
    "beside",
    [look_at_its_configuration, look_in_a_notebook, look_from_another_thread, verify_it, read_a_link_to_it],
)
def test_what_a_process_does_beside_its_own_connection_loses_nothing(
    beside: Callable[[Path], None], file: Path
) -> None:
    """A process that looks at the history meanwhile is not alone: if it thinks so, it takes the log away."""
    with open_history(str(file)) as history:
        history.enter(finish_run(0))
        beside(file)
        assert rig("history").returncode == 0
        history.enter(finish_run(1))
        history.void(2, "to see that it can be")
        with closing(sqlite3.connect(file)) as another:
            assert another.execute("PRAGMA integrity_check").fetchall() == [("ok",)]
            assert another.execute("SELECT count(*) FROM calibration").fetchone() == (2,)
            assert another.execute("SELECT count(*) FROM voided").fetchone() == (1,)
        assert list(history.broken()) == []


def test_all_who_work_on_a_file_in_a_process_share_its_engine(file: Path) -> None:
    link = file.parent / "the same folder"
    link.symlink_to(file.parent)
    with open_history(str(file)) as one, open_history(str(link / file.name)) as other:
        assert one.engine is other.engine
        one.enter(finish_run(0))
    assert {*file.parent.iterdir()} == {link, file}


FORKS = """
import os, sys
sys.path.insert(0, sys.argv[2])
from rig.history.store import open_history
from support.history.past_runs import finish_run

with open_history(sys.argv[1]) as history:
    history.enter(finish_run(0))
    before = history.engine.pool
    if not (child := os.fork()):
        assert history.engine.pool is not before
        assert history.enter(finish_run(1)).new
        with open_history(sys.argv[1]) as again:
            assert len(again.calibrations()) == 2
        os._exit(0)
    assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 0
    assert history.engine.pool is before
    history.enter(finish_run(2))
    assert len(history.calibrations()) == 3 and list(history.broken()) == []
"""


@pytest.mark.slow
def test_a_forked_process_has_connections_of_its_own(file: Path) -> None:
    command = [sys.executable, "-c", FORKS, str(file), str(ROOT / "tests")]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    with open_history(str(file)) as history:
        assert len(history.calibrations()) == 3


def remove(file: Path) -> None:
    for path in file.parent.glob(f"{file.name}*"):
        path.unlink()


def put_a_new_one_there(file: Path) -> None:
    remove(file)
    other = file.with_name("other.sqlite")
    with open_history(str(other)) as history:
        history.enter(finish_run(7, serial_number="G-7"))
    other.rename(file)


def put_an_older_copy_there(file: Path) -> None:
    copy = file.with_name("copy.sqlite")
    with closing(sqlite3.connect(file)) as now, closing(sqlite3.connect(copy)) as older:
        now.backup(older)
    forge(str(copy), "DELETE FROM location", "DELETE FROM journal WHERE kind = 'location'")
    copy.rename(file)


def overwrite_with_an_older_copy(file: Path) -> None:
    """The file itself stays: only what it holds tells."""
    copy = file.with_name("copy.sqlite")
    with closing(sqlite3.connect(file)) as now, closing(sqlite3.connect(copy)) as older:
        now.backup(older)
    forge(str(copy), "DELETE FROM location", "DELETE FROM journal WHERE kind = 'location'")
    shutil.copyfile(copy, file)


EXCHANGES = [
    (remove, "history_gone: "),
    (put_a_new_one_there, "history_exchanged: "),
    (put_an_older_copy_there, "history_exchanged: "),
    (overwrite_with_an_older_copy, "history_exchanged: "),
]


@pytest.mark.slow
@pytest.mark.parametrize(("exchange", "name"), EXCHANGES)
def test_a_history_that_is_not_the_one_of_before_is_named_and_nothing_is_entered_in_it(
    exchange: Callable[[Path], None], name: str, file: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with open_history(str(file)) as history:
        history.enter(finish_run(0))
    config = load(CONFIGS / "ci.yaml").config
    assert recall_sensors(config, frozenset()).silent is None  # the run begins
    with monkeypatch.context() as forging:
        forging.setattr("support.history.kept_rows.forget_histories", lambda: None)
        exchange(file)
    before = {path.name: path.read_bytes() for path in file.parent.iterdir()}
    event, _ = remember(RECORDINGS / "verified", config.history)  # and ends
    assert isinstance(event, NotRemembered) and name in event.why
    assert name in (recall_sensors(config, frozenset()).silent or "")
    assert {path.name: path.read_bytes() for path in file.parent.iterdir()} == before
    forget_histories()
    event, _ = remember(RECORDINGS / "verified", config.history)
    assert isinstance(event, Remembered)


@pytest.mark.slow
@pytest.mark.parametrize(("exchange", "name"), EXCHANGES[:2])
def test_nobody_works_on_in_a_file_that_is_not_the_history_any_more(
    exchange: Callable[[Path], None], name: str, file: Path
) -> None:
    """Though their connections still can."""
    with open_history(str(file)) as history:
        history.enter(finish_run(0))
        exchange(file)
        for work in (lambda: history.enter(finish_run(1)), history.calibrations):
            with pytest.raises(Refused, match=name):
                work()


@pytest.mark.slow
def test_the_floor_says_that_its_history_is_gone_and_begins_none(file: Path) -> None:
    with open_history(str(file)) as history:
        history.enter(finish_run(0))
        place = history.address
    with polled_feed(place) as feed:
        wait_for(lambda: b'"today"' in feed.whole(), "what the history has")
        remove(file)
        wait_for(lambda: b"existed before and is gone" in feed.whole(), "that it is gone")
    assert not file.exists()


@pytest.mark.slow
def test_a_database_that_was_emptied_meanwhile_is_not_begun_anew(server: str) -> None:
    url = new_database(server)
    with open_history(url) as history:
        history.enter(finish_run(0))
        with history.engine.begin() as connection:
            connection.execute(text("DROP SCHEMA public CASCADE"))
            connection.execute(text("CREATE SCHEMA public"))
    with pytest.raises(Refused, match="history_gone"), open_history(url):
        pass
    forget_histories()
    with open_history(url) as history:
        assert history.calibrations() == []


@pytest.mark.slow
def test_what_is_not_there_when_it_is_read_back_is_not_told_as_entered(file: Path) -> None:
    with open_history(str(file)) as history:
        history.enter(finish_run(0))

        @event.listens_for(history.engine, "checkin", once=True)
        def lose(*_: object) -> None:
            forge(str(file), "DELETE FROM parameter WHERE calibration_id = 2 AND name = 'kx'")

        with pytest.raises(Refused, match=r"entry_not_kept: .*run \[2\]: its rows have changed since their entry"):
            history.enter(finish_run(1))
        with pytest.raises(Refused, match="entry_not_kept"):
            history.enter(finish_run(1))


IMPORTS = """
import sys
from pathlib import Path
from rig.commands.history import history_answer, run_serials, remember
from rig.config.judging.judging_sections import HistorySection
from rig.config.load import load

answer, late = history_answer.await_answer, []

def timed(work, within_s):
    before = set(sys.modules)
    try:
        return answer(work, None)
    finally:
        late.extend(sorted(set(sys.modules) - before))

history_answer.await_answer = timed
config = load(Path(sys.argv[1])).config
run_serials.recall_sensors(config, frozenset())
for _ in range(2):
    event, _ = remember.remember(Path(sys.argv[2]), HistorySection())
    run_serials.recall_sensors(config, frozenset())
print(type(event).__name__, late)
"""


@pytest.mark.thorough
@pytest.mark.slow
def test_the_time_in_which_a_history_has_to_answer_counts_no_imports(file: Path) -> None:
    command = [sys.executable, "-c", IMPORTS, str(CONFIGS / "ci.yaml"), str(RECORDINGS / "verified")]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.stdout.strip() == "Remembered []", done.stdout + done.stderr
