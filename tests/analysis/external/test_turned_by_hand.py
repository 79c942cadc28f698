"""`rig solve --sweeps` of turns from rest to rest: solved by how far the body turned, whatever its speed was."""

import json
import re
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from rig.analysis.external.external_recordings import solve_swept
from rig.cli import main
from rig.errors import Fault, Refused, or_fault
from rig.estimation.arrays import Array
from rig.estimation.gyroscope.estimate import Estimate
from support.external.real import recording, unpack
from support.external.sweeps_as_files import average_files
from support.external.turned_body import Hand, Session, turn, write

THREE = np.eye(3)
BOTH_WAYS = np.vstack([np.eye(3), -np.eye(3)])
QUARTERS = np.repeat(np.eye(3), 4, axis=0)
HANDS = {
    "a whole turn about each axis": Hand(THREE),
    "there and back": Hand(BOTH_WAYS),
    "in quarters": Hand(QUARTERS, angle_rad=np.pi / 2, pushes=1),
    "a noisy gyroscope": Hand(BOTH_WAYS, noise_rad_s=0.02),
}


def solved(folder: Path, session: Session) -> Estimate:
    return solve_swept(average_files(*write(folder, session)), None)


def off(found: Estimate, session: Session) -> Array:
    """(6,) errors of scale and bias in standard uncertainties."""
    truth = np.concatenate([1 / np.linalg.norm(session.matrix, axis=1), -session.bias])
    errors: Array = (np.concatenate([found.scale, found.bias_rad_s]) - truth) / np.sqrt(np.diag(found.covariance))
    return errors


def document(capsys: pytest.CaptureFixture[str], *arguments: object) -> dict[str, Any]:
    assert main(["solve", *map(str, arguments), "--json"]) == 0
    found: dict[str, Any] = json.loads(capsys.readouterr().out)["gyroscopes"]["imu"]
    return found


@pytest.mark.slow
def test_a_hands_turns_tell_the_scale_to_a_thousandth(tmp_path: Path) -> None:
    session = turn(Hand(BOTH_WAYS), 1)
    found = solved(tmp_path, session)
    std = np.sqrt(np.diag(found.covariance))
    assert (np.abs(off(found, session)) < 3.5).all()
    assert (std[:3] < 1.5e-3).all() and (std[3:] < 3e-4).all()


@pytest.mark.thorough
@pytest.mark.slow
@pytest.mark.one_in(2)
@pytest.mark.proof
@pytest.mark.parametrize("hand", HANDS.values(), ids=HANDS)
def test_uncertainties_are_those_of_many_sessions(tmp_path: Path, hand: Hand, thorough: bool) -> None:
    """At a noise of 1 °/s the scatter of rests may look like a change of the bias; few sound sessions are refused."""
    sessions = [turn(hand, seed) for seed in range(200 if thorough else 20)]
    results = [(or_fault(partial(solved, tmp_path, session)), session) for session in sessions]
    refused = [result.name for result, _ in results if isinstance(result, Fault)]
    assert len(refused) <= 0.02 * len(sessions) and {*refused} <= {"bias_jumped"}
    errors = np.array([off(result, session) for result, session in results if not isinstance(result, Fault)])
    for name, each in (("scale", errors[:, :3]), ("bias", errors[:, 3:])):
        rms, within = float(np.sqrt(np.mean(each**2))), float(np.mean(np.abs(each) < 2))
        print(f"{name}: RMS of error / u {rms:.2f}, {100 * within:.1f} % within U")
        assert (0.8 if thorough else 0.6) < rms < (1.2 if thorough else 1.4)
        assert (0.93 if thorough else 0.87) < within


