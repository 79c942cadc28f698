"""The whole chain as a technician uses it: command line, real clients, real firmware, simulated laboratory.

Its arm is ten times rougher than any that was logged: 5 % of ripple, in proportion to the speed.
"""

import json
import re
import signal
import subprocess
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
import yaml

from support.laboratories.commands import configuration, rig, rig_here, wait_for_log
from support.laboratories.worlds import merge
from support.processes.waiting import PATIENCE_S
from support.processes.warm import start_module
from support.recordings.stated import find_differences

pytestmark = pytest.mark.slow

Start = Callable[..., subprocess.Popen[str]]
FULL = Path("/dev/full")


@pytest.fixture
def start() -> Iterator[Start]:
    """Starts `rig …` in the background; whatever still runs at the end of the test is killed."""
    running: list[subprocess.Popen[str]] = []

    def popen(*arguments: str | Path) -> subprocess.Popen[str]:
        process = start_module(*arguments, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        running.append(process)
        return process

    yield popen
    for process in running:
        process.kill()
        process.communicate()


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict[str, Any], subprocess.CompletedProcess[str]]:
    """One finished run: its folder, result.json and what the command printed."""
    folder = tmp_path_factory.mktemp("finished")
    out = folder / "run"
    few = {"sensors": {"gyro": {"rate_hz": 59.5}}}  # samples are what a laboratory costs
    rough = {"world": {"arm": {"joints": "rough"}}}
    done = rig("run", configuration(folder, few | rough), "--out", out)
    assert done.returncode == 0, done.stderr
    return out, json.loads((out / "result.json").read_text(encoding="utf-8")), done


def test_a_run_on_rough_joints_recovers_the_simulated_truth(finished: tuple[Path, dict[str, Any], Any]) -> None:
    out, result, _ = finished
    truth = yaml.safe_load((out / "config.yaml").read_text(encoding="utf-8"))["world"]["sensors"]["gyro"]
    sensor = result["gyroscopes"]["gyro"]
    estimate = np.array(sensor["scale"] + sensor["bias_rad_s"])
    std = np.sqrt(np.diag(sensor["covariance"]))
    error = estimate - np.array(truth["scale"] + truth["bias_rad_s"])
    assert np.all(np.abs(error) < 4 * std), error / std
    assert np.all(std[:3] < 0.003) and np.all(std[3:] < 0.005)


def test_a_run_leaves_everything_in_its_folder(finished: tuple[Path, dict[str, Any], Any]) -> None:
    out, result, done = finished
    assert result["schema"] == "rig.result/1" and result["verdict"] == "pass"
    assert re.search("simulated truth: [4-6] of 6 values within U of it", done.stdout)  # 95 % of many are
    assert (out / "truth.json").exists()
    assert result["gyroscopes"]["gyro"]["model"] == "g = K (m + b)"
    assert [o["joint"] for o in result["gyroscopes"]["gyro"]["observations"]] == [
        "wrist_3", "wrist_3", "wrist_1", "wrist_1", "wrist_2", "wrist_2",
    ]  # fmt: skip
    assert "done: sweep wrist_2 ccw" in (out / "log.txt").read_text(encoding="utf-8")
    assert f"gyro_scale[3] = {{{result['gyroscopes']['gyro']['scale'][0]:.9e}f" in (out / "calibration.h").read_text()
    certificate = (out / "certificate.html").read_text(encoding="utf-8")
    assert "Simulated laboratory: no real item was calibrated" in certificate and "± U" in certificate
    assert "Equipment: robot arm Universal Robots UR10e or UR12e, serial number 20265500123" in certificate
    assert result["provenance"]["arm_model"] == "UR10e or UR12e"
    *lines, last = done.stdout.splitlines()
    assert last == "verdict: PASS" and len(lines) < 12
    assert float(lines[1].split()[1]) == pytest.approx(result["gyroscopes"]["gyro"]["scale"][0], abs=1e-4)
    assert f"all details: rig show {out} --all" in lines
    whole = rig("show", out, "--all").stdout
    assert ", vector" in whole and "six_observation: k" in whole and "non-orthogonality" in whole
    with h5py.File(out / "run.h5", "r") as file:
        assert "scale: [" not in file.attrs["config"], "the recording must not hold the simulated truth"
        states = file["states"]["time_s"]
        assert np.median(np.diff(states)) <= 1 / 125 + 1e-9
        sequence = file["samples/gyro"]["sequence"]
        assert np.array_equal(sequence, np.arange(len(sequence))), "samples are missing"


@pytest.mark.thorough
@pytest.mark.skipif(not FULL.exists(), reason="no device that is always full")
def test_a_passed_run_stays_passed_where_stdout_takes_no_more(tmp_path: Path) -> None:
    out = tmp_path / "run"
    with (
        FULL.open("w") as full,
        start_module(
            "run", configuration(tmp_path), "--out", out, stdout=full, stderr=subprocess.PIPE, text=True
        ) as process,
    ):
        _, errors = process.communicate(timeout=PATIENCE_S)
    assert process.returncode == 0
    assert errors.splitlines()[-1].startswith("rig: output_lost: ") and str(out / "result.json") in errors
    assert json.loads((out / "result.json").read_text(encoding="utf-8"))["verdict"] == "pass"


