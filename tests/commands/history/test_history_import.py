"""`rig history import` enters what recordings give, not what a folder claims."""

import json
import re
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from rig.analysis.estimator_names import DEFAULT_ESTIMATOR
from rig.data.result_file import ResultDocument, read_result
from rig.history.entered.recomputed_result import differing_parts
from rig.history.store import open_history
from rig.plans.recorded_run import judge_phases, open_run
from rig.report.document import document_of
from support.laboratories.commands import rig_here
from support.paths import RECORDINGS

Document = dict[str, Any]


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv("RIG_HISTORY", str(tmp_path / "history.sqlite"))
    return Path(shutil.copytree(RECORDINGS / "six_observation", tmp_path / "run"))


def claims(folder: Path, change: Callable[[Document], None]) -> None:
    result = json.loads((folder / "result.json").read_text(encoding="utf-8"))
    change(result)
    (folder / "result.json").write_text(json.dumps(result), encoding="utf-8")


@pytest.fixture(scope="module")
def given() -> ResultDocument:
    return document_of(judge_phases(open_run(RECORDINGS / "six_observation"), DEFAULT_ESTIMATOR))


def runs(folder: Path) -> int:
    with open_history(str(folder.parent / "history.sqlite")) as history:
        return len(list(history.kept()))


def scale(result: Document) -> None:
    gyro = result["gyroscopes"]["gyro"]
    gyro["scale"][0] += 1e-3 * gyro["covariance"][0][0] ** 0.5  # a thousandth of what is stated of it


def verdict(result: Document) -> None:
    result["verdict"] = "fail"


def limit(result: Document) -> None:
    result["checks"][0]["limit"] *= 2


def kind(result: Document) -> None:
    result["checks"][1]["kind"] = "conformity"  # of scale_std, which would excuse a measurement that is not fit


def serial_number(result: Document) -> None:
    result["gyroscopes"]["gyro"]["serial_number"] = "G-9"


def mean(result: Document) -> None:
    result["gyroscopes"]["gyro"]["observations"][2]["mean_rad_s"][1] += 1e-4


def board(result: Document) -> None:
    result["provenance"]["board_unique_id"] = "another"


@pytest.mark.slow
@pytest.mark.parametrize(
    ("change", "named"),
    [
        (scale, "kx 1."),
        (verdict, "verdict"),
        (limit, "max_deviation"),
        (kind, "gyro.scale_std"),
        (serial_number, "serial_number of gyro"),
        (mean, "gyroscopes.gyro.observations.2.mean_rad_s.1 "),
        (board, "provenance.board_unique_id"),
    ],
)
def test_a_result_that_its_recording_does_not_give_is_known_by_what_differs(
    change: Callable[[Document], None], named: str, folder: Path, given: ResultDocument
) -> None:
    assert differing_parts(read_result(folder), given) == []
    claims(folder, change)
    assert named in "; ".join(differing_parts(read_result(folder), given))


@pytest.mark.slow
def test_what_the_recording_gives_is_entered_and_a_claim_is_refused(folder: Path) -> None:
    stated = read_result(folder).gyroscopes["gyro"]
    claims(folder, scale)
    imported = rig_here("history", "import", folder)
    assert imported.returncode == 1 and "result_not_of_recording" in imported.stderr and runs(folder) == 0
    assert "1 entered" in rig_here("history", "import", "--solve", folder).stdout
    with open_history(str(folder.parent / "history.sqlite")) as history:
        (found,) = (calibration for calibration in history.calibrations() if calibration.sensor == "gyro")
        assert abs(found.value("kx") - stated.scale[0]) < 1e-6 * stated.covariance[0][0] ** 0.5
    assert "0 changed" in rig_here("history", "verify").stdout


def test_a_result_alone_is_a_claim_and_is_refused(folder: Path) -> None:
    (folder / "run.h5").unlink()
    imported = rig_here("history", "import", folder)
    assert imported.returncode == 1 and "no_recording" in imported.stderr and runs(folder) == 0


@pytest.mark.slow
def test_a_certificate_with_other_numbers_and_its_number_left_is_not_entered(folder: Path) -> None:
    assert rig_here("report", folder).returncode == 0
    page = folder / "certificate.html"
    text = page.read_text(encoding="utf-8")
    value = re.findall(r"\d\.\d{5}", text)[0]
    page.write_text(text.replace(value, f"{float(value) + 0.1:.5f}"), encoding="utf-8")
    imported = rig_here("history", "import", folder)
    assert imported.returncode == 0 and "is not the one this version writes" in imported.stderr
    assert "certificate.html" not in rig_here("history", "show", "1").stdout
    page.write_text(text, encoding="utf-8")
    assert rig_here("report", folder).stderr == ""
    assert "certificate.html of it" in rig_here("history", "show", "1").stdout
