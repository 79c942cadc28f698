"""`rig history …`: what the laboratory remembers; what its commands take."""

import argparse
from collections.abc import Callable, Sequence
from datetime import date
from pathlib import Path

from rig.commands.config_arguments import add_json, add_run, add_set
from rig.commands.history.named_history import add_history
from rig.commands.history.waiting import answer_of

LIST = "list"
AGAIN = "recompute"
_COMMANDS = (LIST, "show", "plot", "rigs", "import", "verify", AGAIN, "compare", "void")


def with_usual_command(arguments: Sequence[str]) -> list[str]:
    """`rig history …` without one of its commands is `rig history list …`."""
    words = list(arguments)
    if words[:1] == ["history"] and words[1:2] not in [[each] for each in (*_COMMANDS, "-h", "--help")]:
        words.insert(1, LIST)
    return words


def add(history: argparse.ArgumentParser) -> None:
    """The commands of `rig history`."""
    commands = history.add_subparsers(title="commands", required=True, metavar="COMMAND")

    def added(name: str, text: str) -> argparse.ArgumentParser:
        command: argparse.ArgumentParser = commands.add_parser(name, help=text, description=text)
        command.set_defaults(of_history=name)
        add_history(command)
        return command

    listed = added(LIST, "calibrations, and of one sensor their trends; the usual one, its name may be left out")
    listed.add_argument("serial_number", nargs="?", metavar="SERIAL", help="of one sensor")
    _add_selection(listed)
    form = listed.add_mutually_exclusive_group()
    form.add_argument("--json", action="store_true", help="for machines")
    form.add_argument("--csv", action="store_true", help="for machines and spreadsheets, a line for each parameter")
    show = added("show", "one calibration with its run")
    show.add_argument("number", type=int, metavar="NUMBER", help="as `rig history` has it")
    show.add_argument("--json", action="store_true", help="the result.json of its run, as it was entered")
    plot = added("plot", "draw a sensor's calibrations over time, drift and charts (extra `study`)")
    plot.add_argument("serial_number", metavar="SERIAL", help="of this sensor")
    _add_selection(plot)
    plot.add_argument("--out", type=Path, default=Path(), metavar="DIR", help="where to (default: here)")
    rigs = added("rigs", "what check standards and shared sensors say of the rigs themselves")
    _add_selection(rigs, rig=False)
    add_json(rigs)
    imported = added("import", "enter runs that are in no history yet; what is there already stays as it is")
    add_run(imported, "folders", "run folders, or folders that hold some", metavar="DIR", nargs="+")
    imported.add_argument(
        "--solve", action="store_true", help="enter what the recordings give, whatever a result.json says"
    )
    added("verify", "whether rows, results and files are what was entered; exit status 1 when they are not")
    again = added(AGAIN, "solve every recording by today's method and say what changes; nothing is overwritten")
    again.add_argument("--serial", dest="serial_number", metavar="SERIAL", help="only of one sensor")
    _add_selection(again)
    _add_again(again)
    compare = added("compare", "two calibrations of one sensor, with E_n")
    compare.add_argument("first", type=int, metavar="A", help="number of the earlier one, as `rig history` has it")
    compare.add_argument("second", type=int, metavar="B", help="number of the later one")
    compare.add_argument(
        "--plot", type=Path, metavar="DIR", help="draw the differences into this folder (extra `study`)"
    )
    add_json(compare)
    void = added("void", "say that a calibration does not count, and why; nothing is taken away")
    void.add_argument("number", type=int, metavar="NUMBER", help="as `rig history` has it")
    void.add_argument("--reason", required=True, metavar="TEXT", help="why, in a few words")


def _add_again(again: argparse.ArgumentParser) -> None:
    """How everything is solved, on how many processes or machines, and where the report goes."""
    add_set(again, "judge by another threshold or limit than was recorded, as in `rig solve`", metavar="NAME=VALUE")
    again.add_argument("--estimator", metavar="NAME", help="another than each procedure's own, as in `rig solve`")
    again.add_argument(
        "--u-fraction",
        type=float,
        default=0.1,
        metavar="PART",
        help="a result counts as moved beyond this part of the U that was stated (default: 0.1)",
    )
    again.add_argument(
        "--out",
        type=Path,
        default=Path("recomputed"),
        metavar="DIR",
        help="report and journal; the same command with the same folder goes on (default: recomputed)",
    )
    spread = again.add_mutually_exclusive_group()
    spread.add_argument("--jobs", type=int, default=1, metavar="N", help="processes of this computer (default: 1)")
    spread.add_argument(
        "--dask", metavar="ADDRESS", help="the workers of this Dask scheduler, as tcp://10.0.0.2:8786 (extra `dask`)"
    )


def _add_selection(parser: argparse.ArgumentParser, *, rig: bool = True) -> None:
    parser.add_argument("--part", metavar="PART", help="only sensors of this part")
    parser.add_argument("--since", type=_day, metavar="DATE", help="only from this day on, as 2026-11-20")
    if rig:
        parser.add_argument("--rig", metavar="RIG", help="only by this rig, its name or its arm's serial number")


def _day(text: str) -> date:
    try:
        return date.fromisoformat(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r} is no day; write it as 2026-11-20") from None


def run(options: argparse.Namespace) -> int:
    """Carry out the command of `rig history` that is meant; Ctrl-C is heard at once, whatever its database does."""
    if options.of_history == AGAIN:
        from rig.commands.history.again import again

        return again(options)
    from rig.commands.history import questions as history

    commands: dict[str, Callable[[argparse.Namespace], int]] = {
        LIST: history.listed,
        "show": history.show,
        "plot": history.plot,
        "rigs": history.rigs,
        "import": history.imported,
        "verify": history.verify,
        "compare": history.compare,
        "void": history.void,
    }
    return answer_of(lambda: commands[options.of_history](options))
