"""Drift and the Earth's rate are followed beside calibrations, and are taken for none."""

from pathlib import Path

import pytest

from rig.cli import main
from rig.data.result_file import read_result
from rig.history.entered.recomputed_result import differing_parts
from support.paths import RECORDINGS

DRIFT = RECORDINGS / "bias_drift"


def test_a_quantity_that_a_claim_does_not_follow_is_not_missed() -> None:
    """The program that wrote it may not have followed that yet."""
    given = read_result(DRIFT)
    assert differing_parts(given.model_copy(update={"bias_drift": {}}), given) == []


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
