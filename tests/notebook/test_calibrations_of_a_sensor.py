"""What the laboratory remembers, from a notebook: a sensor's calibrations as a table, and what changed between runs."""

import json
from pathlib import Path

import numpy as np
import pytest

import rig
from rig.cli import main
from rig.errors import Refused
from rig.history.store import open_history
from support.history.past_runs import FIRST, finish_run
from support.paths import RECORDINGS, ROOT

MOVED = (1.0103, 0.99, 1.0)


@pytest.fixture
def place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    """A history of two calibrations of G-1 and one of G-2, the one that is meant."""
    where = str(tmp_path / "history.sqlite")
    monkeypatch.setenv("RIG_HISTORY", where)
    with open_history(where) as history:
        for run in (finish_run(0), finish_run(30, MOVED), finish_run(40, serial_number="G-2")):
            history.enter(run)
    return where


@pytest.mark.slow
def test_all_calibrations_of_a_serial_number_are_one_table(place: str) -> None:
    found = rig.calibrations("G-1")
    frame = found.to_frame()
    assert len(found) == len(frame) == 2 and len(rig.calibrations()) == 3
    assert frame["started_utc"].iloc[0] == FIRST and frame["serial_number"].unique().tolist() == ["G-1"]
    np.testing.assert_allclose(frame["kx"], [1.01, MOVED[0]])
    first = found[0].parameters["kx"]
    assert frame["kx_expanded"].iloc[0] == pytest.approx(first.expanded) and first.expanded > 0
    assert "G-1" in repr(found) and found._repr_html_().startswith("<table>")
    assert len(rig.calibrations("G-2", history=place)) == 1


@pytest.mark.slow
def test_a_serial_number_that_was_never_entered_is_refused(place: str) -> None:
    with pytest.raises(Refused, match=r"not_in_history: .*G-9"):
        rig.calibrations("G-9")


@pytest.mark.slow
def test_changes_between_two_results_are_those_of_the_command_line(
    place: str, capsys: pytest.CaptureFixture[str]
) -> None:
    before, now = (rig.Result(run.document) for run in (finish_run(0), finish_run(30, MOVED)))
    found = rig.changes(before, now)["gyro"]
    assert main(["history", "compare", "1", "2", "--json"]) == 0
    assert found.to_dict() == json.loads(capsys.readouterr().out)["parameters"]
    assert "kx" in [each.name for each in found.changed]
    assert ": changed: " in repr(found) and "kx (E_n" in repr(found)
    frame = found.to_frame()
    assert frame.loc["kx", "normalised_error"] > 1 > frame.loc["ky", "normalised_error"]
    assert frame.loc["kx", "changed"] and frame.loc["kx", "normalised_error_limit"] > 1
    assert "changed" in rig.changes(before, now)._repr_html_()


@pytest.mark.slow
def test_a_run_is_solved_to_be_compared() -> None:
    run, result = rig.load(RECORDINGS / "six_observation"), rig.load_result(RECORDINGS / "six_observation")
    same = rig.changes(result, run)
    assert set(same) == {"gyro"}
    assert all(change.normalised_error < 1e-3 for each in same.values() for change in each.changes)


def test_runs_without_a_sensor_in_common_are_not_compared() -> None:
    other = rig.load_result(ROOT / "tests" / "fixtures" / "recordings" / "kvh1775")
    with pytest.raises(Refused, match="not_comparable: the first is of lsm9ds1"):
        rig.changes(rig.load_result(RECORDINGS / "verified"), other)
