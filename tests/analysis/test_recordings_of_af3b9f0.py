"""Recordings made at commit af3b9f0 still open and solve to the very numbers they gave then."""

import json
import math
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import h5py
import pytest

from rig.analysis.outcome import calibrated, verified
from rig.data.run_file import RunData, read_run
from rig.report.document import document_of
from support.paths import FIXTURES

RELATIVE = 1e-12


def solved(folder: Path) -> dict[str, Any]:
    runs, repeated = [read_run(folder / "run.h5")], folder / "verify.h5"
    outcome = calibrated(runs)
    if repeated.exists():
        outcome = verified(outcome, [read_run(repeated)])
    document: dict[str, Any] = json.loads(document_of(outcome).text())
    return document


def expected_of(folder: Path) -> dict[str, Any]:
    document: dict[str, Any] = json.loads((folder / "result.json").read_text(encoding="utf-8"))
    return document


def differences(expected: Any, found: Any, where: str = "") -> Iterator[str]:
    """Every place where what was expected is not there; what was added since may be."""
    if isinstance(expected, dict) and isinstance(found, dict):
        for key, value in expected.items():
            yield from differences(value, found.get(key), f"{where}.{key}")
    elif isinstance(expected, list) and isinstance(found, list) and len(expected) == len(found):
        for place, (one, other) in enumerate(zip(expected, found, strict=True)):
            yield from differences(one, other, f"{where}[{place}]")
    elif isinstance(expected, float) and isinstance(found, float | int):
        if not math.isclose(expected, found, rel_tol=RELATIVE):
            yield f"{where}: {expected!r} became {found!r}"
    elif expected != found:
        yield f"{where}: {expected!r} became {found!r}"


@pytest.mark.parametrize("name", ["calibration", "verified"])
def test_an_old_recording_solves_to_the_old_numbers(name: str) -> None:
    expected, found = expected_of(FIXTURES / name), solved(FIXTURES / name)
    for part in ("verdict", "checks", "sensors", "verification"):
        assert list(differences(expected[part], found[part], part)) == []


def test_keys_the_configuration_no_longer_has_do_not_matter(tmp_path: Path) -> None:
    folder = shutil.copytree(FIXTURES / "calibration", tmp_path / "run")
    with h5py.File(folder / "run.h5", "r+") as file:
        file.attrs["config"] = file.attrs["config"].replace("rest_s:", "pause_s:") + "\nlighting: {colour: red}\n"
    assert solved(folder)["checks"] == solved(FIXTURES / "calibration")["checks"]


def test_another_limit_gives_another_verdict() -> None:
    run: RunData = read_run(FIXTURES / "calibration" / "run.h5")
    assert calibrated([run]).passed
    assert not calibrated([run.judged_by(["limits.scale_std=1e-6"])]).passed
