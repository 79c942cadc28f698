"""By hand with a device that prints lines, and with an autopilot's IMU: the time is the sensor's own clock."""

import json
import re
import socket
import time
from dataclasses import dataclass
from pathlib import Path
from subprocess import PIPE, STDOUT
from typing import Any

import numpy as np
import pytest
import yaml
from scipy.stats import norm

from rig.config.load import ConfigurationRefused, load, parse
from rig.data.recording.hand_events import HandRested
from rig.data.recording.run_file import read_run
from rig.turners.turner_registry import sections
from rig.world.world_section import read_world_section
from support.external.handled_body import FAST_RAD_S, LSM9DS1
from support.laboratories.commands import rig_here, wait_for_log
from support.laboratories.drawn_laboratory import truth
from support.laboratories.worlds import fresh_host, merge
from support.paths import CONFIGS
from support.processes.waiting import PATIENCE_S
from support.processes.warm import start_module

pytestmark = pytest.mark.slow

SOURCES = {"lines": ("imu", {"range_g": 8}, "oscillator_ppm"), "autopilot": ("imu1", {"range_g": 16}, "clock_ppm")}
CLOCK_PPM, SEEDS = 50.0, 12
SHORT: dict[str, Any] = {"procedure": {"flips": 8, "turns": 1}, "world": {"hand": {"mistakes": {}}}}


def document(source: str, *changes: dict[str, Any]) -> dict[str, Any]:
    """configs/by_hand.yaml without its board, with the sensor of that source's configuration."""
    by_hand, other = (yaml.safe_load(load(CONFIGS / f"{name}.yaml", turners=sections()).text)
                      for name in ("by_hand", f"own_port/{source}"))  # fmt: skip
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


@dataclass(frozen=True, slots=True)
class Ran:
    """A run that passed: the sensor's entry in its result, and what it really is when the session ends."""

    entry: dict[str, Any]
    scale: np.ndarray
    bias_rad_s: np.ndarray

    @property
    def off(self) -> np.ndarray:
        """(6,) errors of scale and bias by their u, that of the scale without what real hands did elsewhere."""
        std = np.sqrt(np.diag(self.entry["covariance_combined"]))
        std[:3] = self.entry["by_hand"]["session_std"]
        found = np.array(self.entry["scale"] + self.entry["bias_rad_s"])
        errors: np.ndarray = (found - np.concatenate([self.scale, self.bias_rad_s])) / std
        return errors


def ran(source: str, folder: Path, *changes: dict[str, Any]) -> Ran:
    folder.mkdir(exist_ok=True)
    laboratory, name = document(source, *changes), SOURCES[source][0]
    config, out = folder / "config.yaml", folder / "run"
    config.write_text(yaml.safe_dump(laboratory, sort_keys=False), encoding="utf-8")
    with start_module("run", config, "--out", out, stdout=PIPE, stderr=STDOUT, text=True) as process:
        try:
            wait_for_log(out, "sampling: ")
            began_s = began(laboratory, (out / "log.txt").read_text(encoding="utf-8"))
            said, _ = process.communicate(timeout=PATIENCE_S)
        finally:
            process.kill()
    assert process.returncode == 0, said
    run = read_run(out / "run.h5")
    (*_, last) = (event.event for event in run.events if isinstance(event.event, HandRested))
    first = run.samples[name][0]
    on_s = (float(first["host_time_s"]) - began_s) * laboratory["world"]["time_scale"]
    rest_s = on_s + 1e-6 * (np.array([last.begin_us, last.end_us]) - int(first["board_time_us"]))
    true = truth(laboratory, name, [(rest_s[0], rest_s[1])])
    result = json.loads((out / "result.json").read_text(encoding="utf-8"))
    return Ran(result["gyroscopes"][name], np.array(laboratory["world"]["sensors"][name]["scale"]), true[3:])


