"""Whole runs by hand through the real wire: the emulated board on its cable, turned by the simulated operator."""

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from rig.config.load import load
from rig.turners.turner_registry import sections
from support.laboratories.commands import rig, rig_here
from support.laboratories.worlds import fresh_host, merge
from support.paths import CONFIGS

pytestmark = pytest.mark.slow
MISTAKES = {"short": 0.06, "crumb": 0.04, "held": 0.04, "wrong_face": 0.04, "two_turns": 0.03, "skipped": 0.02}


def config(folder: Path, **changes: Any) -> Path:
    """configs/by_hand.yaml at an address of its own, with changes."""
    own = {"board": {"port": f"socket://{fresh_host()}:7321"}, "history": {"off": True}}
    text = load(CONFIGS / "by_hand.yaml", turners=sections()).text
    path = folder / "config.yaml"
    document = merge(merge(yaml.safe_load(text), own), changes)
    path.write_text(yaml.safe_dump(document, sort_keys=False), encoding="utf-8")
    return path


def held(run: Path) -> None:
    """The scale factors of a run's result are those of its simulated part, by what the session itself tells."""
    result = json.loads((run / "result.json").read_text(encoding="utf-8"))
    truth = yaml.safe_load((run.parent / "config.yaml").read_text(encoding="utf-8"))["world"]["sensors"]["gyro"]
    entry = result["gyroscopes"]["gyro"]
    expanded = 3 * np.array(entry["by_hand"]["session_std"])
    assert np.all(np.abs(np.subtract(entry["scale"], truth["scale"])) < expanded), entry["scale"]


@pytest.mark.thorough
def test_a_run_with_mistakes_asks_again_and_passes_and_solves_again_to_the_same(tmp_path: Path) -> None:
    path, out = config(tmp_path, world={"seed": 11, "hand": {"mistakes": {"short": 0.5}}}), tmp_path / "run"
    done = rig("run", path, "--out", out, "--set", "procedure.flips=8")
    assert done.returncode == 0, done.stderr + done.stdout
    assert "again: " in done.stderr
    assert "not accepted: turn_not_closed" in done.stderr
    assert re.search(r"left out: \d of \d+ moves, not accepted; the first move \d", " ".join(done.stdout.split()))
    held(out)
    again = rig_here("solve", out, "--json")
    first, second = json.loads((out / "result.json").read_text()), json.loads(again.stdout)
    assert first["gyroscopes"] == second["gyroscopes"]
    assert "By hand: the item was turned" in (out / "certificate.html").read_text(encoding="utf-8")
    assert rig_here("show", out).returncode == 0


@pytest.mark.proof
@pytest.mark.thorough
@pytest.mark.parametrize("mistakes", [dict.fromkeys(MISTAKES, 0.0), MISTAKES], ids=["none", "mistakes"])
@pytest.mark.parametrize("seed", range(20))
def test_a_verdict_is_reached_without_help(seed: int, mistakes: dict[str, float], tmp_path: Path) -> None:
    path, out = config(tmp_path, world={"seed": 200 + seed, "hand": {"mistakes": mistakes}}), tmp_path / "run"
    done = rig("run", path, "--out", out)
    assert done.returncode == 0, done.stderr + done.stdout
    held(out)
