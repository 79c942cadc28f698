"""The commands that plan, check, run and write, as Python functions with the same output and refusals."""

import multiprocessing
import threading
from argparse import ArgumentParser, Namespace
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import yaml

from rig.errors import Refused
from rig.notebook.runs import Run, load
from rig.report.exports.formats import FORMATS

if TYPE_CHECKING:
    from rig.report.terminal.plan_table import DryRun

Changes = Mapping[str, object]


def plan(config: str | Path, changes: Changes | None = None, *, script: str | Path | None = None) -> "DryRun":
    """Plan a calibration and print it, as `rig plan` does; connects to nothing.

    `changes` are values that replace the file's: `{"procedure.speed_deg_s": 90}`; `script` is a file with your own
    procedure. Return the plan: angles in rad, speeds in rad/s, times in s. Raise Refused for an error in the file, and
    for a motion that breaks a limit.
    """
    from rig.commands.measure.plan import add, make_plan
    from rig.report.terminal.plan_table import print_plan

    dry_run = make_plan(_parse("plan", add, [*_set_words(changes), *_script_words(script)], config))
    print_plan(dry_run, as_json=False)
    return dry_run


def check(config: str | Path, changes: Changes | None = None, *, script: str | Path | None = None) -> bool:
    """Connect and check, as `rig check` does, and print the devices present and missing; nothing moves.

    Return whether a run could start. `changes` and `script` are as in `plan`. Raise Refused for an error in the file.
    """
    from rig.commands.measure.check_devices import add
    from rig.commands.measure.check_devices import run as run_check

    return run_check(_parse("check", add, [*_set_words(changes), *_script_words(script)], config)) == 0


def run(
    config: str | Path,
    changes: Changes | None = None,
    *,
    script: str | Path | None = None,
    out: str | Path | None = None,
    yes: bool = False,
    other_boards: Sequence[str] = (),
) -> Run:
    """Run a calibration as `rig run` does: the same pre-flight checks, the same question, the same output.

    The arm moves only if the operator at the terminal types `go`, or if the caller agrees by `yes=True`; a notebook has
    no terminal. Ctrl-C stops the arm and keeps the data. `out` is the run folder, by default a new one; `changes` and
    `script` are as in `plan`; `other_boards` are serial numbers of sensors that were moved to another board. Return the
    run; its verdict is `rig.load_result(run.path).verdict`. Raise Refused if nothing has moved (`not_confirmed` without
    agreement), Fault if the arm was stopped, KeyboardInterrupt. In a script the call must be below `if __name__ ==
    "__main__":`, as the arm's process reads the script as well.
    """
    from rig.commands.command_signals import ending_by_interrupt
    from rig.commands.measure.carry_out import carry_out
    from rig.commands.measure.run import add, prepare_run

    if multiprocessing.current_process().name != "MainProcess":
        raise Refused(
            "no_main_guard",
            "the process that talks to the arm reads your script too, and has reached the call of rig.run itself",
            'Put the call below a line  if __name__ == "__main__":',
        )
    if threading.current_thread() is not threading.main_thread():
        raise Refused("not_main_thread", "only the main thread hears Ctrl-C, which stops the arm", "Call it from there")
    words = [*_set_words(changes), *_script_words(script), *([] if out is None else ["--out", str(out)])]
    words += [word for serial_number in other_boards for word in ("--other-board", serial_number)]
    options = _parse("run", add, words, config)
    with ending_by_interrupt(), prepare_run(options) as (folder, configured):
        moved = frozenset(options.other_board)
        carry_out(folder, configured, assume_yes=yes, moved=moved, as_json=False, page=None)
    return load(folder)


def write_certificate(
    run: Run | str | Path,
    changes: Changes | None = None,
    *,
    pdf: bool = False,
    dcc: bool = False,
    out: str | Path | None = None,
    history: str | None = None,
) -> list[Path]:
    """Write the certificate of a finished run again, as `rig report` does, and print the file names.

    HTML is always written; a PDF and the digital certificate (XML) on request. `changes` replace entries of the
    certificate: `{"certificate.customer": "Example"}`. `out` is a folder, by default the run's; `history` is the
    history in which the certificate is entered, by default the user's own. Return the files. Raise Refused as `rig
    report` does.
    """
    from rig.commands.documents.report import add, write_documents

    words = [*_set_words(changes), *(["--pdf"] if pdf else []), *(["--dcc"] if dcc else [])]
    words += [] if out is None else ["--out", str(out)]
    words += [] if history is None else ["--history", history]
    files, left_out = write_documents(_parse("report", add, words, _folder(run)))
    if left_out:
        raise left_out[0]
    return files


def export(
    run: Run | str | Path, format: str, *, out: str | Path | None = None, columns: str | Path | None = None
) -> list[Path]:
    """Write readings or calibrations of a run in other programs' formats, as `rig export`; print the file names.

    `format` is one of csv, parquet, mat, ros2, imucal, px4, ardupilot, kalibr; `out` is a folder, by default one in the
    run's. `run` may be a log of another program, and `columns` is then the file that describes its columns. Return the
    files. Raise Refused `bad_option` for another format, and what `rig export` raises.
    """
    from rig.commands.documents.export import add, export_files

    if format not in FORMATS:
        raise Refused("bad_option", f"there is no format {format!r}", f"Choose one of: {', '.join(FORMATS)}")
    words = ["--format", format, *([] if out is None else ["--out", str(out)])]
    words += [] if columns is None else ["--columns", str(columns)]
    return export_files(_parse("export", add, words, _folder(run)))


def _parse(command: str, add: Callable[[ArgumentParser], None], words: Sequence[str], about: str | Path) -> Namespace:
    """Return `words` as the command line parses them, so that omitted arguments get the command's defaults."""
    parser = ArgumentParser(prog=f"rig {command}")
    add(parser)
    return parser.parse_args([*words, "--", str(about)])


def _set_words(changes: Changes | None) -> list[str]:
    """Return `--set` for each change, with its value in one line of YAML. Raise Refused `bad_option`."""
    words = []
    for path, value in (changes or {}).items():
        try:
            text = yaml.safe_dump(value, default_flow_style=True, width=float("inf"), allow_unicode=True)
        except yaml.YAMLError as error:
            why = f"{path}: a configuration has no value of type {type(value).__name__}"
            raise Refused("bad_option", why, "Give a number, a text, a list or a dictionary") from error
        words += ["--set", f"{path}={text.removesuffix('...' + chr(10)).strip()}"]
    return words


def _script_words(script: str | Path | None) -> list[str]:
    return [] if script is None else ["--script", str(script)]


def _folder(run: Run | str | Path) -> str | Path:
    return run.path if isinstance(run, Run) else run
