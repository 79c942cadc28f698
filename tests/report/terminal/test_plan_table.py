"""What `rig plan` prints for people, on a screen of 80 columns and for sensors of which not everything is checked."""

import pytest
from rich.console import Console

from rig.analysis.consistency.detection_limits import DetectionLimit
from rig.report.terminal.plan_table import _limits_table
from support.laboratories.commands import rig_here
from support.paths import CONFIGS


def test_a_long_instruction_leaves_every_step_its_time(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    said = rig_here("plan", CONFIGS / "servo.yaml").stdout
    assert "start s" in said and "duration s" in said and "…" not in said
    assert said.count("sweep shaft ccw         8.10") == 3
    assert max(map(len, said.splitlines())) <= 80


def test_what_is_not_checked_of_a_sensor_is_a_dash_in_its_column() -> None:
    scale, bias = (
        DetectionLimit("the scale changes", "scale_changed", 1e-3, "1"),
        DetectionLimit("a jump", "bias_jumped", 2.0, "T"),
    )
    console = Console(width=80)
    with console.capture() as shown:
        console.print(_limits_table("to accelerometers", {"a": (scale, bias), "b": (scale,)}))
    rows = [line.split() for line in shown.get().splitlines()]
    assert ["the", "scale", "changes", "0.10", "%", "0.10", "%"] in rows
    assert ["a", "jump", "2.0e+06", "µT", "–"] in rows
