"""Configurations without a laboratory's imperfections: tests of one thing at a time begin with these."""

from collections.abc import Mapping, Sequence
from copy import deepcopy
from functools import cache
from pathlib import Path
from typing import Any

import yaml

from rig.config.load import Loaded, load, parse

OF_THE_ARM = {
    "vibration_rms_rad_s", "vibration_hz", "vibration_measured_rms_rad_s", "vibration_measured_hz", "settling_rad",
    "settling_hz", "settling_decay_s", "clock_ppm", "state_jitter_s", "calibration", "unmodelled",
}  # fmt: skip
OF_A_SENSOR = {
    "offset_mm", "start_temperature_c", "warm_up_s", "bias_rad_s_per_k", "scale_per_k", "g_sensitivity_rad_s_per_g",
    "bias_instability_rad_s", "bias_instability_time_s", "bias_random_walk_rad_s_per_sqrt_s",
    "nonlinearity_odd_per_rad_s", "nonlinearity_even_per_rad_s", "bandwidth_hz", "delay_ms",
}  # fmt: skip


def ideal_document(path: Path) -> dict[str, Any]:
    """Return a file with its bases, without the imperfections in its `world:` section."""
    return deepcopy(_ideal_document(path))


@cache  # most laboratories of the tests begin with the same file
def _ideal_document(path: Path) -> dict[str, Any]:
    document: dict[str, Any] = yaml.safe_load(load(path).text)
    world = document["world"]
    world.pop("site", None)
    world["arm"] = _remove_keys(world.get("arm", {}), OF_THE_ARM)
    world["sensors"] = {name: _remove_keys(sensor, OF_A_SENSOR) for name, sensor in world["sensors"].items()}
    return document


def ideal(path: Path, overrides: Sequence[str] = ()) -> Loaded:
    """Return a file without these imperfections as a configuration, with overrides like those of `--set`."""
    return parse(yaml.safe_dump(ideal_document(path), sort_keys=False), overrides=overrides)


def _remove_keys(section: Mapping[str, Any], keys: set[str]) -> dict[str, Any]:
    return {key: value for key, value in section.items() if key not in keys}
