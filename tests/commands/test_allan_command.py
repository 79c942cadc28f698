"""`rig allan`: tables, JSON and plots from a run file."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from rig.cli import main
from rig.data.events import to_line
from rig.data.layout import EVENTS_DTYPE, SCHEMA, Contents, lay_out
from rig.data.run_file import RunData
from support.synthetic_run import Setup, synthetic_run


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
    }
    events = np.frombuffer(b"".join(map(to_line, run.events)), EVENTS_DTYPE)
    described = {name: sensor.attributes() for name, sensor in run.sensors.items()}
    lay_out(path, Contents(SCHEMA, texts, described, run.samples, run.arm, events), swmr=False)


def test_people_see_random_walk_and_why_there_is_no_bias_instability(
    run: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["allan", str(run)]) == 0
    printed = capsys.readouterr().out
    assert "angle random walk °/√h" in printed and "6 stretches at rest" in printed
    assert "bias instability: recording_too_short" in printed


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
