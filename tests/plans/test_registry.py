"""The procedures by name, and the phases a configuration makes of them."""

import os
import subprocess
import sys
from pathlib import Path

from procedures import six_observation, verify
from rig.config.load import load
from rig.config.procedure_sections import STOCK_SECTIONS
from rig.plans.phase import first_phase
from rig.plans.registry import installed, sections
from rig.plans.script_file import script_file
from support.paths import CONFIGS, ROOT

VERIFIED = CONFIGS / "lsm9ds1_adis16465.yaml"


def test_the_stock_procedures_are_found_by_their_entry_points() -> None:
    assert installed()["six_observation"] is six_observation.PROCEDURE
    assert installed()["verify"] is verify.PROCEDURE
    found = sections(installed())
    assert {name: found[name] for name in STOCK_SECTIONS} == STOCK_SECTIONS


def test_a_calibration_is_followed_by_its_verification_only_when_asked() -> None:
    config = load(VERIFIED).config
    phase = first_phase(six_observation.PROCEDURE, config, installed())
    assert phase.follows is not None and phase.follows.procedure is verify.PROCEDURE
    assert (phase.agreed, phase.follows.agreed) == (False, True)
    assert (phase.procedure.readings, phase.follows.procedure.readings) == ("raw", "calibrated")
    assert phase.follows.plan() == phase.plan() and phase.follows.follows is None
    once = load(VERIFIED, ["procedure.verify=false"]).config
    assert first_phase(six_observation.PROCEDURE, once, installed()).follows is None
    alone = load(VERIFIED, ["procedure.name=verify"]).config
    assert first_phase(verify.PROCEDURE, alone, installed()).follows is None


def test_the_kept_script_is_the_file_the_procedure_came_from() -> None:
    kept = script_file(verify.PROCEDURE)
    assert kept.name == "verify.py" and "PROCEDURE = Procedure(" in kept.text and len(kept.sha256) == 64


def test_an_installed_procedure_that_cannot_be_loaded_has_a_name(tmp_path: Path) -> None:
    package = tmp_path / "broken-1.dist-info"
    package.mkdir()
    (package / "METADATA").write_text("Metadata-Version: 2.1\nName: broken\nVersion: 1\n", encoding="utf-8")
    entry = "[rig.procedures]\nbroken = nothing_of_that_name:PROCEDURE\n"
    (package / "entry_points.txt").write_text(entry, encoding="utf-8")
    path = os.pathsep.join([str(tmp_path), os.environ.get("PYTHONPATH", "")])
    done = subprocess.run(
        [sys.executable, "-m", "rig", "plan", str(VERIFIED)],
        capture_output=True, text=True, timeout=50, check=False, cwd=ROOT, env={**os.environ, "PYTHONPATH": path},
    )  # fmt: skip
    assert done.returncode == 2 and "rig: procedure_not_loaded: " in done.stderr, done.stderr
