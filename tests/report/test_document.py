"""Recordings of the first version solve to the documents they solved to then: the same keys, order and values."""

import json
from dataclasses import replace
from typing import Any

import pytest

from rig.analysis.outcome import Outcome, outcome_of
from rig.analysis.verdict import Check
from rig.data.run_file import read_run
from rig.report.document import document_of
from support.paths import FIXTURES


def outcome(name: str) -> Outcome:
    folder = FIXTURES / name
    repeated = [read_run(file) for file in folder.glob("verify.h5")]
    return outcome_of([read_run(folder / "run.h5")], repeated or None)


def assert_alike(found: Any, expected: Any, place: str = "") -> None:
    """Mappings in the same order, numbers within 1e-12, everything else equal."""
    assert type(found) is type(expected), place
    if isinstance(expected, dict):
        assert list(found) == list(expected), place
        for key, value in expected.items():
            assert_alike(found[key], value, f"{place}.{key}")
    elif isinstance(expected, list):
        assert len(found) == len(expected), place
        for index, value in enumerate(expected):
            assert_alike(found[index], value, f"{place}[{index}]")
    elif isinstance(expected, float):
        assert found == pytest.approx(expected, rel=1e-12, abs=1e-12), place
    else:
        assert found == expected, place


@pytest.mark.parametrize("name", ["calibration", "verified"])
def test_a_recording_solves_to_what_it_solved_to(name: str) -> None:
    expected = json.loads((FIXTURES / name / "result.json").read_text(encoding="utf-8"))
    found = json.loads(document_of(outcome(name)).text())
    assert found["provenance"].pop("solved_utc") > expected["provenance"].pop("solved_utc")
    assert_alike(found, expected)


def test_a_limit_that_was_not_set_is_not_written_as_a_number() -> None:
    found = outcome("calibration")
    unset = Check("gyro.verification_rms", 0.0, None, "rad/s")
    document = json.loads(document_of(replace(found, checks=(*found.checks, unset))).text())
    assert document["checks"][-1] == {
        "name": "gyro.verification_rms",
        "value": 0.0,
        "limit": None,
        "unit": "rad/s",
        "passed": False,
    }
    assert document["verdict"] == "fail"
