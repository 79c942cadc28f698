"""Drift and the Earth's rate are followed beside calibrations, and are taken for none."""

from pathlib import Path

import pytest

from rig.cli import main
from rig.data.result_file import ResultDocument, read_result
from rig.history.recomputed import not_given
from support.paths import RECORDINGS

DRIFT = RECORDINGS / "bias_drift"


def drifting() -> ResultDocument:
    """A result that says whose bias it is that drifts."""
    document = read_result(DRIFT)
    whose = {"part": "lsm9ds1", "serial_number": "LSM9DS1-CI", "full_scale": 8.7}
    drifts = {
        name: {quantity: each.model_copy(update=whose) for quantity, each in of.items()}
        for name, of in document.bias_drift.items()
    }
    return document.model_copy(update={"bias_drift": drifts})


def test_what_an_older_result_does_not_follow_is_not_missed() -> None:
    assert not_given(read_result(DRIFT), drifting()) == []


@pytest.fixture
def entered(tmp_path: Path) -> Path:
    """A history with one run of that procedure, whose result is of today."""
    folder, history = tmp_path / "run", tmp_path / "history.db"
    folder.mkdir()
    for file in DRIFT.iterdir():
        (folder / file.name).write_bytes(file.read_bytes())
    assert main(["history", "import", "--solve", str(folder), "--history", str(history)]) == 0
    return history


@pytest.mark.thorough
@pytest.mark.slow
def test_a_sensor_whose_drift_is_followed_is_listed_and_drawn(
    entered: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["history", "list", "LSM9DS1-CI", "--history", str(entered)]) == 0
    said = capsys.readouterr().out
    assert "rate bias drift" in said and "dx" in said
    assert "U is that of noise alone" not in said.split("rate bias drift")[-1]
    pictures = tmp_path / "pictures"
    assert main(["history", "plot", "LSM9DS1-CI", "--history", str(entered), "--out", str(pictures)]) == 0
    assert len(list(pictures.glob("*bias_drift*.png"))) == 2
    assert main(["history", "rigs", "--history", str(entered)]) == 0
