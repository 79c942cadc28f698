"""The command line. Heavy modules are imported by the command that needs them, so that help comes at once."""

import argparse
import os
import signal
import sys
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rig import __version__
from rig.commands import history_arguments, page_arguments, solve_arguments
from rig.commands.named_history import add_history
from rig.commands.standard_streams import keep_streams_usable
from rig.errors import Fault, RigError
from rig.errors.quoting import printable_lines
from rig.report.exports.formats import FORMATS

if TYPE_CHECKING:
    from rig.plans.registry import AnyProcedure

# The rig's linear algebra is small: threads only get in its way, most of all on a busy machine. NumPy asks when it is
# loaded, so this must be said before; whoever has said otherwise is heeded, and so is a program that has NumPy already.
if "numpy" not in sys.modules:
    for _library in ("OPENBLAS", "OMP", "MKL"):
        os.environ.setdefault(f"{_library}_NUM_THREADS", "1")

_HISTORY = "what the laboratory remembers: calibrations, trends, check standards"
_KVH = "look at a KVH 1775"
_BOARD = "look at the board, read and change its stored calibrations, flash its firmware"
FAULT, INTERRUPTED = Fault.exit_status, 130
# Every way to end a command from outside. Left alone, a closed terminal, Ctrl-\ and Ctrl-Z would end or suspend this
# process while the arm goes on moving.
_ENDING_SIGNALS = tuple(
    getattr(signal, name)
    for name in ("SIGINT", "SIGTERM", "SIGHUP", "SIGQUIT", "SIGTSTP")
    if hasattr(signal, name)  # Windows has the first two
)
_HANGING_UP = getattr(signal, "SIGHUP", None)


def main(arguments: Sequence[str] | None = None) -> int:
    """Entry point of `rig`; returns the exit status docs/architecture.md promises (0, 1, 2, 3 or 130)."""
    said = sys.argv[1:] if arguments is None else arguments
    options = _parser().parse_args(history_arguments.with_usual_command(said))
    return guarded(lambda: options.command(options))


def guarded(command: Callable[[], int]) -> int:
    """Run a command; turn every named error into one message on stderr and its exit status."""
    keep_streams_usable()
    for number in _ENDING_SIGNALS:
        # A script's `&` starts programs that ignore Ctrl-C: an arm must stop by it all the same. That a run is to
        # outlive its terminal is said by ignoring SIGHUP alone (nohup).
        if number != _HANGING_UP or signal.getsignal(number) != signal.SIG_IGN:
            signal.signal(number, _interrupt)
    try:
        status = command()
        sys.stdout.flush()
        return status
    except RigError as error:
        return _ended(str(error), error.exit_status)
    except KeyboardInterrupt as interrupt:
        for number in _ENDING_SIGNALS:
            signal.signal(number, signal.SIG_IGN)  # all is stopped: an impatient second one has nothing left to end
        return _ended(str(interrupt) or "interrupted", INTERRUPTED)
    except OSError as error:
        return _ended(str(Fault("system", f"the system refused ({error})", "Mend that, then try again")), FAULT)
    except SystemExit as ended:  # what a script's own code raised: its status would be taken for a verdict
        ended_by = f"a script ended the program (SystemExit: {ended})"
        return _ended(str(Fault("script_failed", ended_by, "Let the script end nothing by itself")), FAULT)
    except BaseException:
        import traceback

        traceback.print_exc()  # a defect of ours; Python's own status, 1, would mean a verdict
        return FAULT


def _ended(text: str, status: int) -> int:
    print(f"rig: {printable_lines(text)}", file=sys.stderr)
    return status