def test_solve_gives_the_numbers_of_the_run(finished: tuple[Path, dict[str, Any], Any]) -> None:
    out, *_ = finished
    again = rig("solve", out / "run.h5", "--json")
    assert again.returncode == 0, again.stderr
    assert find_differences(out, again.stdout) == []


def test_the_papers_algorithm_agrees(finished: tuple[Path, dict[str, Any], Any]) -> None:
    out, result, _ = finished
    published = json.loads(rig_here("solve", out, "--estimator", "algorithm_1", "--json").stdout)["gyroscopes"]["gyro"]
    assert published["estimator"] == "algorithm_1" and published["iterations"] >= 2
    beside = result["gyroscopes"]["gyro"]
    assert beside["estimator"] == "vector" and beside["six_observation"]["estimator"] == "newton"
    assert np.allclose(published["scale"], beside["six_observation"]["scale"], atol=1e-4)
    assert beside["algorithm_1"] == {name: published[name] for name in beside["algorithm_1"]}


@pytest.mark.one_in(3)
@pytest.mark.parametrize("estimator", ["vector", "newton", "levenberg_marquardt"])
def test_every_estimator_recovers_the_truth(finished: tuple[Path, dict[str, Any], Any], estimator: str) -> None:
    out, result, _ = finished
    solved = json.loads(rig_here("solve", out, "--estimator", estimator, "--json").stdout)["gyroscopes"]["gyro"]
    assert (
        solved["estimator"] == estimator
        and solved["six_observation"] == result["gyroscopes"]["gyro"]["six_observation"]
    )
    truth = yaml.safe_load((out / "config.yaml").read_text(encoding="utf-8"))["world"]["sensors"]["gyro"]
    error = np.array(solved["scale"] + solved["bias_rad_s"]) - np.array(truth["scale"] + truth["bias_rad_s"])
    assert np.all(np.abs(error) < 4 * np.sqrt(np.diag(solved["covariance"])))


@pytest.mark.thorough
def test_an_interrupted_run_is_kept_and_resumed(start: Start, tmp_path: Path) -> None:
    out = tmp_path / "run"
    process = start("run", configuration(tmp_path, {"world": {"time_scale": 4}}), "--out", out)
    wait_for_log(out, "done: sweep wrist_3 ccw")
    process.send_signal(signal.SIGINT)
    _, errors = process.communicate(timeout=PATIENCE_S)
    assert process.returncode == 130
    swept = (out / "log.txt").read_text(encoding="utf-8").count("done: sweep")
    assert f"rig resume {out}" in errors and "Traceback" not in errors
    assert not (out / "result.json").exists()

    used = (out / "config.yaml").read_text(encoding="utf-8")
    for change, name in (
        ({"world": {"board": {"unique_id": "f" * 24}}}, "another_board"),
        ({"procedure": {"order": ["wrist_1", "wrist_3", "wrist_2"]}}, "another_procedure"),
    ):
        (out / "config.yaml").write_text(yaml.safe_dump(merge(yaml.safe_load(used), change)), encoding="utf-8")
        refused = rig("resume", out)
        assert refused.returncode == 2 and f"rig: {name}: " in refused.stderr, refused.stderr
    faster = merge(yaml.safe_load(used), {"world": {"time_scale": 12}})  # nothing is to be interrupted any more
    (out / "config.yaml").write_text(yaml.safe_dump(faster), encoding="utf-8")

    resumed = rig("resume", out)
    assert resumed.returncode == 0, resumed.stderr
    result = json.loads((out / "result.json").read_text(encoding="utf-8"))
    assert [o["sweep"] for o in result["gyroscopes"]["gyro"]["observations"]] == [0, 1, 2, 3, 4, 5]
    assert len(result["gyroscopes"]["gyro"]["time_bases"]) == 2
    assert swept < 6 and resumed.stderr.count("done: sweep") == 6 - swept
    assert find_differences(out, rig_here("solve", out, "--json").stdout) == []


@pytest.mark.proof
@pytest.mark.thorough
def test_a_run_continues_if_nobody_reads_its_output(start: Start, tmp_path: Path) -> None:
    out = tmp_path / "run"
    process = start("run", configuration(tmp_path), "--out", out)
    assert process.stderr is not None and process.stdout is not None
    process.stderr.readline()
    process.stderr.close()
    process.stdout.close()
    assert process.wait(PATIENCE_S) == 0
    assert json.loads((out / "result.json").read_text(encoding="utf-8"))["verdict"] == "pass"


def test_a_run_that_was_refused_begins_with_resume(tmp_path: Path) -> None:
    config = configuration(tmp_path)
    document = yaml.safe_load(config.read_text(encoding="utf-8"))
    del document["world"]
    config.write_text(yaml.safe_dump(document), encoding="utf-8")
    out = tmp_path / "a run"
    assert "rig: no_port: " in rig("run", config, "--out", out).stderr
    again = rig("run", config, "--out", out)
    assert again.returncode == 2 and f"rig resume '{out}'" in again.stderr
    assert "rig: no_port: " in rig("resume", out).stderr, "resume is what was advised, so it must go on to the board"
