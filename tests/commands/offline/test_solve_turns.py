"""`rig solve SAMPLES.csv --turns`: any IMU that can log, turned by hand on a table."""

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from rig.cli import main
from rig.observation.by_hand.hand_segmentation import segment_session
from support.external.handled_body import TWELVE, creeping, handle, write
from support.external.real import unpack

pytestmark = pytest.mark.slow

CLOCK = ("--turns", "--clock-ppm", "50")


def solved(capsys: pytest.CaptureFixture[str], *arguments: object) -> dict[str, Any]:
    assert main(["solve", *map(str, arguments), "--json"]) == 0
    found: dict[str, Any] = json.loads(capsys.readouterr().out)["gyroscopes"]["imu"]
    return found


def refused(capsys: pytest.CaptureFixture[str], *arguments: object) -> str:
    assert main(["solve", *map(str, arguments)]) == 2
    return " ".join(capsys.readouterr().err.split())


def expanded(found: dict[str, Any]) -> Any:
    return 2 * np.sqrt(np.diag(found["covariance_combined"]))[:3]


def test_a_recording_by_hand_reaches_every_outlet(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    recorded = handle(TWELVE, 1)
    samples, folder = write(tmp_path / "samples.csv", recorded), tmp_path / "run"
    found = solved(capsys, samples, *CLOCK)
    assert (np.abs(np.array(found["scale"]) - recorded.truth[:3]) < expanded(found)).all()
    assert (found["estimator"], len(found["by_hand"]["rests"])) == ("by_hand", 13)
    lines = {line["name"] for line in found["budget"]["contributors"]}
    assert {"placement", "clock", "noise", "bias from rest to rest", "nonlinearity"} <= lines
    kept = ("--out", folder, "--serial-number", "H1", "--history", tmp_path / "history.db")
    assert main(["solve", *map(str, (samples, *CLOCK, *kept))]) == 0
    assert "± U, about 95 %" in capsys.readouterr().out
    again = json.loads((folder / "result.json").read_text(encoding="utf-8"))["gyroscopes"]["imu"]
    assert again["scale"] == found["scale"]
    words = " ".join(re.sub("<[^>]*>", " ", (folder / "certificate.html").read_text(encoding="utf-8")).split())
    assert "By hand: the item was turned on a flat table" in words and "recordings of real hands" in words
    assert main(["solve", str(folder), "--all"]) == 0
    assert "by hand: 13 rests, 12 flips, 0 turns" in " ".join(capsys.readouterr().out.split())


def test_a_rest_that_creeps_is_counted_with_its_time(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    recorded = handle(TWELVE, 1)
    rest = segment_session(recorded.time_s, recorded.rates, recorded.acceleration).rests[5]
    crept = creeping(recorded, rest.start_s - 0.1, rest.end_s + 0.1, np.radians([0.1, -0.1, 0.05]))
    assert main(["solve", str(write(tmp_path / "samples.csv", crept)), *CLOCK]) == 0
    words = " ".join(capsys.readouterr().out.split())
    assert "left out: 1 of 13 rests, bias_jumped: the body crept" in words
    told = re.search(r"the first from (\S+) to (\S+) s", words)
    assert told is not None
    assert [float(group) for group in told.groups()] == pytest.approx([rest.start_s, rest.end_s], abs=0.3)


def test_what_no_reading_shows_must_be_stated(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    samples = write(tmp_path / "samples.csv", handle(TWELVE, 1), level=False)
    assert "clock_unknown" in refused(capsys, samples, "--turns")
    assert "first_face_unknown" in refused(capsys, samples, *CLOCK)
    assert "bad_option" in refused(capsys, samples, "--turns", "--clock-ppm", "-1")
    assert "wrong_face" in refused(capsys, samples, *CLOCK, "--first-face=-y")
    found = solved(capsys, samples, *CLOCK, "--first-face", "+z")
    assert "level_m_s2" not in {size["name"] for size in found["by_hand"]["errors"]}


def test_a_real_session_tells_its_own_accuracy(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Its README: turns alone and flips alone disagree by 2e-3."""
    found = solved(capsys, unpack("imucal", "samples.csv", tmp_path), *CLOCK)
    for one_way in ([0.9728, 1.0179, 1.0017], [0.9744, 1.0166, 1.0036]):
        assert (np.abs(np.array(found["scale"]) - one_way) < 2e-3).all()
    assert (expanded(found) > 1e-3).all() and (expanded(found) < 4e-3).all()
    by_hand = found["by_hand"]
    assert (len(by_hand["rests"]), sum(move["turns"] == -1 for move in by_hand["moves"])) == (13, 3)
    assert {rest["face"] for rest in by_hand["rests"]} == {"+x", "-x", "+y", "-y", "+z", "-z"}


def test_halves_of_a_real_session_agree(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """An MPU-9150 laid down in attitudes that nobody knows, and often held in the hand.

    In the first half a hand held it that shook: where its blocks begin moves the scale factors by half of U.
    """
    log = np.loadtxt(unpack("mikoff", "imu0.log", tmp_path))
    time_s = np.arange(len(log)) / 100.0
    names = "time_s,x_rad_s,y_rad_s,z_rad_s,x_m_s2,y_m_s2,z_m_s2"
    halves = []
    for number, rows in enumerate(np.array_split(np.arange(len(log)), 2)):
        half = tmp_path / f"{number}.csv"
        table = np.column_stack([time_s[rows], log[rows, 3:], log[rows, :3]])
        np.savetxt(half, table, delimiter=",", header=names, comments="")
        halves.append(solved(capsys, half, *CLOCK))
    first, second = (np.array(half["scale"]) for half in halves)
    known = np.hypot(*(expanded(half) for half in halves))
    assert (np.abs(first - second) < 1.5 * known).all()
    assert (expanded(halves[1]) < 5e-3).all()