def _interrupt(*_: Any) -> None:
    raise KeyboardInterrupt


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="rig", description="Calibrate inertial sensors on a robot arm.")
    parser.add_argument("--version", action="version", version=f"rig {__version__}")
    commands = parser.add_subparsers(title="commands", required=True, metavar="COMMAND")

    def add(name: str, run: Callable[[argparse.Namespace], int], text: str) -> argparse.ArgumentParser:
        command = commands.add_parser(name, help=text, description=text)
        command.set_defaults(command=run)
        return command

    run = add("run", _run, "run the procedure the file names")
    _add_config(run)
    _add_script(run)
    _add_run(run)
    plan = add("plan", _plan, "dry run: every motion, its time and limits; connects to nothing")
    _add_config(plan)
    _add_script(plan)
    plan.add_argument("--json", action="store_true", help="for machines")
    check = add("check", _check, "connect and look; nothing moves, no program is stopped")
    _add_config(check)
    _add_script(check)
    _add_record(add("record", _record, "record the sensors alone, while something else turns them; nothing moves"))
    resume = add("resume", _resume, "go on with an interrupted run")
    resume.add_argument("run_folder", type=Path, metavar="RUN_DIR")
    resume.add_argument("--script", type=Path, metavar="FILE", help="the script it was begun with, of another's folder")
    resume.add_argument(
        "--connect",
        action="append",
        default=[],
        metavar="ADDRESS",
        help="an address in a folder that is not of a run of yours, to which it may connect; for each of them",
    )
    _add_outcome(resume)
    page_arguments.add_watching(add("watch", _watch, "a recorded run in a browser, as it was"))
    solve = add("solve", solve_arguments.solve, "recompute the calibration from a recording")
    solve_arguments.add_arguments(solve)
    allan = add(
        "allan", _allan, "random walk and bias instability, by the Allan deviation of what was recorded at rest"
    )
    allan.add_argument(
        "run", type=Path, metavar="RECORDING", help="a run folder, its run.h5, or a log of a sensor at rest as CSV"
    )
    allan.add_argument("--plot", type=Path, metavar="DIR", help="draw the curves into this folder")
    allan.add_argument("--json", action="store_true", help="for machines")
    _add_reversal(add("reversal", _reversal, "a magnetometer's own bias, from runs between which it was turned over"))
    report = add("report", _report, "the certificate of a finished run: HTML, PDF, digital certificate")
    report.add_argument("run", type=Path, metavar="RUN", help="a run folder or its result.json")
    report.add_argument(
        "--pdf",
        action="store_true",
        help="PDF/A-3b too, with result.json and the digital certificate attached (extra `pdf`)",
    )
    report.add_argument(
        "--reversal", type=Path, metavar="FILE", help="what `rig reversal … --out FILE` has found of its magnetometers"
    )
    report.add_argument("--dcc", action="store_true", help="the digital certificate (DCC 3.2.1, XML) too")
    report.add_argument("--out", type=Path, metavar="DIR", help="where to (default: the run folder)")
    add_history(report)
    _add_set(report, "say something else on the certificate, for example certificate.customer=Example")
    export = add("export", _export, "what was calibrated and recorded, in the files of other programs")
    export.add_argument("run", type=Path, metavar="RUN", help="a run folder")
    export.add_argument(
        "--format", choices=FORMATS, required=True, help="whose; docs/how-to/export.md says what each holds"
    )
    export.add_argument("--out", type=Path, metavar="DIR", help="where to (default: export/FORMAT in the run folder)")
    export.add_argument(
        "--at-temperature",
        nargs=2,
        metavar=("CELSIUS", "DRIFT_RUN"),
        help="biases as they are at that temperature, by the slopes a run of bias_drift has found",
    )
    history_arguments.add_arguments(commands.add_parser("history", help=_HISTORY, description=_HISTORY))
    _add_study(add("study", _study, "Monte-Carlo studies of the papers' figures and tables; without a name, list them"))
    _add_board(commands.add_parser("board", help=_BOARD, description=_BOARD))
    _add_kvh(commands.add_parser("kvh", help=_KVH, description=_KVH))
    world = add("world", _world, "only the simulated laboratory, in the foreground, for any client")
    _add_config(world)
    return parser


def _add_study(study: argparse.ArgumentParser) -> None:
    study.add_argument("name", nargs="?", metavar="NAME")
    study.add_argument("--out", type=Path, default=Path("studies"), metavar="DIR", help="default: studies")
    study.add_argument("--seed", type=int, default=1, metavar="N", help="default: 1")
    study.add_argument("--runs", type=int, metavar="N", help="per parameter set (default: as many as the paper)")
    study.add_argument("--jobs", type=int, metavar="N", help="processes; the results do not depend on it")
    study.add_argument("--dask", metavar="ADDRESS", help="compute on the cluster of this Dask scheduler")
    study.add_argument("--format", choices=("csv", "parquet"), default="csv", help="of the table (default: csv)")


