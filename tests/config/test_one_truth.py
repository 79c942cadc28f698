"""A part has one truth, whichever of the shipped configurations simulates it: a history compares them."""

from math import sqrt
from typing import Any

import pytest

from rig.config.load import load
from rig.world.world_section import read_world_section
from support.paths import CONFIGS

pytestmark = pytest.mark.slow

# How a part is mounted, filtered and warmed is another matter in every run.
OF_THE_RUN = {
    "mounting_error_deg", "offset_mm", "temperature_c", "start_temperature_c", "warm_up_s", "bandwidth_hz", "delay_ms",
    "kvh1775", "magnetometer",
}  # fmt: skip
NOISE = ("noise_rad_s", "noise_m_s2")
ROUNDED = 0.05  # of a density


def truth_of(section: dict[str, Any], rate_hz: float) -> dict[str, Any]:
    """What is the part's own, with its noise as a density."""
    own = {key: value for key, value in section.items() if key not in OF_THE_RUN}
    return {key: value / sqrt(rate_hz) if key in NOISE else value for key, value in own.items()}


def simulated() -> list[tuple[str, str, dict[str, Any]]]:
    """Of every part in every configuration that has a world: the file, part and serial number, its truth."""
    found = []
    for path in sorted(CONFIGS.rglob("*.yaml")):
        loaded = load(path)
        if not loaded.simulated:
            continue
        world = read_world_section(loaded)
        for name, sensor in loaded.config.sensors.items():
            truth = world.sensors[name].model_dump()
            beside = truth.pop("accelerometer")
            of = f"{sensor.part} {sensor.serial_number}"
            found.append((path.name, of, truth_of(truth, sensor.rate_hz)))
            if sensor.acceleration is not None:
                found.append((path.name, f"{of}, accelerometer", truth_of(beside, sensor.rate_hz)))
        for name, magnetometer in loaded.config.magnetometers.items():
            of = f"{magnetometer.part} {magnetometer.serial_number}"
            found.append((path.name, of, truth_of(world.magnetometers[name].model_dump(), 1.0)))
    return found


def test_a_serial_number_has_one_truth_in_all_configurations() -> None:
    first: dict[str, tuple[str, dict[str, Any]]] = {}
    differs = []
    for file, of, truth in simulated():
        known_in, known = first.setdefault(of, (file, truth))
        for key in truth:
            alike = truth[key] == (pytest.approx(known[key], rel=ROUNDED) if key in NOISE else known[key])
            if not alike:
                differs.append(f"{of}, {key}: {known[key]} in {known_in}, {truth[key]} in {file}")
    assert not differs, "\n".join(differs)
    assert len({file for file, *_ in simulated()}) > 10