@pytest.mark.slow
def test_real_turns_by_hand_tell_as_much_as_they_can(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """A foot-sized IMU against a box: its turns and its flips disagree by 2e-3, says its README."""
    monkeypatch.setenv("COLUMNS", "200")
    files = unpack("imucal", "samples.csv", tmp_path), "--sweeps", recording("imucal") / "sweeps.csv"
    found = document(capsys, *files)
    expanded = 2 * np.sqrt(np.diag(found["covariance"]))[:3]
    assert (np.abs(np.array(found["scale"]) - [0.9728, 1.0179, 1.0017]) < 0.5 * expanded).all()
    assert (expanded > 1e-3).all() and (expanded < 5e-3).all()
    assert (found["estimator"], found["by_angles"]["rows"]) == ("increments", [7, 8, 9])
    dof = {line["name"]: line["degrees_of_freedom"] for line in found["budget"]["contributors"] if line["kind"] == "A"}
    assert dof["bias from rest to rest"] >= 3 and dof["noise"] > 1000
    assert main(["solve", *map(str, files), "--estimator", "vector"]) == 1
    assert "FAILED imu.scale_std" in capsys.readouterr().out, "mean rates say less than a calibration needs"
    assert main(["solve", *map(str, files), "--all"]) == 0
    said = " ".join(capsys.readouterr().out.split())
    assert "by the angle turned from rest to rest: 3 of 3 sweeps (rows 7, 8, 9)" in said
    assert "ends of the turns" in said and "axes of the turns" in said


@pytest.mark.slow
def test_what_is_said_of_a_turn_counts(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A servo comes back to its mark; the scale is then as well known as its noise lets it be."""
    session = turn(Hand(BOTH_WAYS, ends_rad=1e-4, leans_rad=1e-3), 2)
    samples, sweeps = write(tmp_path, session)
    lines = sweeps.read_text(encoding="utf-8").splitlines()
    stated = [f"{lines[0]},angle_std_rad,axis_std_rad", *(f"{line},1e-4,1e-3" for line in lines[1:])]
    sweeps.write_text("\n".join(stated) + "\n", encoding="utf-8")
    found = document(capsys, samples, "--sweeps", sweeps)
    std = np.sqrt(np.diag(found["covariance"]))[:3]
    truth = 1 / np.linalg.norm(session.matrix, axis=1)
    assert (std < 1e-4).all() and (np.abs(np.array(found["scale"]) - truth) < 3.5 * std).all()
    sweeps.write_text("\n".join([stated[0], *(f"{line},0,1e-3" for line in lines[1:])]) + "\n", encoding="utf-8")
    assert main(["solve", str(samples), "--sweeps", str(sweeps)]) == 2
    assert "bad_sweep" in capsys.readouterr().err


@pytest.mark.slow
def test_a_turn_that_was_another_is_named(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    session = turn(Hand(BOTH_WAYS), 3)
    session.rows[3, 5] -= 0.3  # said to be 17° less than it was
    samples, sweeps = write(tmp_path, session)
    assert main(["solve", str(samples), "--sweeps", str(sweeps)]) == 2
    named = re.search(r"turn_not_closed: .* from ([\d.]+) to", capsys.readouterr().err)
    assert named is not None
    assert min(abs(float(named[1]) - session.rows[row, 0]) for row in (3, 9)) < 0.5, "it, or its way back"


@pytest.mark.slow
@pytest.mark.parametrize("stated", [2, 0.5, 350 / 360])
def test_a_turn_that_ends_alike_or_nearly_so_is_another(stated: float, tmp_path: Path) -> None:
    session = turn(Hand(BOTH_WAYS), 3)
    session.rows[3, 5] *= stated
    with pytest.raises(Fault, match="turn_not_closed"):
        solved(tmp_path, session)


@pytest.mark.slow
def test_one_wrong_angle_of_many_turns_widens_the_uncertainty(tmp_path: Path) -> None:
    session = turn(Hand(BOTH_WAYS, ends_rad=1e-3, leans_rad=1e-3), 3)
    session.rows[5, 5] += np.radians(2)
    assert np.abs(off(solved(tmp_path, session), session)).max() < 2.5


def test_exchanged_axes_of_two_turns_are_no_stuck_axis(tmp_path: Path) -> None:
    session = turn(Hand(BOTH_WAYS), 3)
    session.rows[[1, 3], 2:5] = session.rows[[3, 1], 2:5]
    with pytest.raises(Refused, match="bad_sweep: sweeps 2 and 10 state the same axis"):
        solved(tmp_path, session)


@pytest.mark.slow
def test_a_sweep_at_constant_speed_stays_a_mean(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A row cut out of a longer turn says nothing of where the body began and ended."""
    session = turn(Hand(BOTH_WAYS, pushes=1), 4)
    rates = (session.readings - session.bias) @ np.linalg.inv(session.matrix).T
    rows = session.rows.copy()
    for row in rows:
        if row[5]:
            row[:2] = row[:2].mean() + np.array([-0.1, 0.1]) * np.ptp(row[:2])
            inside = (session.time_s >= row[0]) & (session.time_s < row[1])
            row[5] = np.linalg.norm(rates[inside].mean(axis=0)) * np.ptp(row[:2])
    samples, sweeps = write(tmp_path, replace(session, rows=rows))
    found = document(capsys, samples, "--sweeps", sweeps)
    assert (found["estimator"], found["by_angles"], len(found["observations"])) == ("vector", None, 6)
    assert main(["solve", str(samples), "--sweeps", str(sweeps), "--estimator", "increments"]) == 2
    assert "no_turns" in capsys.readouterr().err


def test_turns_about_two_axes_do_not_tell_the_third(tmp_path: Path) -> None:
    with pytest.raises(Fault, match="rank_deficient"):
        solved(tmp_path, turn(Hand(BOTH_WAYS[[0, 1, 3, 4]]), 5))


@pytest.mark.slow
def test_turns_stated_a_second_late_do_not_pass(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """All turns are there, at times when the body did something else: U of a scale factor is about 1."""
    samples, sweeps = write(tmp_path, turn(Hand(BOTH_WAYS), 1))
    header, *rows = (line.split(",") for line in sweeps.read_text(encoding="utf-8").splitlines())
    late = [[str(float(start) + 1), str(float(end) + 1), *rest] for start, end, *rest in rows[:-3]]
    sweeps.write_text("\n".join(map(",".join, [header, *late])), encoding="utf-8")
    assert main(["solve", str(samples), "--sweeps", str(sweeps)]) == 1
    assert "FAILED imu.scale_std" in capsys.readouterr().out