def _add_board(board: argparse.ArgumentParser) -> None:
    commands = board.add_subparsers(title="commands", required=True, metavar="COMMAND")

    def add(
        to: Any, name: str, run: Callable[[argparse.Namespace], int], text: str, *, config: bool = True
    ) -> argparse.ArgumentParser:
        command: argparse.ArgumentParser = to.add_parser(name, help=text, description=text)
        command.set_defaults(command=run)
        if config:
            _add_config(command)
        return command

    info = add(commands, "info", _board_info, "what the board is, how it fares, which sensors and calibrations it has")
    info.add_argument("--json", action="store_true", help="for machines")
    text = "the calibrations in the board's flash"
    stored = commands.add_parser("calibration", help=text, description=text).add_subparsers(
        title="commands", required=True, metavar="COMMAND"
    )
    read = add(stored, "read", _board_read, "print what is stored")
    read.add_argument("--json", action="store_true", help="for machines")
    write = add(stored, "write", _board_write, "store the calibration of a run that passed")
    write.add_argument("result", type=Path, metavar="RESULT", help="a run folder or its result.json")
    erase = add(stored, "erase", _board_erase, "forget what is stored")
    for command in (read, write, erase):
        command.add_argument("--sensor", metavar="NAME", help="only this one of the configuration's sensors")
    flash = add(commands, "flash", _board_flash, "put the firmware that comes with this program on it", config=False)
    flash.add_argument("--probe", metavar="ID", help="the debug probe's id or a part of it, if there are several")
    flash.add_argument(
        "--drive", nargs="?", const="", metavar="PATH", help="copy to the board's USB drive instead; default: find it"
    )
    for command in (write, erase, flash):
        command.add_argument("--yes", action="store_true", help="do not ask before the board is changed")


def _add_kvh(kvh: argparse.ArgumentParser) -> None:
    commands = kvh.add_subparsers(title="commands", required=True, metavar="COMMAND")
    text = "its number, the settings in its memory, its built-in test, what it sends; changes nothing"
    info = commands.add_parser("info", help=text, description=text)
    info.set_defaults(command=_kvh_info)
    info.add_argument("target", metavar="PORT_OR_CONFIG", help="its serial port, or a YAML configuration file")
    _add_set(info, "change one value of the file")
    info.add_argument("--baud", type=int, metavar="BD", help="speed of its line (default: the file's, or 921600)")
    info.add_argument("--json", action="store_true", help="for machines")


def _add_reversal(reversal: argparse.ArgumentParser) -> None:
    reversal.add_argument(
        "runs", type=Path, nargs="+", metavar="RUN", help="run folders, or their run.h5: two or three"
    )
    reversal.add_argument("--out", type=Path, metavar="FILE", help="write the JSON to this file too")
    reversal.add_argument("--json", action="store_true", help="for machines")


