"""`rig allan`: tables, JSON and plots from a run file."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from rig.cli import main
from rig.data.recording.layout import Contents, lay_out
from rig.data.recording.layout_keys import EVENTS_DTYPE, SCHEMA
from rig.data.recording.recorded_events import encode_event
from rig.data.recording.run_data import RunData
from support.external.real import unpack
from support.laboratories.commands import rig_here
from support.recordings.synthetic_run import UR, Setup, synthetic_run


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("recorded") / "run.h5"
    write(synthetic_run(Setup(rest_s=20.0, speed_deg_s=150)), path)
    return path


def write(run: RunData, path: Path) -> None:
    """The file of a recording that was computed."""

    texts = {
        "config": run.config,
        "settings": run.settings.to_json(),
        "provenance": json.dumps(run.provenance.document()),
        "turner": UR.to_json(),
    }
    events = np.frombuffer(b"".join(map(encode_event, run.events)), EVENTS_DTYPE)
    described = {name: sensor.attributes() for name, sensor in run.sensors.items()}
    lay_out(path, Contents(SCHEMA, texts, described, run.samples, run.states, events), swmr=False)


@pytest.mark.slow
def test_people_see_random_walk_and_why_there_is_no_bias_instability(
    run: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["allan", str(run)]) == 0
    printed = capsys.readouterr().out
    assert "angle random walk °/√h" in printed and "6 intervals at rest" in printed
    assert printed.count("recording_too_short") == 1, "once for all axes"
    assert "bias instability: recording_too_short" in printed and "Record at rest for 600 s or more" in printed


@pytest.mark.slow
def test_machines_get_the_curves_in_si_units(run: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["allan", str(run), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)
    gyro = found["sensors"]["gyro"]["rate"]
    assert found["schema"] == "rig.allan/1" and len(gyro["deviation_rad_s"]) == len(gyro["tau_s"])
    for walk in gyro["random_walk_rad_sqrt_s"]:
        assert walk["value"] == pytest.approx(0.035 / 238**0.5, abs=4 * walk["std"])


@pytest.mark.slow
def test_curves_are_drawn_where_one_wants_them(run: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["allan", str(run), "--plot", str(tmp_path / "plots")]) == 0
    for suffix in (".png", ".svg"):
        assert (tmp_path / "plots" / f"allan_gyro{suffix}").stat().st_size > 10_000
    assert "allan_gyro.png" in capsys.readouterr().err


def test_corrected_readings_are_refused(run: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    made = synthetic_run(Setup(rest_s=1.0, speed_deg_s=150))
    corrected = {name: replace(sensor, mode="calibrated") for name, sensor in made.sensors.items()}
    write(replace(made, sensors=corrected), tmp_path / "run.h5")
    assert main(["allan", str(tmp_path / "run.h5")]) == 2
    assert "no_raw_readings" in capsys.readouterr().err


def log(path: Path, columns: dict[str, np.ndarray]) -> Path:
    rows = np.column_stack(list(columns.values()))
    np.savetxt(path, rows, fmt="%.9g", delimiter=",", header=",".join(columns), comments="")
    return path


@pytest.fixture(scope="module")
def still() -> dict[str, np.ndarray]:
    """Ten minutes of a noisy part that lies still, whose bias wanders and whose package warms up."""
    rng, time_s = np.random.default_rng(5), np.arange(0, 600, 1 / 100)
    walk = np.cumsum(rng.normal(0, 2e-5, (len(time_s), 3)), axis=0)
    rate = 0.03 + walk + 5e-6 * time_s[:, None] + rng.normal(0, 0.035, (len(time_s), 3))
    force = np.array([0.1, -0.2, 9.81]) + rng.normal(0, 0.02, (len(time_s), 3))
    named = {f"{axis}_rad_s": rate[:, i] for i, axis in enumerate("xyz")}
    return {"time_s": time_s, **named, **{f"{axis}_m_s2": force[:, i] for i, axis in enumerate("xyz")}}


@pytest.mark.slow
def test_a_log_made_elsewhere_tells_the_noise_of_its_sensors(
    still: dict[str, np.ndarray], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["allan", str(log(tmp_path / "desk.csv", still)), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)["sensors"]["desk"]
    for quantity, unit, noise in (("rate", "rad_sqrt_s", 0.035), ("acceleration", "m_s_sqrt_s", 0.02)):
        for walk in found[quantity][f"random_walk_{unit}"]:
            assert walk["value"] == pytest.approx(noise / 10, abs=4 * walk["std"])
    assert main(["allan", str(tmp_path / "desk.csv")]) == 0
    assert "desk, acceleration" in capsys.readouterr().out


@pytest.mark.slow
def test_a_log_with_a_gap_is_two_stretches(
    still: dict[str, np.ndarray], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    kept = np.abs(still["time_s"] - 200) > 5
    path = log(tmp_path / "desk.csv", {name: column[kept] for name, column in still.items()})
    assert main(["allan", str(path)]) == 0
    assert "2 intervals at rest" in capsys.readouterr().out


@pytest.mark.one_in(2)  # the slower turn is the one that is hard to see
@pytest.mark.slow
@pytest.mark.parametrize("turn_deg", [1.0, 90.0])
def test_a_log_in_which_the_sensor_was_turned_is_refused(
    still: dict[str, np.ndarray], tmp_path: Path, capsys: pytest.CaptureFixture[str], turn_deg: float
) -> None:
    turned = {name: column.copy() for name, column in still.items()}
    turning = np.abs(still["time_s"] - 300) < 0.5
    turned["y_rad_s"][turning] += np.radians(turn_deg)
    turned["x_m_s2"][still["time_s"] > 300] += 9.81 * np.sin(np.radians(turn_deg))
    assert main(["allan", str(log(tmp_path / "hand.csv", turned))]) == 2
    assert "rig: not_at_rest: about 2" in (said := capsys.readouterr().err) or "rig: not_at_rest: about 30" in said


@pytest.mark.slow
@pytest.mark.parametrize("name", ["imucal", "broad"])
def test_a_body_that_a_hand_moved_was_not_at_rest(
    name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["allan", str(unpack(name, "samples.csv", tmp_path))]) == 2
    assert "rig: not_at_rest: " in capsys.readouterr().err


def test_the_still_part_of_a_recording_by_hand_has_a_curve(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    lines = unpack("imucal", "samples.csv", tmp_path).read_text(encoding="utf-8").splitlines()
    held = [line for line in lines[1:] if 5.5 < float(line.partition(",")[0]) < 12.2]
    (tmp_path / "held.csv").write_text("\n".join([lines[0], *held]) + "\n", encoding="utf-8")
    assert main(["allan", str(tmp_path / "held.csv"), "--json"]) == 0
    assert len(json.loads(capsys.readouterr().out)["sensors"]["held"]["rate"]["tau_s"]) > 5


@pytest.mark.slow
def test_what_rig_record_wrote_of_several_sensors_is_taken_as_it_lies(
    still: dict[str, np.ndarray], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    for name in ("desk", "shelf"):
        log(tmp_path / f"{name}.csv", still)
    assert main(["allan", str(tmp_path), "--json"]) == 0
    assert list(json.loads(capsys.readouterr().out)["sensors"]) == ["desk", "shelf"]


def test_a_minute_too_few_is_told_in_seconds(still: dict[str, np.ndarray], tmp_path: Path) -> None:
    begun = {name: column[:1200] for name, column in still.items()}
    done = rig_here("allan", log(tmp_path / "desk.csv", begun))
    assert done.returncode == 0
    assert done.stdout.count("random walk: recording_too_short") == 2, "of each quantity once"
    assert "Record at rest for 4" in done.stdout, done
