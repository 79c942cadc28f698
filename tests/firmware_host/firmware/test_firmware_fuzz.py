"""A short run of the fuzzer over the firmware's core, so that it stays runnable and what it once found stays found."""

import subprocess
import sys
from pathlib import Path

import pytest

from support.paths import FIRMWARE

pytestmark = pytest.mark.slow


@pytest.mark.thorough
def test_random_plays_break_no_rule(tmp_path: Path) -> None:
    command = ["make", "-s", "-C", str(FIRMWARE), "fuzz", f"OUT={tmp_path}", "SECONDS=4", f"PYTHON={sys.executable}"]
    run = subprocess.run(command, capture_output=True, text=True, check=False)
    assert run.returncode == 0, run.stdout + run.stderr
