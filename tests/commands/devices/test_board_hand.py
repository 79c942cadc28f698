"""`rig board hand`: the board, a simulated operator on its table, and the answer held against double precision."""

import json
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from rig.analysis.by_hand.on_board import SCALE_LIMIT
from support.board.hand_on_board import alone, run_button_session, serve
from support.board.host_board import HostBoard
from support.external.handled_body import TWELVE, Recorded, handle
from support.laboratories.commands import rig, rig_here
from support.laboratories.worlds import merge
from support.paths import CONFIGS

BY_HAND = CONFIGS / "by_hand.yaml"
MPU9250 = ("--set", "sensors.gyro.part=mpu9250", "--set", "sensors.gyro.rate_hz=250")


def config_in(folder: Path, **changes: Any) -> tuple[Path, dict[str, Any]]:
    """The configuration, with what is changed of it."""
    document = merge(yaml.safe_load(BY_HAND.read_text()), changes)
    path = folder / "by_hand.yaml"
    path.write_text(yaml.safe_dump(document))
    return path, document


@pytest.mark.slow
def test_the_board_calibrates_asks_again_agrees_and_stores(tmp_path: Path) -> None:
    flash = tmp_path / "flash.bin"
    hand = {"mistakes": {"too_fast": 0.2}}
    world = {"time_scale": 20, "hand": hand, "board": {"flash_file": str(flash)}}
    path, document = config_in(tmp_path, sensors={"gyro": {"rate_hz": 119}}, world=world)
    ended = rig("board", "hand", path, "--moves", "8", "--scale-std", "0.002", "--json", "--write", "--yes")
    assert ended.returncode == 0, ended.stderr
    found = json.loads(ended.stdout)
    truth = document["world"]["sensors"]["gyro"]
    assert found["moves"] >= 8
    assert found["matrix_difference"] <= SCALE_LIMIT
    assert np.max(np.abs(np.array(found["scale"]) / truth["scale"] - 1)) < found["expanded_scale"]
    assert np.max(np.abs(np.array(found["bias_rad_s"]) - truth["bias_rad_s"])) < 5e-4
    assert "accepted: from +z to +x" in ended.stderr
    assert "not accepted: clipping" in ended.stderr
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
    assert "first_face_unknown" in ended.stderr


# What the board has found alone


@pytest.fixture(scope="module")
def handled() -> Recorded:
    return handle(TWELVE, 3, rest_s=1.6)


@pytest.fixture
def kept(handled: Recorded) -> HostBoard:
    """A board that was calibrated by its button, without a computer."""
    return run_button_session(handled)


def real_board(folder: Path, port: str, **changes: Any) -> Path:
    """The configuration of a board that is really there."""
    path, document = config_in(folder, board={"port": port}, **changes)
    del document["world"]
    path.write_text(yaml.safe_dump(document))
    return path


@pytest.mark.slow
def test_what_the_button_began_is_fetched_said_to_be_unchecked_and_stored(
    tmp_path: Path, kept: HostBoard, handled: Recorded
) -> None:
    with serve(kept) as port:
        path = real_board(tmp_path, port)
        said = rig_here("board", "hand", path, "--fetch")
        assert said.returncode == 0, said.stderr
        assert "the board's own result" in said.stdout
        stored = rig_here("board", "hand", path, "--fetch", "--json", "--write", "--yes")
        assert stored.returncode == 0, stored.stderr
        found = json.loads(stored.stdout)
        read = json.loads(rig_here("board", "calibration", "read", path, "--json").stdout)["sensors"]["gyro"]
    assert (found["moves"], found["matrix_difference"]) == (12, None)
    assert np.max(np.abs(np.array(found["scale"]) / handled.truth[:3] - 1)) < found["expanded_scale"]
    assert (read["matrix"], read["bias_rad_s"]) == (found["matrix"], found["bias_rad_s"])
    assert (read["serial_number"], read["range_deg_s"]) == ("LSM9DS1-HAND", 500)


@pytest.mark.slow
def test_an_answer_of_another_range_or_sensor_is_refused(tmp_path: Path, kept: HostBoard) -> None:
    with serve(kept) as port:
        wide = rig_here(
            "board", "hand", real_board(tmp_path, port), "--set", "sensors.gyro.range_deg_s=2000", "--fetch"
        )
        other = rig_here("board", "hand", real_board(tmp_path, port), *MPU9250, "--fetch")
    assert (wide.returncode, other.returncode) == (2, 2)
    assert "another_range" in wide.stderr and "another_sensor" in other.stderr


@pytest.mark.slow
@pytest.mark.parametrize(
    ("turned", "why"),
    [
        (lambda whole: first_seconds(whole, 12.0), "not done after"),
        (lambda whole: replace(whole, rates=np.clip(whole.rates, -0.9, 0.9) * 12.0), "ten moves in a row"),
    ],
    ids=["not finished", "given up"],
)
def test_a_board_without_an_answer_says_why(
    tmp_path: Path, handled: Recorded, turned: Callable[[Recorded], Recorded], why: str
) -> None:
    with serve(run_button_session(turned(handled))) as port:
        ended = rig_here("board", "hand", real_board(tmp_path, port), "--fetch")
    assert ended.returncode == 2
    assert "no_answer_by_hand" in ended.stderr and why in " ".join(ended.stderr.split())


@pytest.mark.slow
def test_a_board_that_was_just_switched_on_has_no_answer(tmp_path: Path) -> None:
    with serve(alone()) as port:
        ended = rig_here("board", "hand", real_board(tmp_path, port), "--fetch", "--write", "--yes")
    assert ended.returncode == 2
    assert "no_answer_by_hand" in ended.stderr and "none has been made" in " ".join(ended.stderr.split())


def first_seconds(recorded: Recorded, lasts_s: float) -> Recorded:
    seen = recorded.time_s < lasts_s
    return replace(
        recorded, time_s=recorded.time_s[seen], rates=recorded.rates[seen], acceleration=recorded.acceleration[seen]
    )


def test_nobody_to_agree_is_refused_before_anything_is_done() -> None:
    ended = rig_here("board", "hand", BY_HAND, "--write")
    assert ended.returncode == 2
    assert ended.stderr.startswith("rig: not_confirmed: "), "something was begun before"
