"""`rig board hand`: the board, a simulated operator on its table, and the answer held against double precision."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from rig.analysis.hand_on_board import SCALE_LIMIT
from support.commands import rig, rig_here
from support.paths import CONFIGS
from support.worlds import merge

BY_HAND = CONFIGS / "by_hand.yaml"


def config_in(folder: Path, **changes: Any) -> tuple[Path, dict[str, Any]]:
    """The configuration, with what is changed of it."""
    document = merge(yaml.safe_load(BY_HAND.read_text()), changes)
    path = folder / "by_hand.yaml"
    path.write_text(yaml.safe_dump(document))
    return path, document


@pytest.mark.slow
@pytest.mark.timeout(300)
def test_the_board_calibrates_asks_again_agrees_and_stores(tmp_path: Path) -> None:
    flash = tmp_path / "flash.bin"
    hand = {"mistakes": {"too_fast": 0.2}}
    path, document = config_in(tmp_path, world={"time_scale": 20, "hand": hand, "board": {"flash_file": str(flash)}})
    ended = rig("board", "hand", path, "--json", "--write", "--yes", timeout_s=280)
    assert ended.returncode == 0, ended.stderr
    found = json.loads(ended.stdout)
    truth = document["world"]["sensors"]["gyro"]
    assert found["moves"] >= 12
    assert found["matrix_difference"] <= SCALE_LIMIT
    assert np.max(np.abs(np.array(found["scale"]) / truth["scale"] - 1)) < found["expanded_scale"]
    assert np.max(np.abs(np.array(found["bias_rad_s"]) - truth["bias_rad_s"])) < 5e-4
    assert "taken: from +z to +x" in ended.stderr
    assert "not taken: clipping" in ended.stderr
    assert "again: it was turned faster than the sensor's range" in ended.stderr
    read = rig("board", "calibration", "read", path, "--json")
    stored = json.loads(read.stdout)["sensors"]["gyro"]
    assert stored["matrix"] == found["matrix"]
    assert stored["serial_number"] == "LSM9DS1-HAND"


@pytest.mark.parametrize(
    ("arguments", "named"),
    [
        (("--moves", "3"), "bad_option"),
        (("--scale-std", "0"), "bad_option"),
        (("--sensor", "other"), "no_such_sensor"),
    ],
)
def test_what_cannot_be_is_refused_before_anything_is_connected(arguments: tuple[str, ...], named: str) -> None:
    ended = rig_here("board", "hand", BY_HAND, *arguments)
    assert ended.returncode == 2
    assert named in ended.stderr


@pytest.mark.slow
def test_a_sensor_without_accelerations_is_refused(tmp_path: Path) -> None:
    path, _ = config_in(tmp_path, sensors={"gyro": {"acceleration": None}})
    document = yaml.safe_load(path.read_text())
    del document["world"]["sensors"]["gyro"]["accelerometer"]
    path.write_text(yaml.safe_dump(document))
    ended = rig("board", "hand", path)
    assert ended.returncode == 2
    assert "first_face_not_told" in ended.stderr
