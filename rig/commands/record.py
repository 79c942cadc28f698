"""`rig record`: the readings of the sensors alone, while something else turns them. No arm is connected to."""

from collections.abc import Sequence
from contextlib import nullcontext
from pathlib import Path

from rig.commands.laboratory import simulated_laboratory, written
from rig.config.load import load_sensors
from rig.errors import Refused
from rig.runner.readings import record_readings
from rig.station.plain_text import say


def record(config_path: Path, overrides: Sequence[str], out: Path, duration_s: float) -> int:
    """Record into CSV files in `out` and print what each holds; returns 0.

    Raises Refused `bad_option`, as `load_sensors`, and as `record_readings` does; Fault as that.
    """
    if not 0 < duration_s < float("inf"):
        raise Refused("bad_option", f"--duration-s is {duration_s:g}", "Give a time above 0, in seconds")
    loaded = load_sensors(config_path, overrides)
    with written(loaded.text) as used, simulated_laboratory(used) if loaded.simulated else nullcontext():
        for path, seen in record_readings(loaded.config, out, duration_s).items():
            say(f"{path}: {seen.samples} samples, {seen.lost} lost")
    return 0
