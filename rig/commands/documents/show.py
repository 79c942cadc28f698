"""`rig show`: the result of a finished run, in short or in full."""

from argparse import ArgumentParser, Namespace
from pathlib import Path
from typing import TYPE_CHECKING

from rig.commands.config_arguments import add_run
from rig.errors import Refused

if TYPE_CHECKING:
    from rig.data.result_file import ResultDocument


def add(parser: ArgumentParser) -> None:
    """Add the arguments of `rig show`."""
    add_run(parser, "run", "a run folder or its result.json (default: latest)", nargs="?", default="latest")
    part = parser.add_mutually_exclusive_group()
    part.add_argument("--budget", action="store_true", help="values with their uncertainty budgets and remarks")
    part.add_argument("--checks", action="store_true", help="every check, sensor by sensor, failed ones first")
    part.add_argument("--all", action="store_true", help="both")
    parser.add_argument("--sensor", metavar="NAME", help="only this sensor")


def run(options: Namespace) -> int:
    """Print the result of a finished run, without solving it again; return 0.

    Raise Refused `no_result`, `not_a_result`, `no_such_sensor`.
    """
    from rich.console import Console

    from rig.data.result_file import read_result
    from rig.report.simulated_truth import truth_lines, truth_rows
    from rig.report.terminal.result_table import print_checks, print_kept, print_values, print_verdict
    from rig.report.terminal.truth_table import truth_tables
    from rig.report.terminal.whole_words import fit_words
    from rig.station.plain_text import say

    result, sensor = read_result(options.run), options.sensor
    console = Console(highlight=False)
    if sensor is not None and sensor not in (names := _list_sensors(result)):
        scalars = _describe_scalars(options.run)
        if sensor not in scalars:
            names_in_run = ", ".join([*names, *scalars])
            raise Refused("no_such_sensor", f"{options.run} has no sensor {sensor}", f"Choose one of: {names_in_run}")
        say(scalars[sensor])
        return 0
    folder = options.run if options.run.is_dir() else options.run.parent
    truth = truth_rows(folder, result)
    if options.budget or options.all or (sensor is not None and not options.checks):
        print_values(result, console, sensor)
        for table in truth_tables(truth, sensor):
            console.print(fit_words(table, console.width))
    if options.checks or options.all:
        print_checks(result, console, sensor)
    if options.budget or options.all or options.checks or sensor is not None:
        print_verdict(result, console)
    else:
        print_kept(folder, result, [*truth_lines(truth)])
    return 0


def _list_sensors(result: "ResultDocument") -> list[str]:
    from rig.report.kinds.kind_registry import kinds

    return [*dict.fromkeys(entry.sensor for kind in kinds() for entry in kind.find(result))]


def _describe_scalars(run: Path) -> dict[str, str]:
    """Return, by sensor, a text on the recorded quantities without axes. Raise Refused as `read_run` does."""
    import numpy as np

    from rig.data.recording.run_file import read_run
    from rig.data.run_folder import recordings

    recorded = [read_run(path) for path in recordings(run, "raw")] if run.is_dir() else []
    texts: dict[str, str] = {}
    for name, sensor in recorded[0].sensors.items() if recorded else ():
        for channel in () if sensor.has_axes else sensor.channels:
            quantity = channel.measures
            values = (
                np.concatenate([channel.values(run_data.samples[name]) for run_data in recorded])
                / quantity.reading.size
            )
            about = f"mean {values.mean():.2f}, {values.min():.2f} to {values.max():.2f} {quantity.reading.name}, "
            text = f"{quantity.name} {about if len(values) else ''}{len(values)} samples"
            texts[name] = f"{texts[name]}; {text}" if name in texts else f"{name}, {sensor.part}: {text}"
    return texts
