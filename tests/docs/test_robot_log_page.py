"""What the page "From a robot's log" shows can be typed, in its order, and its table has the figures of its log."""

import re
import shlex
from pathlib import Path

import numpy as np
import pytest

import rig
from support.external.robot_log import RobotLog, make_log, orientation_errors_deg, write_log
from support.laboratories.commands import rig_here
from support.paths import DOCS

pytestmark = pytest.mark.slow

PAGE = (DOCS / "how-to" / "without-an-arm" / "from-a-robots-log.md").read_text(encoding="utf-8")
BLOCKS = re.findall(r"^```(\w*)\n(.*?)^```$", PAGE, re.M | re.S)
COMMANDS = [line for language, block in BLOCKS if not language for line in block.splitlines()]
LOGS = range(1, 11)


def shown(wanted: str) -> str:
    """The page's one block of code in a language."""
    (block,) = (block for language, block in BLOCKS if language == wanted)
    return str(block)


def test_the_example_is_what_its_script_makes(tmp_path: Path) -> None:
    write_log(make_log(), tmp_path)
    for name in ("robot_log.txt", "robot_poses.csv"):
        assert (tmp_path / name).read_bytes() == (DOCS / "examples" / name).read_bytes()
    assert sum(path.stat().st_size for path in tmp_path.iterdir()) < 150_000


@pytest.mark.proof
def test_from_log_to_certificate_by_the_page_s_commands(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, thorough: bool
) -> None:
    """The table's figures are of ten logs (`make proof`); that of the calibrated readings is held by two of them."""
    (tmp_path / "docs").symlink_to(DOCS, target_is_directory=True)
    monkeypatch.chdir(tmp_path)
    assert [command.split()[1] for command in COMMANDS] == ["look", "solve", "show", "export"]
    for command in COMMANDS:
        done = rig_here(*shlex.split(command)[1:])
        assert done.returncode == 0, f"{command}: {done.stderr}"
        if " look " in command:
            written = (tmp_path / "columns.yaml").read_text(encoding="utf-8")
            assert "".join(line for line in written.splitlines(True) if not line.startswith("#")) == shown("yaml")
    assert (tmp_path / "runs/robot/certificate.html").exists() and (tmp_path / "readings/imu.csv").exists()
    names: dict[str, object] = {}
    exec(shown("python"), names)
    gyro = rig.load_result("runs/robot")["imu"]
    logs = [make_log(seed) for seed in (LOGS if thorough else LOGS[:2])]
    calibrated = np.concatenate([orientation_errors_deg(log, gyro.apply(rates(log))) for log in logs])
    assert np.median(calibrated) < 0.2, "the page says 0.14"
    if not thorough:
        return
    as_logged = np.concatenate([orientation_errors_deg(log, rates(log)) for log in logs])
    without_bias = np.concatenate([orientation_errors_deg(log, rates(log) - at_first(log)) for log in logs])
    assert np.median(as_logged) == pytest.approx(6.6, abs=0.1)
    assert np.median(without_bias) == pytest.approx(2.6, abs=0.1)


def rates(log: RobotLog) -> np.ndarray:
    in_rad_s: np.ndarray = np.radians(log.rates_deg_s)
    return in_rad_s


def at_first(log: RobotLog) -> np.ndarray:
    mean: np.ndarray = rates(log)[log.time_s < 1.4].mean(axis=0)
    return mean