def began(laboratory: dict[str, Any], log: str) -> float:
    """When the run's own world began, by this computer's clock, while it goes on as fast as it is to."""
    section = read_world_section(parse(yaml.safe_dump(laboratory), turners=sections()))
    (host,) = set(re.findall(r" at socket://([\d.]+):", log))
    with socket.create_connection((host, section.control_port), PATIENCE_S) as control:
        control.sendall(b'{"do": "state"}\n')
        with control.makefile() as replies:
            now_s = float(json.loads(replies.readline())["time_s"])
    return time.monotonic() - now_s / section.time_scale


@pytest.mark.one_in(2)
@pytest.mark.parametrize("source", SOURCES)
def test_what_tells_its_own_time_is_calibrated_by_hand(source: str, tmp_path: Path) -> None:
    found = ran(source, tmp_path, SHORT, {"sensors": {SOURCES[source][0]: {"rate_hz": 100}}})
    assert np.abs(found.off).max() < 4
    entry = found.entry
    (clock,) = (contributor for contributor in entry["budget"]["contributors"] if contributor["name"] == "clock")
    assert clock["half_width"] == CLOCK_PPM and "the sensor's own clock" in clock["source"]
    again = json.loads(rig_here("solve", tmp_path / "run", "--json").stdout)
    assert again["gyroscopes"][SOURCES[source][0]]["scale"] == entry["scale"]


@pytest.mark.proof
@pytest.mark.thorough
@pytest.mark.timeout(3600)
@pytest.mark.parametrize("source", SOURCES)
def test_by_hand_errors_are_as_large_as_stated(source: str, tmp_path: Path) -> None:
    """The sensors stand for all: each clock, and each way of bending, is of another twelfth of its distribution."""
    name, _, clock = SOURCES[source]
    shares = (np.arange(SEEDS) + 0.5) / SEEDS
    clocks_ppm, evens, odds = np.random.default_rng(29).permuted(np.tile(shares, (3, 1)), axis=1)
    errors = []
    for seed in range(SEEDS):
        sensor = {
            source: {clock: float(CLOCK_PPM * (2 * clocks_ppm[seed] - 1))},
            "bias_random_walk_rad_s_per_sqrt_s": LSM9DS1.walk_rad_s_sqrt_s,
            "nonlinearity_even_per_rad_s": bent(evens[seed]),
            "nonlinearity_odd_per_rad_s": bent(odds[seed]),
        }
        simulated = {"seed": 300 + seed, "sensors": {name: sensor}}
        errors.append(ran(source, tmp_path / str(seed), {"world": simulated}).off)
    scale, bias = (float(np.sqrt(np.mean(np.square(each)))) for each in np.hsplit(np.array(errors), 2))
    print(f"{source}: RMS of error / u {scale:.2f} of the scale, {bias:.2f} of the bias")
    # 72 squares, but the three scale factors of a run share its placements: as if a run told two values of each.
    assert 0.7 < np.sqrt(np.mean(np.square(errors))) < 1.3


def bent(share: float) -> float:
    """1/(rad/s), as far as so large a share of the sensors does not bend whose sessions hold by their uncertainty."""
    return float(norm.ppf(share) * LSM9DS1.nonlinearity / FAST_RAD_S)


def problems(source: str, *changes: dict[str, Any]) -> str:
    with pytest.raises(ConfigurationRefused) as caught:
        parse(yaml.safe_dump(document(source, *changes)), turners=sections())
    return "\n".join(caught.value.problems)


def test_a_clock_that_nobody_vouches_for_is_refused() -> None:
    unsaid = document("autopilot")
    unsaid.pop("uncertainty")
    with pytest.raises(ConfigurationRefused, match="crystal_ppm: state how far the clock of imu1 may be off"):
        parse(yaml.safe_dump(unsaid), turners=sections())
    columns = ["-", "gx", "gy", "gz", "ax", "ay", "az", "temperature"]
    arrival = {"sensors": {"imu": {"lines": {"columns": columns, "time": None, "clock": "arrival"}}}}
    assert "sensors.imu.lines.clock: in a session by hand the device must print its time" in problems("lines", arrival)
    assert "too slow for a hand" in problems("autopilot", {"sensors": {"imu1": {"rate_hz": 20}}})
