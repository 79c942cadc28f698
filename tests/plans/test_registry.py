"""The procedures by name, and the phases a configuration makes of them."""

import os
import subprocess
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest
import yaml

from procedures import six_observation, verify
from rig.config.load import load
from rig.config.procedures.procedure_sections import STOCK_SECTIONS
from rig.errors import Refused
from rig.motion.steps import Plan
from rig.plans.phase import first_phase
from rig.plans.procedure_registry import load_procedures, sections
from rig.plans.script_file import find_installed_script, load_script
from support.paths import CONFIGS, ROOT
from support.processes.waiting import PATIENCE_S

OWN = """
from dataclasses import replace
from procedures.six_observation import PROCEDURE as STOCK
from rig.procedure import run_script

PROCEDURE = replace(STOCK, then=None)

if __name__ == "__main__":
    raise SystemExit(run_script(PROCEDURE))
"""
VERIFIED = CONFIGS / "lsm9ds1_adis16465.yaml"


def test_the_stock_procedures_are_found_by_the_names_of_their_sections() -> None:
    assert load_procedures()["six_observation"] is six_observation.PROCEDURE
    assert load_procedures()["verify"] is verify.PROCEDURE
    found = sections(load_procedures())
    assert {name: found[name] for name in STOCK_SECTIONS} == STOCK_SECTIONS


def test_a_calibration_is_followed_by_its_verification_only_when_asked() -> None:
    config = load(VERIFIED).config
    phase = first_phase(six_observation.PROCEDURE, config, load_procedures())
    assert phase.follows is not None and phase.follows.procedure is verify.PROCEDURE
    assert (phase.agreed, phase.follows.agreed) == (False, True)
    assert (phase.procedure.readings, phase.follows.procedure.readings) == ("raw", "calibrated")
    assert phase.follows.plan() == phase.plan() and phase.follows.follows is None
    once = load(VERIFIED, ["procedure.verify=false"]).config
    assert first_phase(six_observation.PROCEDURE, once, load_procedures()).follows is None
    alone = load(VERIFIED, ["procedure.name=verify"]).config
    assert first_phase(verify.PROCEDURE, alone, load_procedures()).follows is None


def test_a_procedure_that_is_to_follow_and_is_not_there_is_refused_by_name() -> None:
    config = load(VERIFIED).config
    with pytest.raises(Refused, match=r"no_such_procedure: .*six_observation is to be followed by 'nonesuch'"):
        first_phase(replace(six_observation.PROCEDURE, then="nonesuch"), config, load_procedures())


def failing(*_: object) -> Plan:
    raise ZeroDivisionError("by a speed of nothing")


def giving_nothing(*_: object) -> Plan:
    return None  # pyrefly: ignore[bad-return]  # the mistake


def ending(*_: object) -> Plan:
    raise SystemExit(0)


@pytest.mark.parametrize(
    ("planner", "said"),
    [
        (failing, r"ZeroDivisionError: by a speed of nothing; test_registry\.py, line \d+"),
        (giving_nothing, "TypeError: its planner gives NoneType, no Plan"),
        (ending, "SystemExit: 0"),
    ],
)
def test_a_planner_that_fails_is_refused_by_name(planner: Callable[..., Plan], said: str) -> None:
    phase = first_phase(replace(six_observation.PROCEDURE, plan=planner), load(VERIFIED).config, load_procedures())
    with pytest.raises(Refused, match=rf"script_failed: the procedure six_observation cannot be planned \({said}"):
        phase.plan()


def test_the_kept_script_is_the_file_the_procedure_came_from() -> None:
    kept = find_installed_script("verify")
    assert kept.procedure is verify.PROCEDURE and kept.is_installed
    assert kept.name == "verify.py" and "PROCEDURE = Procedure(" in kept.text and len(kept.sha256) == 64


@pytest.mark.thorough
@pytest.mark.slow
def test_an_own_script_may_borrow_all_but_its_name_and_is_kept_itself(tmp_path: Path) -> None:
    own, config = tmp_path / "own.py", tmp_path / "hardware.yaml"
    own.write_text(OWN, encoding="utf-8")
    assert not load_script(own).is_installed
    hardware = yaml.safe_load((CONFIGS / "demo.yaml").read_text(encoding="utf-8"))
    del hardware["world"]
    config.write_text(yaml.safe_dump({**hardware, "board": {"port": "socket://127.9.9.9:1"}}), encoding="utf-8")
    command = [sys.executable, str(own), str(config), "--out", str(tmp_path / "run")]
    done = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE_S, check=False)
    assert done.returncode == 2 and "rig: no_port: " in done.stderr, done.stderr
    assert (tmp_path / "run" / "script.py").read_text(encoding="utf-8") == OWN


@pytest.mark.slow
def test_an_installed_procedure_that_cannot_be_loaded_has_a_name(tmp_path: Path) -> None:
    package = tmp_path / "broken-1.dist-info"
    package.mkdir()
    (package / "METADATA").write_text("Metadata-Version: 2.1\nName: broken\nVersion: 1\n", encoding="utf-8")
    entry = "[rig.procedures]\nbroken = nothing_of_that_name:PROCEDURE\n"
    (package / "entry_points.txt").write_text(entry, encoding="utf-8")
    path = os.pathsep.join([str(tmp_path), os.environ.get("PYTHONPATH", "")])
    done = subprocess.run(
        [sys.executable, "-m", "rig", "plan", str(VERIFIED)],
        capture_output=True, text=True, timeout=PATIENCE_S, check=False, cwd=ROOT,
        env={**os.environ, "PYTHONPATH": path},
    )  # fmt: skip
    assert done.returncode == 2 and "rig: procedure_not_loaded: " in done.stderr, done.stderr
