"""`rig record`: record only the sensors, while another device turns them. No arm is connected."""

import shlex
import sys
from argparse import ArgumentParser, Namespace
from contextlib import ExitStack
from pathlib import Path

from rig.commands.config_arguments import add_config
from rig.commands.laboratory.laboratory_process import run_simulated_laboratory
from rig.errors import Refused
from rig.station.plain_text import say

NO_CRYSTAL_REMEDY = (
    "The board's clock does not follow its crystal: these times may be 1 % wrong. Another clock can correct them "
    "(rig solve --attitudes FILE --estimate-clock-offset); rig solve --turns cannot use them"
)


def add(parser: ArgumentParser) -> None:
    """Add the arguments of `rig record`."""
    add_config(parser)
    parser.add_argument("--out", type=Path, required=True, metavar="DIR", help="folder with a CSV file for each sensor")
    parser.add_argument(
        "--duration-s", type=float, required=True, metavar="S", help="duration by the sensors' own clocks"
    )


def run(options: Namespace) -> int:
    """Record into CSV files in `--out` and print the content of each; return 0.

    Raise Refused `bad_option`, and what `load_sensors` and `record_readings` raise; Fault as `record_readings` does.
    """
    if not 0 < options.duration_s < float("inf"):
        raise Refused("bad_option", f"--duration-s is {options.duration_s:g}", "Give a time above 0, in seconds")
    from rig.commands.laboratory.own_address import find_own_address
    from rig.config.load import load_sensors
    from rig.runner.csv_recording import record_readings

    config, simulated = load_sensors(options.config, options.overrides)
    with ExitStack() as stack:
        if simulated is not None and (moved := stack.enter_context(find_own_address(config, simulated))):
            config, simulated = load_sensors(options.config, [*options.overrides, *moved])
        if simulated is not None:
            stack.enter_context(run_simulated_laboratory(simulated))
        recordings = record_readings(config, options.out, options.duration_s)
    for path, recording in recordings.items():
        say(f"{path}: {recording.summary.samples} samples, {recording.summary.lost} lost")
    if any(recording.follows_crystal is False for recording in recordings.values()):
        say(NO_CRYSTAL_REMEDY, file=sys.stderr)
    say(f"If they were at rest: rig allan {shlex.quote(str(options.out))}", file=sys.stderr)
    return 0
