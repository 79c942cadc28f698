"""Benchmarks start as their first line says, from any folder and with nothing set."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from support.paths import ROOT

WITH_HELP = sorted(path for path in (ROOT / "benchmarks").glob("*.py") if "argparse" in path.read_text("utf-8"))


@pytest.mark.one_in(3)
@pytest.mark.slow
@pytest.mark.parametrize("benchmark", WITH_HELP, ids=lambda path: path.stem)
def test_a_benchmark_says_what_it_can(benchmark: Path, tmp_path: Path) -> None:
    plain = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    said = subprocess.run(
        [sys.executable, str(benchmark), "--help"], cwd=tmp_path, env=plain, capture_output=True, text=True, check=False
    )
    assert said.returncode == 0 and said.stdout.startswith("usage:"), said.stderr
