"""`rig show`: what a finished run amounts to, in short or in full."""

from argparse import ArgumentParser, Namespace
from pathlib import Path
from typing import TYPE_CHECKING

from rig.errors import Refused

if TYPE_CHECKING:
    from rig.data.result_file import ResultDocument


def add(parser: ArgumentParser) -> None:
    """The arguments of `rig show`."""
    parser.add_argument("run", type=Path, metavar="RUN", help="a run folder or its result.json")
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
    from rig.report.table import print_checks, print_kept, print_values, print_verdict

    result, sensor = read_result(options.run), options.sensor
    if sensor is not None and sensor not in (names := _sensors(result)):
        raise Refused("no_such_sensor", f"{options.run} has no sensor {sensor}", f"Choose one of: {', '.join(names)}")
    console = Console(highlight=False)
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

    return [*dict.fromkeys(found.sensor for kind in kinds() for found in kind.found(result))]
