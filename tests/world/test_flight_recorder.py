"""The world says what held a step that came late."""

import os
import signal
import time
from pathlib import Path

import pytest

from rig.world.flight_recorder import MAX_RECORDS, MIN_LATENESS_S, FlightRecorder
from support.laboratories.worlds import World, late_path
from support.processes.waiting import wait_for


@pytest.mark.slow
def test_a_step_that_is_held_is_recorded_with_its_stack_and_whom_it_waited_for(tmp_path: Path) -> None:
    late = tmp_path / "late.txt"
    recorder = FlightRecorder(late, lambda: "client 127.0.0.1:5 of port 30004")
    try:
        recorder.alive()
        wait_for(lambda: late.exists() and "held_is_recorded" in late.read_text(), "a record")
        recorder.alive()
    finally:
        recorder.close()
    said = late.read_text()
    assert "waited for: client 127.0.0.1:5 of port 30004" in said
    assert "a step came " in said and "for something else, or was stopped" in said


def test_a_world_that_is_in_time_records_nothing(tmp_path: Path) -> None:
    recorder = FlightRecorder(tmp_path / "late.txt", lambda: "nobody")
    recorder.alive()
    recorder.close()
    assert not list(tmp_path.iterdir())


def test_a_world_that_is_always_late_fills_no_disk(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("rig.world.flight_recorder.MIN_LATENESS_S", 0.0)
    recorder = FlightRecorder(tmp_path / "late.txt", lambda: "nobody")
    for _ in range(10 * MAX_RECORDS):
        recorder.alive()
    recorder.close()
    assert (tmp_path / "late.txt").read_text().count("a step ") == MAX_RECORDS


def test_a_record_is_not_written_through_a_link(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("rig.world.flight_recorder.MIN_LATENESS_S", 0.0)
    (tmp_path / "mine.txt").write_text("mine")
    (tmp_path / "late.txt").symlink_to(tmp_path / "mine.txt")
    recorder = FlightRecorder(tmp_path / "late.txt", lambda: "nobody")
    recorder.alive()
    recorder.close()
    assert (tmp_path / "mine.txt").read_text() == "mine"


@pytest.mark.slow
def test_a_world_that_is_stopped_for_a_second_says_so(world: World) -> None:
    running = world()
    late = late_path(running.config_path)
    os.kill(running.process.pid, signal.SIGSTOP)
    time.sleep(2 * MIN_LATENESS_S)
    os.kill(running.process.pid, signal.SIGCONT)
    wait_for(lambda: late.exists() and "or was stopped" in late.read_text(), "a record")
