"""`rig history …`: its commands and their arguments."""

import argparse
from collections.abc import Callable, Sequence
from datetime import date
from pathlib import Path

from rig.commands.config_arguments import add_history, add_json, add_run, add_set
from rig.commands.history.history_answer import await_answer

LIST = "list"
RECOMPUTE = "recompute"
_COMMANDS = (LIST, "show", "plot", "rigs", "import", "verify", RECOMPUTE, "compare", "void")


def insert_usual_command(arguments: Sequence[str]) -> list[str]:
    """Return the arguments with `list` inserted if `rig history …` names none of its commands."""
    words = list(arguments)
    if words[:1] == ["history"] and words[1:2] not in [[command] for command in (*_COMMANDS, "-h", "--help")]:
        words.insert(1, LIST)
    return words


def add(history: argparse.ArgumentParser) -> None:
    """Add the commands of `rig history`."""
    commands = history.add_subparsers(title="commands", required=True, metavar="COMMAND")

    def add_command(name: str, text: str) -> argparse.ArgumentParser:
        command: argparse.ArgumentParser = commands.add_parser(name, help=text, description=text)
        command.set_defaults(of_history=name)
        add_history(command)
        return command

    list_parser = add_command(LIST, "list calibrations, and the trends of one sensor; the default command")
    list_parser.add_argument("serial_number", nargs="?", metavar="SERIAL", help="only this sensor")
    _add_selection(list_parser)
    form = list_parser.add_mutually_exclusive_group()
    form.add_argument("--json", action="store_true", help="print JSON")
    form.add_argument("--csv", action="store_true", help="print CSV, one line per parameter")
    show_parser = add_command("show", "show one calibration with its run")
    show_parser.add_argument(
        "calibration", metavar="NUMBER|SERIAL", help="as `rig history` has it; of a serial number, the last run's"
    )
    show_parser.add_argument("--json", action="store_true", help="the result.json of its run, as it was entered")
    plot_parser = add_command("plot", "draw a sensor's calibrations over time, drift and charts (extra `study`)")
    plot_parser.add_argument("serial_number", metavar="SERIAL", help="this sensor")
    _add_selection(plot_parser)
    plot_parser.add_argument(
        "--out", type=Path, default=Path(), metavar="DIR", help="folder of the figures (default: .)"
    )
    rigs_parser = add_command("rigs", "compare the rigs themselves by check standards and shared sensors")
    _add_selection(rigs_parser, rig=False)
    add_json(rigs_parser)
    import_parser = add_command("import", "enter runs that are not yet in the history; others stay unchanged")
    add_run(import_parser, "folders", "run folders, or folders that contain some", metavar="DIR", nargs="+")
    import_parser.add_argument(
        "--solve", action="store_true", help="enter results recomputed from the recordings, not those of result.json"
    )
    add_command("verify", "check that rows, results and files are as they were entered; exit status 1 if not")
    again_parser = add_command(RECOMPUTE, "solve every recording by today's method and report what changes")
    again_parser.add_argument("--serial", dest="serial_number", metavar="SERIAL", help="only this sensor")
    _add_selection(again_parser)
    _add_recompute(again_parser)
    compare_parser = add_command("compare", "compare two calibrations of one sensor by E_n")
    compare_parser.add_argument("first", type=_number, metavar="A", help="number of the earlier one in `rig history`")
    compare_parser.add_argument("second", type=_number, metavar="B", help="number of the later one")
    compare_parser.add_argument(
        "--plot", type=Path, metavar="DIR", help="draw the differences into this folder (extra `study`)"
    )
    add_json(compare_parser)
    void_parser = add_command("void", "mark a calibration as void, and say why; nothing is deleted")
    void_parser.add_argument("number", type=_number, metavar="NUMBER", help="as `rig history` has it")
    void_parser.add_argument("--reason", required=True, metavar="TEXT", help="why, in a few words")


def _add_recompute(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `rig history recompute`: method, number of processes or machines, folder of the report."""
    add_set(parser, "judge by another threshold or limit than recorded, as in `rig solve`", metavar="NAME=VALUE")
    parser.add_argument("--estimator", metavar="NAME", help="one estimator for all procedures, as in `rig solve`")
    parser.add_argument(
        "--u-fraction",
        type=float,
        default=0.1,
        metavar="PART",
        help="report a result as moved beyond this fraction of its stated U (default: 0.1)",
    )
    parser.add_argument(
        "--out",
        type=Path,
        default=Path("recomputed"),
        metavar="DIR",
        help="folder of report and journal; the same command with the same folder continues (default: recomputed)",
    )
    workers = parser.add_mutually_exclusive_group()
    workers.add_argument("--jobs", type=int, default=1, metavar="N", help="processes on this computer (default: 1)")
    workers.add_argument(
        "--dask", metavar="ADDRESS", help="workers of this Dask scheduler, such as tcp://10.0.0.2:8786 (extra `dask`)"
    )


def _add_selection(parser: argparse.ArgumentParser, *, rig: bool = True) -> None:
    parser.add_argument("--part", metavar="PART", help="only sensors of this part")
    parser.add_argument("--since", type=_day, metavar="DATE", help="only from this day on, such as 2026-11-20")
    if rig:
        parser.add_argument("--rig", metavar="RIG", help="only by this rig: its name or its arm's serial number")


def _day(text: str) -> date:
    try:
        return date.fromisoformat(text)
    except ValueError:
        raise argparse.ArgumentTypeError(f"{text!r} is not a date; write it as 2026-11-20") from None


def _number(text: str) -> int:
    try:
        return int(text)
    except ValueError:
        raise argparse.ArgumentTypeError(
            f"{text!r} is not the number of a calibration; `rig history {text}` lists those of a serial number"
        ) from None


def run(options: argparse.Namespace) -> int:
    """Carry out the chosen command; return its exit status. Ctrl-C ends it even if the database hangs."""
    if options.of_history == RECOMPUTE:
        from rig.commands.history.recompute import recompute_history

        return recompute_history(options)
    from rig.commands.history import history_queries as history

    commands: dict[str, Callable[[argparse.Namespace], int]] = {
        LIST: history.list_calibrations,
        "show": history.show,
        "plot": history.plot,
        "rigs": history.rigs,
        "import": history.import_runs,
        "verify": history.verify,
        "compare": history.compare,
        "void": history.void,
    }
    return await_answer(lambda: commands[options.of_history](options))
