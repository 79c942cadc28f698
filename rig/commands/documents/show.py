"""`rig show`: what a finished run amounts to, in short or in full."""

from argparse import ArgumentParser, Namespace
from pathlib import Path
from typing import TYPE_CHECKING

from rig.commands.config_arguments import add_run
from rig.errors import Refused

if TYPE_CHECKING:
    from rig.data.result_file import ResultDocument


def add(parser: ArgumentParser) -> None:
    """The arguments of `rig show`."""
    add_run(parser, "run", "a run folder or its result.json (default: latest)", nargs="?", default="latest")
    part = parser.add_mutually_exclusive_group()
    part.add_argument("--budget", action="store_true", help="values, uncertainty budgets, and what stands beside")
    part.add_argument("--checks", action="store_true", help="every check, sensor by sensor, those that failed first")
    part.add_argument("--all", action="store_true", help="both")
    parser.add_argument("--sensor", metavar="NAME", help="of this sensor alone")


def run(options: Namespace) -> int:
    """Print a finished run as it was judged; nothing is solved anew, nothing is written.

    Returns 0, whatever the verdict is. Raises Refused `no_result`, `not_a_result`, `no_such_sensor`.
    """
    from rich.console import Console

    from rig.data.result_file import read_result
    from rig.report.terminal.table import print_checks, print_kept, print_values, print_verdict
    from rig.station.plain_text import say

    result, sensor = read_result(options.run), options.sensor
    console = Console(highlight=False)
    if sensor is not None and sensor not in (names := _sensors(result)):
        scalars = _scalars(options.run)
        if sensor not in scalars:
            known = ", ".join([*names, *scalars])
            raise Refused("no_such_sensor", f"{options.run} has no sensor {sensor}", f"Choose one of: {known}")
        say(scalars[sensor])
        return 0
    if options.budget or options.all or (sensor is not None and not options.checks):
        print_values(result, console, sensor)
    if options.checks or options.all:
        print_checks(result, console, sensor)
    if options.budget or options.all or options.checks or sensor is not None:
        print_verdict(result, console)
    else:
        print_kept(options.run if options.run.is_dir() else options.run.parent, result)
    return 0


def _sensors(result: "ResultDocument") -> list[str]:
    from rig.report.kinds.registry import kinds

    return [*dict.fromkeys(found.sensor for kind in kinds() for found in kind.find(result))]


def _scalars(run: Path) -> dict[str, str]:
    """What the recording has without axes, in words by name: the result has none. Raises Refused as `read_run`."""
    import numpy as np

    from rig.data.recording.run_file import read_run
    from rig.data.run_folder import recordings

    recorded = [read_run(path) for path in recordings(run, "raw")] if run.is_dir() else []
    found: dict[str, str] = {}
    for name, sensor in recorded[0].sensors.items() if recorded else ():
        for channel in () if sensor.has_axes else sensor.channels:
            of = channel.measures
            values = np.concatenate([channel.values(each.samples[name]) for each in recorded]) / of.reading.size
            about = f"mean {values.mean():.2f}, {values.min():.2f} to {values.max():.2f} {of.reading.name}, "
            told = f"{of.name} {about if len(values) else ''}{len(values)} samples"
            found[name] = f"{found[name]}; {told}" if name in found else f"{name}, {sensor.part}: {told}"
    return found
