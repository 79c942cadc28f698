"""The pages of the documentation have what the program offers."""

import re
import runpy
import sys

import pytest

import rig
import rig.procedure
from rig.config.judging.verdict_limits import LIMITS
from rig.report.words.check_words import check_words
from support.paths import DOCS


def test_every_public_name_stands_on_the_api_page() -> None:
    page = (DOCS / "how-to" / "with-code" / "api.rst").read_text(encoding="utf-8").splitlines()
    shown = {line.split(":: ")[1] for line in page if line.startswith((".. auto", ".. py:data"))}
    public = {f"rig.{name}" for name in rig.__all__} | {f"rig.procedure.{name}" for name in rig.procedure.__all__}
    assert public - {"rig.procedure.Fault", "rig.procedure.Refused"} == shown  # these are rig.Fault, rig.Refused


def test_every_check_that_the_method_explains_and_every_limit_says_what_to_do() -> None:
    method = (DOCS / "method.md").read_text(encoding="utf-8")
    explained = method.split("## Consistency of a recording")[1].split("\n## ")[0]
    tables = [rest.split("\n\n")[0] for rest in explained.split("| check | what is added |")[1:]]
    checks = {name for table in tables for name in re.findall(r"^\| .*?`…?(\w+)`", table, re.MULTILINE)}
    assert len(checks) > 20
    assert checks | {limit.what for limit in LIMITS.values()} <= check_words().keys()


def test_the_drawings_are_those_the_script_makes(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sys, "path", [*sys.path])  # to which the script adds its own folder
    drawn = runpy.run_path(str(DOCS / "drawings" / "draw.py"))["drawings"]()
    assert {name: (DOCS / "drawings" / name).read_text(encoding="utf-8") for name in drawn} == drawn, "make drawings"