def _add_config(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("config", type=Path, metavar="CONFIG", help="YAML configuration file")
    _add_set(parser, "change one value of the file")


def _add_set(parser: argparse.ArgumentParser, text: str) -> None:
    parser.add_argument("--set", action="append", default=[], metavar="PATH=VALUE", dest="overrides", help=text)


def _add_record(record: argparse.ArgumentParser) -> None:
    _add_config(record)
    record.add_argument("--out", type=Path, required=True, metavar="DIR", help="where each sensor gets a CSV file")
    record.add_argument(
        "--duration-s", type=float, required=True, metavar="S", help="how long, by the sensors' own clocks"
    )


def _add_script(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--script", type=Path, metavar="FILE", help="a procedure of your own, in place of the file's")


def _add_run(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--out", type=Path, metavar="DIR", help="run folder (default: a new one under output.folder)")
    _add_outcome(parser)


def _add_outcome(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--yes", action="store_true", help="do not ask before the arm moves")
    parser.add_argument("--json", action="store_true", help="print result.json instead of tables")
    page_arguments.add_arguments(parser)


def run_script(procedure: "AnyProcedure") -> int:
    """Entry point of a script that is run as `python FILE.py` and defines `procedure`; arguments as of `rig run`.

    It is this procedure that runs, whatever the configuration names.
    """
    from rig.plans.script_file import script_in

    script = sys.modules["__main__"]
    parser = argparse.ArgumentParser(description=script.__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    _add_config(parser)
    _add_run(parser)
    options = parser.parse_args()
    options.script = script_in(script, procedure)
    return guarded(lambda: _run(options))


def _run(options: argparse.Namespace) -> int:
    from rig.commands.run import run

    return run(
        options.config,
        options.overrides,
        options.out,
        script=options.script,
        assume_yes=options.yes,
        as_json=options.json,
        page=page_arguments.wish(options),
    )


def _resume(options: argparse.Namespace) -> int:
    from rig.commands.run import resume

    return resume(
        options.run_folder,
        script=options.script,
        connect=options.connect,
        assume_yes=options.yes,
        as_json=options.json,
        page=page_arguments.wish(options),
    )


def _watch(options: argparse.Namespace) -> int:
    from rig.commands.watch import watch

    return watch(
        options.run_folder,
        page_arguments.PageWish(options.page_address, page_arguments.token_said(options)),
        options.speed,
    )


def _plan(options: argparse.Namespace) -> int:
    from rig.commands.plan import plan

    return plan(options.config, options.overrides, options.script, as_json=options.json)


def _check(options: argparse.Namespace) -> int:
    from rig.commands.check import check

    return check(options.config, options.overrides, options.script)


def _record(options: argparse.Namespace) -> int:
    from rig.commands.record import record

    return record(options.config, options.overrides, options.out, options.duration_s)


def _allan(options: argparse.Namespace) -> int:
    from rig.commands.allan import allan

    return allan(options.run, options.plot, as_json=options.json)


def _reversal(options: argparse.Namespace) -> int:
    from rig.commands.reversal import reversal

    return reversal(options.runs, options.out, as_json=options.json)


def _report(options: argparse.Namespace) -> int:
    from rig.commands.report import report

    forms = {"pdf": options.pdf, "dcc": options.dcc}
    return report(options.run, options.out, options.overrides, options.reversal, **forms, history=options.history)


def _export(options: argparse.Namespace) -> int:
    from rig.commands.export import export

    return export(options.run, options.format, options.out, options.at_temperature)


def _study(options: argparse.Namespace) -> int:
    from rig.commands.study import list_studies, run_study

    if options.name is None:
        return list_studies()
    return run_study(
        options.name,
        options.out,
        seed=options.seed,
        runs=options.runs,
        jobs=options.jobs,
        dask=options.dask,
        table_format=options.format,
    )


def _board_info(options: argparse.Namespace) -> int:
    from rig.commands.board import info

    return info(options.config, options.overrides, as_json=options.json)


def _board_read(options: argparse.Namespace) -> int:
    from rig.commands.board import read

    return read(options.config, options.overrides, options.sensor, as_json=options.json)


def _board_write(options: argparse.Namespace) -> int:
    from rig.commands.board import write

    return write(options.config, options.overrides, options.result, options.sensor, assume_yes=options.yes)


def _board_erase(options: argparse.Namespace) -> int:
    from rig.commands.board import erase

    return erase(options.config, options.overrides, options.sensor, assume_yes=options.yes)


def _board_flash(options: argparse.Namespace) -> int:
    from rig.commands.flash import flash

    drive = Path(options.drive) if options.drive else None
    return flash(options.probe, drive, by_drive=options.drive is not None, assume_yes=options.yes)


def _kvh_info(options: argparse.Namespace) -> int:
    from rig.commands.kvh import info

    return info(options.target, options.overrides, options.baud, as_json=options.json)


def _world(options: argparse.Namespace) -> int:
    from rig.commands.laboratory import foreground_laboratory
    from rig.config.load import load

    return foreground_laboratory(load(options.config, options.overrides, sections=None).text)
