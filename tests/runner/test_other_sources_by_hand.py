"""By hand with a device that prints lines, and with an autopilot's IMU: the time is the sensor's own clock."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from rig.config.load import ConfigurationRefused, load, parse
from rig.turners.registry import sections
from support.commands import rig, rig_here
from support.paths import CONFIGS
from support.worlds import fresh_host, merge

SOURCES = {"lines": ("imu", {"range_g": 8}, "oscillator_ppm"), "autopilot": ("imu1", {"range_g": 16}, "clock_ppm")}
CLOCK_PPM = 50.0
SHORT: dict[str, Any] = {"procedure": {"flips": 8, "turns": 1}, "world": {"hand": {"mistakes": {}}}}


def document(source: str, *changes: dict[str, Any]) -> dict[str, Any]:
    """configs/by_hand.yaml without its board, with the sensor of that source's configuration."""
    by_hand, other = (yaml.safe_load(load(CONFIGS / f"{name}.yaml", turners=sections()).text)
                      for name in ("by_hand", source))  # fmt: skip
    by_hand.pop("board")
    by_hand["world"].pop("board")
    name, acceleration, _ = SOURCES[source]
    by_hand["sensors"], by_hand["world"]["sensors"] = other["sensors"], other["world"]["sensors"]
    own = {
        "sensors": {name: {"correction": "matrix", "acceleration": acceleration}},
        "uncertainty": {"crystal_ppm": CLOCK_PPM},
        "history": {"off": True},
        "world": {"time_scale": 4},  # the rig thinks while the laboratory goes on
    }
    found: dict[str, Any] = by_hand
    for change in (own, *changes):
        found = merge(found, change)
    host = fresh_host()
    sensor = found["sensors"][name]
    if source == "lines":
        sensor["serial"]["port"] = f"socket://{host}:7341"
    else:
        sensor["mavlink"]["port"] = f"socket://{host}:5760"
    return found


def ran(source: str, folder: Path, *changes: dict[str, Any]) -> dict[str, Any]:
    """The sensor's entry in the result of a run that passed."""
    folder.mkdir(exist_ok=True)
    config = folder / "config.yaml"
    config.write_text(yaml.safe_dump(document(source, *changes), sort_keys=False), encoding="utf-8")
    done = rig("run", config, "--out", folder / "run", timeout_s=560)
    assert done.returncode == 0, done.stderr + done.stdout
    result = json.loads((folder / "run" / "result.json").read_text(encoding="utf-8"))
    entry: dict[str, Any] = result["sensors"][SOURCES[source][0]]
    return entry


def off(source: str, entry: dict[str, Any]) -> np.ndarray:
    """(6,) errors of scale and bias by their u, that of the scale without what real hands did elsewhere."""
    truth = document(source)["world"]["sensors"][SOURCES[source][0]]
    std = np.sqrt(np.diag(entry["covariance_combined"]))
    std[:3] = entry["by_hand"]["session_std"]
    true = truth["scale"] + truth["bias_rad_s"]
    found: np.ndarray = (np.array(entry["scale"] + entry["bias_rad_s"]) - np.array(true)) / std
    return found


@pytest.mark.one_in(2)
@pytest.mark.slow
@pytest.mark.timeout(600)
@pytest.mark.parametrize("source", SOURCES)
def test_what_tells_its_own_time_is_calibrated_by_hand(source: str, tmp_path: Path) -> None:
    entry = ran(source, tmp_path, SHORT)
    assert np.abs(off(source, entry)).max() < 4
    (clock,) = (each for each in entry["budget"]["contributors"] if each["name"] == "clock")
    assert clock["half_width"] == CLOCK_PPM and "the sensor's own clock" in clock["source"]
    again = json.loads(rig_here("solve", tmp_path / "run", "--json").stdout)
    assert again["sensors"][SOURCES[source][0]]["scale"] == entry["scale"]


@pytest.mark.slow
@pytest.mark.proof
@pytest.mark.thorough
@pytest.mark.timeout(3600)
@pytest.mark.parametrize("source", SOURCES)
def test_by_hand_errors_are_as_large_as_is_said(source: str, tmp_path: Path) -> None:
    name, _, clock = SOURCES[source]
    errors = []
    for seed in range(6):
        ppm = float(np.random.default_rng([seed, 29]).uniform(-CLOCK_PPM, CLOCK_PPM))
        simulated = {"seed": 300 + seed, "sensors": {name: {source: {clock: ppm}}}}
        errors.append(off(source, ran(source, tmp_path / str(seed), {"world": simulated})))
    scale, bias = (float(np.sqrt(np.mean(np.square(each)))) for each in np.hsplit(np.array(errors), 2))
    print(f"{source}: RMS of error / u {scale:.2f} of the scale, {bias:.2f} of the bias")
    # 36 squares, but the three scale factors of a run share its placements: as if a run told two values of each.
    assert 0.5 < np.sqrt(np.mean(np.square(errors))) < 1.4


def problems(source: str, *changes: dict[str, Any]) -> str:
    with pytest.raises(ConfigurationRefused) as caught:
        parse(yaml.safe_dump(document(source, *changes)), turners=sections())
    return "\n".join(caught.value.problems)


def test_a_clock_that_nobody_vouches_for_is_refused() -> None:
    unsaid = document("autopilot")
    unsaid.pop("uncertainty")
    with pytest.raises(ConfigurationRefused, match="crystal_ppm: say by how much the clock of imu1 may be off"):
        parse(yaml.safe_dump(unsaid), turners=sections())
    columns = ["-", "gx", "gy", "gz", "ax", "ay", "az", "temperature"]
    arrival = {"sensors": {"imu": {"lines": {"columns": columns, "time": None, "clock": "arrival"}}}}
    assert "sensors.imu.lines.clock: by hand the device has to tell the time" in problems("lines", arrival)
    assert "too slow for a hand" in problems("autopilot", {"sensors": {"imu1": {"rate_hz": 20}}})
