"""A station's parts one after the other in a simulated laboratory."""

import csv
import json
import re
import subprocess
import sys
from pathlib import Path

import pytest

from rig.batch.batch_journal import open_journal
from rig.batch.batch_state import Begun, Chip, PartBegun, PartEnded
from support.laboratories.commands import configuration, rig, wait_for_log
from support.laboratories.worlds import fresh_host
from support.paths import CONFIGS

AT = "2026-11-25T08:00:00+00:00"
CHIP = {"unique_id": "0123456789abcdef01234567"}
TRAY = {"G-003": {"plugged_in": False}, "G-001": CHIP, "G-005": CHIP}
pytestmark = pytest.mark.slow


def rows(folder: Path) -> list[dict[str, str]]:
    with (folder / "batch.csv").open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


def series(folder: Path, *numbers: str) -> Path:
    path = folder / "parts.csv"
    path.write_text("\n".join(("serial_number", *numbers)) + "\n", encoding="utf-8")
    return path


def test_a_series_goes_through_its_list_without_questions(tmp_path: Path) -> None:
    """A part twice, a board that is not plugged in, one chip under two numbers: each is refused by name."""
    few = {"sensors": {"gyro": {"rate_hz": 59.5}}}  # samples are what a laboratory costs
    config, out = configuration(tmp_path, few | {"world": {"tray": TRAY}}), tmp_path / "batch"
    parts = series(tmp_path, "G-003", "G-001", "G-001", "G-005")
    done = rig("station", config, "--series", parts, "--out", out, "--operator", "A. Person", "--work-order", "W-17")
    assert done.returncode == 1, done.stderr + done.stdout
    found = rows(out)
    assert [each["verdict"] for each in found] == ["refused", "pass", "refused", "refused"]
    whys = [each["why"].split(":")[0] for each in found]
    assert whys == ["no_port", "", "G-001 is done", "same_chip"]
    result = json.loads((out / found[1]["folder"] / "result.json").read_text(encoding="utf-8"))
    assert result["gyroscopes"]["gyro"]["serial_number"] == "G-001"
    assert found[1]["certificate"] in (out / found[1]["folder"] / "certificate.html").read_text(encoding="utf-8")
    assert found[1]["certificate"] in (out / "labels" / "02-G-001.txt").read_text(encoding="utf-8")
    assert {path.name for path in out.glob("0*")} == {"02-G-001"}  # nothing was measured of the others
    assert len(re.findall("simulated truth: [4-6] of 6 values within U of it", done.stdout)) == 1
    assert re.search("simulated truth: [4-6] of 6 values within U of it", rig("show", out / found[1]["folder"]).stdout)
    assert not (out / "truth.json").exists()
    assert "A. Person" in (out / "batch.html").read_text(encoding="utf-8")


def at_another_address(name: str) -> list[str]:
    """Return the words that give a configuration, its tray with one board for all numbers and an address of its own."""
    changes = {
        "board.port": f"socket://{(host := fresh_host())}:7321",
        "world.tray": json.dumps({"G-2": CHIP, "G-3": CHIP}),
    }
    if name == "servo.yaml":
        changes["turner.port"] = f"socket://{host}:7323"
    return [str(CONFIGS / name), *(word for key, value in changes.items() for word in ("--set", f"{key}={value}"))]


@pytest.mark.thorough
def test_a_simulated_hand_turns_each_part_and_the_same_board_is_refused_under_another_number(tmp_path: Path) -> None:
    out, short = tmp_path / "batch", ["--set", "procedure.flips=8", "--set", "procedure.turns=0"]
    parts = series(tmp_path, "G-2", "G-3")
    done = rig("station", *at_another_address("by_hand.yaml"), *short, "--series", parts, "--out", out)
    assert done.returncode == 1, done.stderr + done.stdout
    assert [row["verdict"] for row in rows(out)][1] == "refused" and rows(out)[1]["why"].startswith("same_chip")
    assert rows(out)[0]["verdict"] in ("pass", "fail"), rows(out)  # a session this short may miss its limits


@pytest.mark.parametrize("name", ["by_hand.yaml", "servo.yaml"])
def test_whatever_turns_it_the_same_board_is_refused_under_another_number(name: str, tmp_path: Path) -> None:
    """A hand is asked nothing before it begins; a servo's mounting is asked about before anything is connected."""
    journal = open_journal(tmp_path / "batch", tmp_path, Begun("", "", AT, simulated=True))
    journal.enter(PartBegun("G-2", "01-G-2", AT))
    journal.enter(PartEnded("pass", AT, chip=Chip(CHIP["unique_id"], (0x68,))))
    parts = series(tmp_path, "G-2", "G-3")
    done = rig("station", *at_another_address(name), "--series", parts, "--out", journal.folder)
    assert done.returncode == 1, done.stderr + done.stdout
    assert [row["why"].split(":")[0] for row in rows(journal.folder)] == ["", "same_chip"]


@pytest.mark.thorough
def test_after_a_kill_the_same_command_goes_on_with_the_part_in_hand(tmp_path: Path) -> None:
    config, out = configuration(tmp_path), tmp_path / "batch"
    command: list[str | Path] = ["station", config, "--series", series(tmp_path, "G-001", "G-002"), "--out", out]
    begun = subprocess.Popen(
        [sys.executable, "-m", "rig", *map(str, command)], stderr=subprocess.DEVNULL, stdout=subprocess.DEVNULL
    )
    try:
        wait_for_log(out / "01-G-001", "done: sweep wrist_3 ccw")
    finally:
        begun.kill()
        begun.wait()
    done = rig(*command)
    assert done.returncode == 0, done.stderr + done.stdout
    assert [(row["serial_number"], row["verdict"]) for row in rows(out)] == [("G-001", "pass"), ("G-002", "pass")]
    assert len(list((out / "01-G-001").glob("run*.h5"))) == 2  # what was recorded before the kill counts
    # … and is of another laboratory's clock.
    assert [(out / name / "truth.json").exists() for name in ("01-G-001", "02-G-002")] == [False, True]

    # A kill between the result and its entry: the part is not run again.
    journal = out / "batch.jsonl"
    journal.write_text("".join(journal.read_text(encoding="utf-8").splitlines(keepends=True)[:-2]), encoding="utf-8")
    done = rig(*command)
    assert done.returncode == 0, done.stderr + done.stdout
    assert [row["verdict"] for row in rows(out)] == ["pass", "pass"]
    assert "sampling" not in done.stderr
