"""A kind of sensor that a package adds, a two-axis inclinometer, stands in every outlet without a line of the rig's."""

import json
import os
import subprocess
import sys
from html import unescape
from pathlib import Path

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from support.paths import ROOT
from support.processes.waiting import PATIENCE_S

pytestmark = pytest.mark.slow

SCALE, BIAS_RAD = (1.02, 0.97), (0.004, -0.007)
# One process for all commands: each would take a second to import the same. What they print, then what Python has.
IN_TURN = """
import io, json, sys
from contextlib import redirect_stdout
import rig
from rig.cli import main
from rig.page.rows import parameter_rows
run, *commands = json.loads(sys.argv[1])
printed = []
for command in commands:
    with redirect_stdout(io.StringIO()) as output:
        assert main(command) == 0, command
    printed.append(output.getvalue())
result = rig.solve(rig.load(run))
rows = parameter_rows(result.document)
print(json.dumps([*printed, result["imu"].scale.tolist(), result["imu"].bias.tolist(), rows]))
"""


def files(folder: Path) -> list[str]:
    """A body laid down in twelve attitudes, three seconds each, with an inclinometer on it."""
    noise = np.random.default_rng(4)
    attitudes = Rotation.from_rotvec(noise.uniform(-0.5, 0.5, (12, 3)))
    samples, rows = ["time_s,x_rad,y_rad"], ["start_s,end_s,qw,qx,qy,qz"]
    for number, attitude in enumerate(attitudes):
        rise = np.arcsin(attitude.inv().apply([0, 0, 1])[:2])
        for tick in range(300):
            x, y = rise / SCALE + BIAS_RAD + noise.normal(0, 2e-4, 2)
            samples.append(f"{4 * number + tick / 100:.2f},{x:.7f},{y:.7f}")
        x, y, z, w = attitude.as_quat()
        rows.append(f"{4 * number},{4 * number + 3},{w:.9f},{x:.9f},{y:.9f},{z:.9f}")
    for name, lines in (("samples", samples), ("attitudes", rows)):
        (folder / f"{name}.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    return [str(folder / "samples.csv"), "--attitudes", str(folder / "attitudes.csv")]


@pytest.fixture(scope="module")
def installed(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """The environment of somebody who has installed the package."""
    folder = tmp_path_factory.mktemp("site")
    package = folder / "inclinometer-1.dist-info"
    package.mkdir()
    (package / "METADATA").write_text("Metadata-Version: 2.1\nName: inclinometer\nVersion: 1\n", encoding="utf-8")
    entry = "[rig.kinds]\ninclinometer = support.extensions.inclinometer:KIND\n"
    (package / "entry_points.txt").write_text(entry, encoding="utf-8")
    path = os.pathsep.join([str(folder), str(ROOT / "tests"), os.environ.get("PYTHONPATH", "")])
    return {**os.environ, "PYTHONPATH": path}


def ran(environment: dict[str, str], *command: str) -> str:
    done = subprocess.run(
        [sys.executable, *command],
        capture_output=True,
        text=True,
        timeout=PATIENCE_S,
        check=False,
        cwd=ROOT,
        env=environment,
    )
    assert done.returncode == 0, done.stderr
    return done.stdout


def test_an_inclinometer_of_somebodys_package_is_shown_everywhere(tmp_path: Path, installed: dict[str, str]) -> None:
    run, history = str(tmp_path / "run"), str(tmp_path / "history.sqlite")
    keeping = ["--out", run, "--history", history, "--serial-number", "I-1", "--part", "tilt2"]
    commands = (
        ["solve", *files(tmp_path), *keeping],
        ["show", run, "--all"],
        ["explain", "imu.inclination_residuals"],
        ["report", run, "--dcc", "--set", "site.country=DE", "--history", history],
        ["history", "list", "--history", history],
    )
    solved, whole, explained, _, listed, scale, bias, rows = json.loads(
        ran(installed, "-c", IN_TURN, json.dumps([run, *commands]))
    )
    assert solved.startswith("inclinometer imu I-1, tilt2") and solved.splitlines()[-1] == "verdict: PASS"
    assert "imu: inclinometer, m = φ / k + b" in whole and "inclination_residuals" in whole
    assert explained.startswith("residuals: a check of the ")
    result = json.loads((tmp_path / "run" / "result.json").read_text(encoding="utf-8"))
    entry = result["others"]["inclinometers"]["imu"]
    std = np.sqrt(np.diag(entry["covariance"]))
    assert (np.abs(np.array(entry["scale"] + entry["bias_rad"]) - [*SCALE, *BIAS_RAD]) < 4 * std).all()
    assert (std < 1e-4).all()
    page = (tmp_path / "run" / "certificate.html").read_text(encoding="utf-8")
    assert "Inclinometer TILT2, serial number I-1" in page
    assert "imu_inclination_scale[2]" in (tmp_path / "run" / "calibration.h").read_text(encoding="utf-8")
    assert "calibration of inclinometer" in (tmp_path / "run" / "certificate.xml").read_text(encoding="utf-8")
    assert "the only standard of an inclinometer's scale" in unescape(page) and "NOT A CERT" not in page.upper()
    assert "inclination" in listed
    assert (scale, bias) == (entry["scale"], entry["bias_rad"])
    assert rows[0]["sensor"] == "imu, inclinometer" and rows[0]["unit"] == "mrad" and len(rows[0]["bias"]) == 2


@pytest.mark.thorough
def test_a_certificate_is_none_where_a_package_knows_the_noise_alone(tmp_path: Path, installed: dict[str, str]) -> None:
    run = tmp_path / "run"
    ran(installed, "-m", "rig", "solve", *files(tmp_path), "--out", str(run))
    result = json.loads((run / "result.json").read_text(encoding="utf-8"))
    result["others"]["inclinometers"]["imu"]["covariance_combined"] = None
    (run / "result.json").write_text(json.dumps(result), encoding="utf-8")
    done = subprocess.run(
        [sys.executable, "-m", "rig", "report", str(run), "--dcc", "--set", "site.country=DE"],
        capture_output=True, text=True, timeout=PATIENCE_S, check=False, cwd=ROOT, env=installed,
    )  # fmt: skip
    assert done.returncode == 2 and "no_digital_certificate" in done.stderr, done.stderr
    ran(installed, "-m", "rig", "report", str(run))
    page = (run / "certificate.html").read_text(encoding="utf-8")
    assert "Not a certificate: the uncertainty is not known" in page and "Calibration record" in page


@pytest.mark.thorough
def test_without_the_package_its_result_is_left_alone(tmp_path: Path, installed: dict[str, str]) -> None:
    run = str(tmp_path / "run")
    ran(installed, "-m", "rig", "solve", *files(tmp_path), "--out", run)
    without = {**installed, "PYTHONPATH": os.environ.get("PYTHONPATH", "")}
    ran(without, "-m", "rig", "report", run)
    done = subprocess.run(
        [sys.executable, "-m", "rig", "solve", run],
        capture_output=True, text=True, timeout=PATIENCE_S, check=False, cwd=ROOT, env=without,
    )  # fmt: skip
    assert done.returncode == 2 and "not_a_run_file" in done.stderr, done.stderr


@pytest.mark.thorough
def test_an_inclinometer_on_the_arm_is_solved_from_the_dwells(tmp_path: Path, installed: dict[str, str]) -> None:
    """Beside a gyroscope and its accelerometer, as a source with a channel of its own would record it."""
    ran(installed, "-m", "support.extensions.inclined_run", str(tmp_path))
    result = json.loads(ran(installed, "-m", "rig", "solve", str(tmp_path), "--json"))
    entry = result["others"]["inclinometers"]["tilt"]
    std = np.sqrt(np.diag(entry["covariance"]))
    assert (np.abs(np.array(entry["scale"] + entry["bias_rad"]) - [*SCALE, *BIAS_RAD]) < 5 * std + 1e-4).all()
    assert entry["part"] == "tilt2" and {"gyro"} == set(result["accelerometers"])
    checks = {check["name"]: check["passed"] for check in result["checks"]}
    assert checks["tilt.inclination_residuals"]
    ran(installed, "-m", "rig", "export", str(tmp_path), "--format", "csv", "--out", str(tmp_path / "csv"))
    header, *rows = (tmp_path / "csv" / "tilt.csv").read_text(encoding="utf-8").splitlines()
    assert header == "time_s,x_rad,y_rad" and len(rows) > 1000
