"""On a busy computer, samples that have arrived wait to be read; the recording ends when all of them are in it."""

import re
from pathlib import Path

import pytest
import yaml

from rig.data.recording.run_file import read_run
from support.laboratories.commands import rig
from support.laboratories.ideal import ideal_document
from support.laboratories.worlds import fresh_host, merge
from support.paths import CONFIGS, ROOT

pytestmark = pytest.mark.slow

SCRIPT = ROOT / "tests" / "support" / "motions" / "read_late.py"
ONE_SWEEP = {"name": "read_late", "speed_deg_s": 170, "acceleration_deg_s2": 700, "rest_s": 0.5}


def test_what_is_read_after_the_last_motion_is_recorded(tmp_path: Path) -> None:
    host, config = fresh_host(), tmp_path / "config.yaml"
    address = {"arm": {"host": host}, "sensors": {"imu1": {"mavlink": {"port": f"socket://{host}:5760"}}}}
    document = merge(ideal_document(CONFIGS / "own_port" / "autopilot.yaml"), address)
    config.write_text(yaml.safe_dump(document | {"procedure": ONE_SWEEP}), encoding="utf-8")
    said = rig("run", config, "--script", SCRIPT, "--out", tmp_path / "run").stderr
    assert "recorded: " in said, said
    lasted_s = sum(map(float, re.findall(r"done: .*, (\d+\.\d+) s", said)))
    times_us = read_run(tmp_path / "run" / "run.h5").samples["imu1"]["board_time_us"]
    assert 1e-6 * float(times_us[-1] - times_us[0]) > 0.95 * lasted_s, said
