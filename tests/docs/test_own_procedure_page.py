"""The procedure that docs/how-to/with-code/own-procedure.md shows is one, and its configuration is one of it."""

import json
import re
from pathlib import Path

import pytest

from support.laboratories.commands import rig_here
from support.paths import CONFIGS, DOCS

pytestmark = pytest.mark.slow

PAGE = DOCS / "how-to" / "with-code" / "own-procedure.md"


def shown(language: str) -> str:
    """The page's one block of code in a language."""
    (block,) = re.findall(rf"^```{language}\n(.*?)^```$", PAGE.read_text(encoding="utf-8"), re.MULTILINE | re.DOTALL)
    return str(block)


def test_the_page_s_procedure_plans_as_stated(tmp_path: Path) -> None:
    script, config = tmp_path / "warm_up.py", tmp_path / "warm_up.yaml"
    script.write_text(shown("python"), encoding="utf-8")
    config.write_text(shown("yaml").replace("demo.yaml", str(CONFIGS / "demo.yaml")), encoding="utf-8")
    planned = rig_here("plan", config, "--script", script, "--json")
    assert planned.returncode == 0, planned.stderr
    steps = json.loads(planned.stdout)["steps"]
    assert (steps[0]["kind"], steps[0]["duration_s"]) == ("rest", 600)
    assert sum(step["kind"] == "sweep" for step in steps) == 6
