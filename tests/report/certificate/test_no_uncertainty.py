"""A result whose uncertainties somebody made nothing is shown as it stands: no warning of NumPy, no traceback."""

import json
import re
import shutil
from pathlib import Path
from typing import Any

import pytest

from rig.cli import main
from support.paths import RECORDINGS

pytestmark = pytest.mark.slow

UNCERTAIN = re.compile("std|expanded|covariance|budget|limit")


def made(value: Any, number: float, place: str = "") -> Any:
    """The document with that number in the place of every uncertainty."""
    if isinstance(value, dict):
        return {key: made(each, number, f"{place}.{key}") for key, each in value.items()}
    if isinstance(value, list):
        return [made(each, number, place) for each in value]
    return number if isinstance(value, float) and UNCERTAIN.search(place) else value


@pytest.mark.parametrize("number", [0.0, 5e-324, 1e-300])
def test_uncertainties_of_nothing_are_shown(number: float, tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    run = Path(shutil.copytree(RECORDINGS / "six_observation", tmp_path / "run"))
    result = json.loads((run / "result.json").read_text(encoding="utf-8"))
    (run / "result.json").write_text(json.dumps(made(result, number)), encoding="utf-8")
    assert main(["show", str(run), "--all"]) == 0
    assert main(["report", str(run), "--history", str(tmp_path / "none")]) == 0
    said = capfd.readouterr()
    assert "Traceback" not in said.err and "Warning" not in said.err
