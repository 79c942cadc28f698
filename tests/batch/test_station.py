"""A station's parts one after the other in a simulated laboratory."""

import csv
import json
import re
import subprocess
import sys
from pathlib import Path

import pytest

from support.laboratories.commands import configuration, rig, wait_for_log

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
    config, out = configuration(tmp_path, {"world": {"tray": TRAY}}), tmp_path / "batch"
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
