"""Benchmarks start as their first line says, from any folder and with nothing set, and run to their end."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

from support.paths import ROOT
from support.processes.waiting import PATIENCE_S

WITH_HELP = sorted(path for path in (ROOT / "benchmarks").glob("*/*.py") if "argparse" in path.read_text("utf-8"))

HOURS = {
    "faults",
    "long_life",
    "damaged_frames",
    "hidden_worlds",
}  # `make bench` leaves them out: tests have them in small
# What makes a benchmark short. `make proof` alone has time for the others.
SHORT = {
    "batch": (),
    "by_hand": ("2",),
    "decoding": ("0.1",),
    "emulator": ("0.5",),
    "hand_cost": (),
    "kvh1775_decoding": ("0.1",),
    "lines_decoding": ("0.5",),
    "peers": (),
    "solver_cost": (),
    "studies": ("normal",),
    "throughput": ("1",),
}
LONGER = {
    "again": ("--recordings", "3"),
    "arm_against_logs": (),
    "commands": ("--rounds", "1"),
    "efficiency": (),
    "end_of_run": ("--rounds", "1"),
    "framing": ("1000",),
    "history": ("--calibrations", "2000"),
    "page": ("0.5",),
    "procedure": (),
    "slow_reader": ("--turns", "1"),
    "solve": (),
    "under_load": ("--demos", "1", "--busy", "0"),
}


def run(benchmark: Path, folder: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    plain = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    command = [sys.executable, str(benchmark), *arguments]
    return subprocess.run(
        command, cwd=folder, env=plain, capture_output=True, text=True, timeout=PATIENCE_S, check=False
    )


def test_every_benchmark_has_a_short_form_or_takes_hours() -> None:
    assert {path.stem for path in (ROOT / "benchmarks").glob("*/*.py")} == {*HOURS, *SHORT, *LONGER}


@pytest.mark.thorough
@pytest.mark.one_in(4)
@pytest.mark.slow
@pytest.mark.parametrize(
    ("benchmark", "arguments"),
    [
        *(pytest.param(*each, id=each[0]) for each in SHORT.items()),
        *(pytest.param(*each, id=each[0], marks=pytest.mark.thorough) for each in LONGER.items()),
    ],
)
def test_a_short_benchmark_runs_to_its_end(benchmark: str, arguments: tuple[str, ...], tmp_path: Path) -> None:
    """How fast this computer is decides the figures; one that calls it too slow has come to its end as well."""
    (file,) = (ROOT / "benchmarks").glob(f"*/{benchmark}.py")
    said = run(file, tmp_path, *arguments)
    last = said.stdout.rstrip().rpartition("\n")[2]
    assert said.returncode == 0 or last.startswith("under "), said.stdout + said.stderr
    assert last


@pytest.mark.one_in(12)  # a benchmark takes as long to import as its tools
@pytest.mark.slow
@pytest.mark.parametrize("benchmark", WITH_HELP, ids=lambda path: path.stem)
def test_a_benchmark_says_what_it_can(benchmark: Path, tmp_path: Path) -> None:
    said = run(benchmark, tmp_path, "--help")
    assert said.returncode == 0 and said.stdout.startswith("usage:"), said.stderr


@pytest.mark.slow
@pytest.mark.parametrize(
    ("seconds", "status", "met"), [(0.05, 0, "yes"), (0.066, 0, "no, by 10%"), (0.09, 3, "no, by 50%")]
)
def test_a_figure_far_behind_its_goal_has_a_status_of_its_own(
    seconds: float, status: int, met: str, tmp_path: Path
) -> None:
    benchmarks = ROOT / "benchmarks"
    script = tmp_path / "measures.py"
    figure = f'record("rig --help", {seconds}, "s", peer="python", peer_value=0.02)'
    script.write_text(f"import sys\nsys.path.insert(0, {str(benchmarks)!r})\nfrom goals import record\n{figure}\n")
    said = run(benchmarks / "goals.py", tmp_path, str(script))
    assert said.returncode == status, said.stderr
    ratio = seconds / 0.02
    assert f"| rig --help | {seconds:.3g} s | python 0.02 s | {ratio:.3g} | ≤ 0.06 s | {met} |" in said.stdout


@pytest.mark.slow
def test_a_benchmark_that_fails_is_named_and_the_others_run(tmp_path: Path) -> None:
    fails, runs = tmp_path / "fails.py", tmp_path / "runs.py"
    fails.write_text("raise SystemExit(4)\n")
    runs.write_text("print('it runs')\n")
    said = run(ROOT / "benchmarks" / "goals.py", tmp_path, str(fails), str(runs))
    assert said.returncode == 1
    assert "it runs" in said.stdout and f"failed: {fails}" in said.stdout
