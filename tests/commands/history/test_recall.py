"""What a run knows of its sensors before it begins."""

from pathlib import Path

import pytest

from rig.commands.history.run_serials import recall_sensors
from rig.config.load import load
from rig.history.store import open_history
from support.history.past_runs import finish_run
from support.laboratories.commands import CI


@pytest.fixture
def place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    monkeypatch.setenv("RIG_HISTORY", str(tmp_path / "history.sqlite"))
    return str(tmp_path / "history.sqlite")


@pytest.mark.slow
def test_the_calibrations_of_the_configured_serial_numbers_are_known_the_newest_first(place: str) -> None:
    with open_history(place) as history:
        for day, serial_number in ((0, "G-1"), (1, "G-2"), (2, "G-1"), (3, "G-1")):
            history.enter(finish_run(day, serial_number=serial_number, passed=day != 2))
        history.void(4, "another sensor was mounted")
    known = recall_sensors(load(CI, ["sensors.gyro.serial_number=G-1"], None).config, frozenset({"G-1"}))
    assert [(calibration.number, calibration.day, calibration.verdict) for calibration in known.calibrations] == [
        (3, "2025-01-08", "pass"),
        (1, "2025-01-06", "pass"),
    ]
    assert {calibration.board_unique_id for calibration in known.calibrations} == {
        finish_run(0).document.provenance.board_unique_id
    }
    assert known.silent is None and known.moved == {"G-1"}


def test_a_history_that_is_not_there_yet_is_an_empty_one_and_is_not_made(place: str) -> None:
    known = recall_sensors(load(CI, sections=None).config, frozenset())
    assert known.calibrations == () and known.silent is None and not Path(place).exists()


def test_a_run_does_not_depend_on_the_history_s_answer(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "history.sqlite").write_text("no database", encoding="utf-8")
    for said, words in ((str(tmp_path / "history.sqlite"), "the history is silent"), ("off", "the history is off")):
        monkeypatch.setenv("RIG_HISTORY", said)
        known = recall_sensors(load(CI, sections=None).config, frozenset())
        assert known.calibrations == () and known.silent is not None and known.silent.startswith(words)
