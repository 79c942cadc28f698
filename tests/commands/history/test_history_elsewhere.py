"""Histories that are not at hand: one that a folder names and nobody else, and a database that freezes."""

import csv
import io
import os
import shutil
import signal
import socket
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import pytest

from rig.cli import main
from rig.commands.history.remember import remember
from rig.config.judging.judging_sections import HistorySection
from rig.history.documents import history_csv
from rig.history.store import open_history
from rig.station.events import NotRemembered
from support.history.frozen_database import freezing_at
from support.history.past_runs import finish_run
from support.history.postgres import postgresql
from support.laboratories.commands import rig_here
from support.paths import CONFIGS, RECORDINGS
from support.processes.waiting import PATIENCE_S

pytestmark = pytest.mark.slow


@contextmanager
def heard() -> Iterator[tuple[int, socket.socket]]:
    """A port where somebody could be heard."""
    with socket.create_server(("127.0.0.1", 0)) as server:
        server.settimeout(0)
        yield server.getsockname()[1], server


def folder_that_names(url: str, folder: Path) -> Path:
    shutil.copytree(RECORDINGS / "six_observation", folder)
    demo = (CONFIGS / "demo.yaml").read_text(encoding="utf-8")
    (folder / "config.yaml").write_text(f"{demo}history: {{url: '{url}'}}\n", encoding="utf-8")
    return folder


def test_nothing_connects_to_a_history_that_a_folder_names(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("RIG_HISTORY", str(tmp_path / "mine.sqlite"))
    with heard() as (port, server):
        url = f"postgresql://rig@127.0.0.1:{port}/theirs"
        folder = folder_that_names(url, tmp_path / "sent")
        reported = rig_here("report", folder)
        assert reported.returncode == 0 and f"or --history {url} if that is yours" in reported.stderr
        assert rig_here("history", "import", folder).returncode == 0
        assert rig_here("export", folder, "--format", "csv").returncode == 0
        assert rig_here("solve", folder).returncode in (0, 1)
        with pytest.raises(BlockingIOError):
            server.accept()
    with open_history(str(tmp_path / "mine.sqlite")) as history:
        assert len(list(history.kept())) == 1


def test_no_file_that_a_folder_names_becomes_a_history(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("RIG_HISTORY")
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path / "share"))
    folder = folder_that_names(str(tmp_path / "theirs.sqlite"), tmp_path / "sent")
    (tmp_path / "theirs.sqlite").touch()
    assert main(["report", str(folder)]) == 0
    assert (tmp_path / "theirs.sqlite").read_bytes() == b"" and not (tmp_path / "share").exists()


def test_a_certificate_is_noted_in_the_history_that_the_command_names(tmp_path: Path) -> None:
    mine = str(tmp_path / "mine.sqlite")
    folder = folder_that_names("postgresql://rig@192.0.2.1/theirs", tmp_path / "sent")
    assert rig_here("history", "import", "--history", mine, folder).returncode == 0
    reported = rig_here("report", folder, "--history", mine)
    assert (reported.returncode, reported.stderr) == (0, "")
    with open_history(mine) as history:
        assert len(next(history.kept()).certificates) == 1


def test_a_spreadsheet_is_given_no_formulas(tmp_path: Path) -> None:
    texts = ('=HYPERLINK("http://192.0.2.1/")', "+1", "-1", "@SUM(A1)", "\tx", "\rx")
    with open_history(str(tmp_path / "history.sqlite")) as history:
        for day, text in enumerate(texts):
            history.enter(replace(finish_run(day), operator=text, note="a - b = c"))
        rows = list(csv.DictReader(io.StringIO(history_csv(history.calibrations()), newline="")))
    assert [row["operator"] for row in rows if row["parameter"] == "bx"] == [
        f"'{text}".replace("\r", " ") for text in texts
    ]
    assert {row["note"] for row in rows} == {"a - b = c"}
    assert {float(row["value"]) for row in rows if row["parameter"] == "by"} == {-0.02}


@pytest.mark.thorough
def test_a_run_waits_four_seconds_for_a_server_that_says_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delenv("RIG_HISTORY")
    with heard() as (port, _):
        event, _ = remember(RECORDINGS / "verified", HistorySection(url=f"postgresql://rig@127.0.0.1:{port}/x"))
    assert isinstance(event, NotRemembered) and "has not answered within 4 s" in event.why


@pytest.mark.thorough
def test_a_database_that_freezes_in_an_entry_costs_four_seconds_and_no_end_of_a_process(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """Neither the run's nor that of a command, which Ctrl-C ends at once."""
    monkeypatch.delenv("RIG_HISTORY")
    with postgresql() as url:
        with open_history(url):
            pass
        with freezing_at(b"INSERT INTO run", url) as (relay, frozen):
            event, _ = remember(RECORDINGS / "verified", HistorySection(url=relay))
            assert frozen.is_set() and isinstance(event, NotRemembered) and "has not answered within 4 s" in event.why
        shutil.copytree(RECORDINGS / "verified", tmp_path / "run")
        with freezing_at(b"FROM run", url) as (relay, frozen):
            done = subprocess.run(
                [sys.executable, "-m", "rig", "report", tmp_path / "run", "--history", relay],
                capture_output=True, text=True, timeout=PATIENCE_S, check=False,
            )  # fmt: skip
            assert frozen.is_set() and done.returncode == 0 and "has not answered within 4 s" in done.stderr
        with freezing_at(b"FROM run", url) as (relay, frozen):
            listing = subprocess.Popen(
                [sys.executable, "-m", "rig", "history", "--history", relay], stderr=subprocess.PIPE, env=os.environ
            )
            assert frozen.wait(PATIENCE_S)
            listing.send_signal(signal.SIGINT)
            assert b"interrupted" in listing.communicate(timeout=PATIENCE_S)[1]
            assert listing.returncode == 130
        with open_history(url) as history:
            assert list(history.kept()) == []
