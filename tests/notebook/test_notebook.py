"""The rig from Python: `rig.load`, `rig.solve`, `rig.compare`, and what they show."""

import json
import subprocess
import sys

import numpy as np
import pytest

import rig
from rig.data.result_file import ResultDocument, read_result
from rig.errors import Refused
from rig.observation.windows import swept
from support.paths import DOCS, RECORDINGS
from support.processes.waiting import PATIENCE_S
from support.recordings.stated import SHARE, differences


@pytest.fixture(scope="module")
def run() -> rig.Run:
    return rig.load(RECORDINGS / "verified")


@pytest.fixture(scope="module")
def result(run: rig.Run) -> rig.Result:
    return rig.solve(run)


@pytest.mark.slow
def test_importing_it_loads_no_arm_driver_and_nothing_heavy() -> None:
    program = (
        "import sys, rig; before = set(sys.modules); rig.solve, rig.load, rig.compare\n"
        "print([name for name in before if name.split('.')[0] in ('numpy', 'scipy', 'pydantic', 'h5py')])\n"
        "print([name for name in sys.modules if name.startswith(('rtde', 'rig.turners.ur.arm_driver'))])"
    )
    done = subprocess.run(
        [sys.executable, "-c", program], capture_output=True, text=True, timeout=PATIENCE_S, check=True
    )
    assert done.stdout.split() == ["[]", "[]"]


@pytest.mark.slow
def test_readings_are_in_rad_s_on_the_arms_clock(run: rig.Run) -> None:
    time_s, rate_rad_s = run["gyro"].on_arm_clock()
    assert time_s.shape == (len(run["gyro"].samples),)
    assert rate_rad_s.shape == (len(time_s), 3)
    assert np.all(np.diff(time_s) > 0)
    assert run["gyro"] is run["gyro"]  # its clock is found once
    arm = run.recorded.movement[0].states["time_s"]
    assert arm[0] - 1 < time_s[0] < time_s[-1] < arm[-1] + 1
    sweep = next(swept(run.recorded.movement[0])).window
    middle = np.abs(time_s - (sweep.start_s + sweep.end_s) / 2) < 1
    assert np.linalg.norm(rate_rad_s[middle], axis=1).mean() == pytest.approx(np.radians(120) / 1.144, rel=0.02)


@pytest.mark.slow
def test_the_result_is_that_of_the_run(result: rig.Result) -> None:
    then, document = read_result(RECORDINGS / "verified"), result.to_dict()
    now = ResultDocument.model_validate(document)
    assert differences(then, now) == []
    gyro = now.gyroscopes["gyro"]
    assert (*result["gyro"].scale, *result["gyro"].bias_rad_s) == (*gyro.scale, *gyro.bias_rad_s)
    np.testing.assert_allclose(result["gyro"].std ** 2, np.diag(gyro.covariance))
    assert result.verdict == then.verdict == "pass"
    assert json.loads(json.dumps(document)) == document
    assert set(document) == set(json.loads(then.text()))


@pytest.mark.slow
def test_another_estimator_and_another_threshold(run: rig.Run) -> None:
    assert "newton" in repr(rig.solve(run, estimator="newton", max_lost_fraction=0.01)["gyro"])
    assert rig.solve(run, scale_std=1e-9).verdict == "fail"
    with pytest.raises(Refused, match=r"unknown_setting: .*max_lost'.*observation\.max_lost_fraction"):
        rig.solve(run, max_lost=0.01)


@pytest.mark.slow
def test_two_sensors_beside_each_other(run: rig.Run) -> None:
    beside = rig.compare(run, "gyro", "reference")
    assert beside.before is not None and beside.after is not None
    then = read_result(RECORDINGS / "verified").verification["gyro"]
    assert then.before is not None
    np.testing.assert_allclose(beside.after.movement.rms_rad_s, then.after.movement.rms_rad_s, rtol=SHARE)
    np.testing.assert_allclose(beside.before.movement.rms_rad_s, then.before.movement.rms_rad_s, rtol=SHARE)
    other_way = rig.compare(run, "reference", "gyro")  # the calibrated one is the reference of the reference
    assert other_way.after is not None
    assert other_way.after.movement.rms_rad_s.max() < 0.006


@pytest.mark.slow
def test_the_verification_stands_as_a_run_of_its_own(run: rig.Run) -> None:
    assert run.verification is not None
    assert run.verification["gyro"].sensor.mode == "calibrated"
    assert rig.compare(run.verification, "gyro", "reference").before is None
    assert run.verification.verification is None


@pytest.mark.slow
def test_what_is_not_there_is_refused_by_name(run: rig.Run, result: rig.Result) -> None:
    for ask in (lambda: run["accelerometer"], lambda: result["accelerometer"], lambda: rig.compare(run, "gyro", "x")):
        with pytest.raises(Refused, match=r"no_such_sensor: .*gyro'?, '?reference"):
            ask()
    assert "gyro" in run and "accelerometer" not in run and run.get("accelerometer") is None
    assert "gyro" in result and result.get("accelerometer") is None
    with pytest.raises(Refused, match="no_run"):
        rig.load(DOCS)
    with pytest.raises(AttributeError, match="no attribute 'sovle'"):
        rig.sovle  # noqa: B018


@pytest.mark.slow
def test_everything_shows_itself_in_a_line_or_a_table(run: rig.Run, result: rig.Result) -> None:
    beside = rig.compare(run, "gyro", "reference")
    for shown in (run, run["gyro"], result, result["gyro"], beside):
        assert len(repr(shown)) < 300
    for shown in (run, run["gyro"], result, result["gyro"], beside):
        assert shown._repr_html_().startswith("<table>")
        assert json.loads(json.dumps(shown.to_dict()))
    for plot in (run["gyro"].plot(), result.plot(), beside.plot()):
        assert plot._repr_png_().startswith(b"\x89PNG")


def test_a_result_is_a_table_with_a_row_for_each_axis() -> None:
    result = rig.load_result(RECORDINGS / "six_observation")
    table = result.to_frame()
    assert list(table.columns) == ["scale", "scale_expanded", "bias", "bias_expanded", "unit"]
    assert list(table.loc[["gyro x", "gyro y", "gyro z"], "scale"]) == list(result["gyro"].scale)
    assert list(table.loc[["gyro x", "gyro y", "gyro z"], "bias_expanded"]) == list(result["gyro"].bias_expanded)
