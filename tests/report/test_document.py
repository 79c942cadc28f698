"""The typed outcome as the document of `result.json`: nothing is written that nobody set or measured."""

import io
import json
import math
from dataclasses import replace

import pytest
from rich.console import Console

from rig.analysis.analyses import calibrate
from rig.analysis.check import Check
from rig.analysis.outcome import Outcome
from rig.data.meaning import Meaning
from rig.data.recording.run_file import read_run
from rig.data.result_file import CheckEntry
from rig.motion.geometry import NOMINAL
from rig.report.document import document_of
from rig.report.entry import entry
from rig.report.terminal.result_table import print_result
from support.paths import RECORDINGS
from support.recordings.synthetic_run import Setup, synthetic_run

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def outcome() -> Outcome:
    return calibrate([read_run(RECORDINGS / "six_observation" / "run.h5")])


def test_the_keys_stand_in_the_order_they_always_had(outcome: Outcome) -> None:
    old = json.loads((RECORDINGS / "six_observation" / "result.json").read_text(encoding="utf-8"))
    new = json.loads(document_of(outcome).text())
    assert list(new) == list(old)
    assert list(new["provenance"]) == list(old["provenance"])
    assert list(new["gyroscopes"]["gyro"]) == list(old["gyroscopes"]["gyro"])


def test_a_limit_that_was_not_set_is_not_written_as_a_number(outcome: Outcome) -> None:
    unset = Check("gyro.verification_rms", 0.0, None, "rad/s", Meaning("conformity", "gyro", "rate"))
    document = json.loads(document_of(replace(outcome, checks=(*outcome.checks, unset))).text())
    assert document["checks"][-1] == {
        "name": "gyro.verification_rms",
        "value": 0.0,
        "limit": None,
        "unit": "rad/s",
        "passed": False,
        "kind": "conformity",
        "sensor": "gyro",
        "quantity": "rate",
    }
    assert document["verdict"] == "fail"


def test_a_reference_has_no_solution_of_the_board() -> None:
    found = calibrate([read_run(RECORDINGS / "verified" / "run.h5")])
    sensors = json.loads(document_of(found).text())["gyroscopes"]
    assert (sensors["gyro"]["role"], "board" in sensors["gyro"]) == ("calibrate", True)
    assert (sensors["reference"]["role"], "board" in sensors["reference"]) == ("reference", False)


def test_a_field_the_document_does_not_have_is_not_written(outcome: Outcome) -> None:
    with pytest.raises(TypeError, match="CheckEntry has no limits"):
        entry(CheckEntry, outcome.checks[0], limits=1.0)
    with pytest.raises(ValueError, match="passed"):
        entry(CheckEntry, name="gyro.scale", value=None, limit=None, unit="1")


def test_the_result_says_which_arm_was_reckoned_with_and_at_what_speed_it_is_valid() -> None:
    document = document_of(calibrate([synthetic_run(Setup(stated_kinematics=NOMINAL))]))
    assert document.provenance.arm_kinematics is not None
    assert document.provenance.arm_kinematics.alpha_rad == NOMINAL.alpha_rad
    sensor = json.loads(document.text())["gyroscopes"]["gyro"]
    assert sensor["speeds_rad_s"] == pytest.approx([math.pi / 3], rel=1e-3)
    assert "nonlinearity" not in sensor
    console = Console(width=150, file=io.StringIO(), record=True)
    print_result(document, console)
    assert "the scale factors apply at ±60.0 °/s" in console.export_text()
