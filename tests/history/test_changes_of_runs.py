"""Runs of the demonstration with one and the same sensor: of 105 comparisons five at most find that it has changed."""

from itertools import combinations
from pathlib import Path

import pytest

import rig
from support.laboratories.commands import rig as command
from support.laboratories.worlds import fresh_host
from support.paths import CONFIGS

RUNS = 15
pytestmark = [pytest.mark.slow, pytest.mark.proof, pytest.mark.thorough, pytest.mark.timeout(3600)]


def test_an_undamaged_part_of_the_demonstration_has_changed_in_one_of_twenty_pairs_at_most(tmp_path: Path) -> None:
    """The short version of this is test_changes.py, with results that are drawn."""
    results = [rig.load_result(ran(seed, tmp_path / str(seed))) for seed in range(101, 101 + RUNS)]
    found = [rig.changes(before, now)["gyro"] for before, now in combinations(results, 2)]
    largest = [max(change.normalised_error / change.limit for change in each.changes) for each in found]
    alone = sum(any(change.normalised_error > 1 for change in each.changes) for each in found)
    changed = sum(bool(each.changed) for each in found)
    print(f"{changed} of {len(found)} have changed, {alone} have an E_n above 1; largest {max(largest):.2f} limits")
    assert changed <= len(found) / 20


def ran(seed: int, folder: Path) -> Path:
    host = fresh_host()
    changes = {"world.seed": seed, "arm.host": host, "board.port": f"socket://{host}:7321", "history.off": "true"}
    options = [word for path, value in changes.items() for word in ("--set", f"{path}={value}")]
    ended = command("run", CONFIGS / "demo.yaml", "--yes", "--out", folder, *options)
    assert ended.returncode == 0, ended.stderr
    return folder
