"""The documentation becomes a site without a warning, and the site has what the program offers."""

import os
import re
import runpy
import subprocess
import sys
from pathlib import Path

import pytest

import rig
import rig.procedure
from rig.config.judging.verdict_limits import LIMITS
from rig.report.words.check_words import check_words
from support.paths import DOCS, ROOT


def test_every_public_name_stands_on_the_api_page() -> None:
    page = (DOCS / "how-to" / "with-code" / "api.rst").read_text(encoding="utf-8").splitlines()
    shown = {line.split(":: ")[1] for line in page if line.startswith((".. auto", ".. py:data"))}
    public = {f"rig.{name}" for name in rig.__all__} | {f"rig.procedure.{name}" for name in rig.procedure.__all__}
    assert public - {"rig.procedure.Fault", "rig.procedure.Refused"} == shown  # these are rig.Fault, rig.Refused


def test_every_check_that_the_method_explains_and_every_limit_says_what_to_do() -> None:
    method = (DOCS / "method.md").read_text(encoding="utf-8")
    explained = method.split("## What contradicts itself")[1].split("\n## ")[0]
    tables = [rest.split("\n\n")[0] for rest in explained.split("| check | what is added |")[1:]]
    checks = {name for table in tables for name in re.findall(r"^\| .*?`…?(\w+)`", table, re.MULTILINE)}
    assert len(checks) > 20
    assert checks | {limit.what for limit in LIMITS.values()} <= check_words().keys()


def test_the_drawings_are_those_the_script_makes(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "path", [*sys.path])  # to which the script adds its own folder
    drawn = runpy.run_path(str(DOCS / "drawings" / "draw.py"))["drawings"]()
    assert {name: (DOCS / "drawings" / name).read_text(encoding="utf-8") for name in drawn} == drawn, "make drawings"


@pytest.mark.thorough
@pytest.mark.slow
def test_the_site_is_built_without_a_warning(tmp_path: Path) -> None:
    """As `make docs` does it, but for the notebook, which is executed by tests/notebook/test_first_look.py."""
    command = [sys.executable, "-m", "sphinx", "--fail-on-warning", "--keep-going", "--quiet", "-c", str(DOCS)]
    command += ["-D", "nb_execution_mode=off", "-d", str(tmp_path / "doctrees"), str(ROOT), str(tmp_path / "site")]
    made = subprocess.run(
        command, env={**os.environ, "PYTHONPATH": str(ROOT)}, capture_output=True, text=True, check=False
    )
    assert made.returncode == 0, made.stderr
    assert "README.html" in (tmp_path / "site" / "index.html").read_text(encoding="utf-8")
    assert "rig.load" in (tmp_path / "site" / "docs" / "api.html").read_text(encoding="utf-8")
