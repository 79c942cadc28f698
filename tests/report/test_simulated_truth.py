"""The truth of a simulated laboratory: beside the result for people, and nowhere else."""

import json
import re
import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from rig.config.load import load
from rig.data.result_file import read_result
from rig.page.outcome_screen import outcome_rows
from rig.page.page_state import PageState
from rig.report.simulated_truth import truth_lines, truth_rows
from rig.station.events import DocumentWritten
from rig.world.board.windowed_truth import SimulatedTruth, truth_document
from rig.world.world_section import read_world_section
from support.laboratories.commands import configuration, rig, rig_here
from support.page.scripted_runs import ABOUT
from support.paths import CONFIGS, RECORDINGS, ROOT

TRUE: dict[str, Any] = {
    "schema": "rig.truth/1",
    "simulated": True,
    "gyroscopes": {"gyro": {"scale": [1.18, 1.15, 1.14], "bias_rad_s": [0.007, -0.009, -0.004]}},
    "accelerometers": {},
}
ESTIMATING = ("estimation", "observation", "analysis", "plans", "data/recording", "runner", "procedure.py")


@pytest.fixture
def run(tmp_path: Path) -> Path:
    """A finished run with a truth."""
    folder = tmp_path / "run"
    shutil.copytree(RECORDINGS / "six_observation", folder)
    (folder / "truth.json").write_text(json.dumps(TRUE), encoding="utf-8")
    return folder


def test_each_value_is_compared_with_its_truth_in_units_of_u(run: Path) -> None:
    result = read_result(run)
    (row,) = truth_rows(run, result)
    assert row.scale is not None
    entry = result.gyroscopes["gyro"]
    assert entry.budget is not None
    values = np.array(entry.scale + entry.bias_rad_s)
    true = np.array(TRUE["gyroscopes"]["gyro"]["scale"] + TRUE["gyroscopes"]["gyro"]["bias_rad_s"])
    expected = (values - true) / np.array(entry.budget.expanded)
    assert row.scale.deviations + row.bias.deviations == pytest.approx(expected)
    (line,) = truth_lines([row])
    assert line.startswith(
        f"simulated truth: {np.sum(np.abs(expected) <= 1)} of 6 values within U of it; farthest gyro "
    )


@pytest.mark.slow
def test_show_has_the_truth_in_short_and_in_full(run: Path) -> None:
    assert "simulated truth: " in rig_here("show", run).stdout
    assert "with its simulated truth, d = (result − truth)/U" in rig_here("show", run, "--budget").stdout
    assert "with its simulated truth" in rig_here("show", run / "result.json", "--sensor", "gyro").stdout
    (run / "truth.json").unlink()
    assert "simulated truth" not in rig_here("show", run, "--all").stdout


def test_the_page_has_it_once_it_is_written(run: Path) -> None:
    state = PageState(ABOUT)
    state.take(DocumentWritten(run / "result.json"))
    assert [row["truth"] for row in state.sections["outcome"]] == [None]
    state.take(DocumentWritten(run / "truth.json"))
    (row,) = state.sections["outcome"]
    assert row["truth"]["scale"]["texts"] == [text for text in row["truth"]["scale"]["texts"] if text.startswith("1.1")]
    assert row["truth"]["bias"]["deviations"] == truth_rows(run, read_result(run))[0].bias.deviations
    assert outcome_rows(read_result(run), {})[0]["truth"] is None


def test_a_scale_factor_without_a_defined_truth_has_none(run: Path) -> None:
    del TRUE["gyroscopes"]["gyro"]["scale"]
    (run / "truth.json").write_text(json.dumps(TRUE), encoding="utf-8")
    TRUE["gyroscopes"]["gyro"]["scale"] = [1.18, 1.15, 1.14]
    (row,) = truth_rows(run, read_result(run))
    assert row.scale is None
    assert "of 3 values within U" in next(truth_lines([row]))


@pytest.mark.parametrize("text", ["", "{", "[]", '{"schema": "rig.truth/1"}', '{"schema": "rig.truth/9"}', "\x00"])
def test_a_file_that_is_no_truth_is_none(run: Path, text: str) -> None:
    (run / "truth.json").write_text(text, encoding="utf-8")
    assert truth_rows(run, read_result(run)) == []


def test_nothing_that_estimates_names_the_file_of_the_truth() -> None:
    sources = [
        file
        for room in ESTIMATING
        for file in ([ROOT / "rig" / room] if room.endswith(".py") else (ROOT / "rig" / room).rglob("*.py"))
    ]
    assert len(sources) > 100
    for file in sources:
        text = file.read_text(encoding="utf-8")
        assert not any(name in text for name in ("truth.json", "TRUTH", "simulated_truth", "windowed_truth")), file


@pytest.mark.slow
def test_a_result_is_the_same_with_and_without_the_truth_beside_it(run: Path) -> None:
    with_truth = rig_here("solve", run, "--json").stdout
    (run / "truth.json").write_text(json.dumps(TRUE).replace("1.1", "2.5"), encoding="utf-8")
    assert _without_time(rig_here("solve", run, "--json").stdout) == _without_time(with_truth)
    (run / "truth.json").unlink()
    assert _without_time(rig_here("solve", run, "--json").stdout) == _without_time(with_truth)


def _without_time(result: str) -> str:
    return "\n".join(line for line in result.splitlines() if '"solved_utc"' not in line)


@pytest.mark.slow
def test_the_truth_of_a_scale_factor_is_that_at_the_speed_and_of_a_bias_that_over_the_time() -> None:
    loaded = load(CONFIGS / "demo.yaml")
    world = read_world_section(loaded)
    truth, sensor = SimulatedTruth(loaded.config, world), world.sensors["gyro"]
    early, late = [(0.0, 60.0)], [(1800.0, 1860.0)]
    fast, slow = (truth.scale("gyro", late, speed) for speed in (2.0, 0.5))
    assert fast == pytest.approx(np.array(sensor.scale) / (1 + 2.0 * sensor.nonlinearity_odd_per_rad_s))
    assert (slow > fast).all()
    assert np.abs(truth.bias_rad_s("gyro", early) - truth.bias_rad_s("gyro", late)).max() > 1e-5
    windows = {"gyroscopes": {"gyro": {"sweeps_s": late, "averages_s": late, "speeds_rad_s": [0.5, 2.0]}}}
    document = truth_document(truth, windows, 1900.0)
    assert "scale" not in document["gyroscopes"]["gyro"]  # two speeds, and the scale factor depends on them
    assert document["gyroscopes"]["gyro"]["bias_rad_s"] == pytest.approx(truth.bias_rad_s("gyro", late))


@pytest.mark.thorough  # that a run ends with its truth, tests/runner/test_run.py
@pytest.mark.slow
def test_a_simulated_run_ends_with_its_truth_and_a_resumed_one_without(tmp_path: Path) -> None:
    folder = tmp_path / "run"
    done = rig("run", configuration(tmp_path), "--out", folder)
    assert re.search("simulated truth: [4-6] of 6 values within U of it", done.stdout), done.stdout + done.stderr
    shutil.copy(folder / "truth.json", tmp_path)
    for name in ("result.json", "certificate.html", "calibration.h"):
        (folder / name).unlink()
    resumed = rig("resume", folder)
    assert "simulated truth" not in resumed.stdout, resumed.stdout
    assert not (folder / "truth.json").exists()
