"""The commands that plan, look, move and write, as functions for Python: what they say, ask and refuse is the same."""

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

    `changes` are values to use in place of the file's: `{"procedure.speed_deg_s": 90}`; `script` is a procedure of
    one's own. Returns the plan: angles in rad, speeds in rad/s, times in s. Raises Refused by name for an error in the
    file, and for a motion that breaks a limit.
    """
    from rig.commands.measure.plan import add, planned
    from rig.report.terminal.plan_table import print_plan

    found = planned(_options("plan", add, [*_changed(changes), *_script(script)], config))
    print_plan(found, as_json=False)
    return found


def check(config: str | Path, changes: Changes | None = None, *, script: str | Path | None = None) -> bool:
    """Connect and look, as `rig check` does, and print what is there and what is missing; nothing moves.

    Returns whether a run could start. Takes `changes` and `script` as `plan` does; raises Refused for an error in the
    file.
    """
    from rig.commands.measure.check import add
    from rig.commands.measure.check import run as looked

    return looked(_options("check", add, [*_changed(changes), *_script(script)], config)) == 0


def run(
    config: str | Path,
    changes: Changes | None = None,
    *,
    script: str | Path | None = None,
    out: str | Path | None = None,
    yes: bool = False,
    other_boards: Sequence[str] = (),
) -> Run:
    """Run a calibration, as `rig run` does, with the same pre-flight and the same question; prints what it prints.

    The arm moves only if the operator at the terminal types yes, or if the caller says that by `yes=True`; a notebook
    has no terminal. Ctrl-C stops the arm and keeps the data. `out` is the run folder, by default a new one; `changes`
    and `script` are as in `plan`; `other_boards` are serial numbers of sensors that were moved to another board.
    Returns the run; its verdict is `rig.load_result(run.path).verdict`. Raises Refused where nothing has moved
    (`not_confirmed` without agreement), Fault where the arm was stopped, KeyboardInterrupt. In a script the call
    stands below `if __name__ == "__main__":`, for the arm's process reads the script as well.
    """
    from rig.commands.endings import ending_by_interrupt
    from rig.commands.measure.carry_out import carry_out
    from rig.commands.measure.run import add, begun

    if multiprocessing.current_process().name != "MainProcess":
        raise Refused(
            "no_main_guard",
            "the process that talks to the arm reads your script too, and has reached the call of rig.run itself",
            'Put the call below a line  if __name__ == "__main__":',
        )
    if threading.current_thread() is not threading.main_thread():
        raise Refused("not_main_thread", "only the main thread hears Ctrl-C, which stops the arm", "Call it from there")
    words = [*_changed(changes), *_script(script), *([] if out is None else ["--out", str(out)])]
    words += [word for serial_number in other_boards for word in ("--other-board", serial_number)]
    options = _options("run", add, words, config)
    with ending_by_interrupt(), begun(options) as (folder, found):
        moved = frozenset(options.other_board)
        carry_out(folder, found, assume_yes=yes, moved=moved, as_json=False, page=None)
    return load(folder)


def write_certificate(
    of: Run | str | Path,
    changes: Changes | None = None,
    *,
    pdf: bool = False,
    dcc: bool = False,
    out: str | Path | None = None,
    history: str | None = None,
) -> list[Path]:
    """Write the certificate of a finished run again, as `rig report` does, and say which files.

    HTML always; a PDF and the digital certificate (XML) if wanted. `changes` say something else on it:
    `{"certificate.customer": "Example"}`. `out` is a folder, by default the run's; `history` where the certificate is
    noted, by default the user's own. Returns the files. Raises Refused as `rig report` does.
    """
    from rig.commands.documents.report import add, documents

    words = [*_changed(changes), *(["--pdf"] if pdf else []), *(["--dcc"] if dcc else [])]
    words += [] if out is None else ["--out", str(out)]
    words += [] if history is None else ["--history", history]
    files, left_out = documents(_options("report", add, words, _folder(of)))
    if left_out:
        raise left_out[0]
    return files


def export(of: Run | str | Path, format: str, *, out: str | Path | None = None) -> list[Path]:
    """Write readings or calibrations of a run in the files of other programs, as `rig export` does; says which files.

    `format` is one of csv, parquet, mat, ros2, imucal, px4, ardupilot, kalibr; `out` a folder, by default one in the
    run's. Returns the files. Raises Refused `bad_option` for another format, and as `rig export` does.
    """
    from rig.commands.documents.export import add, files

    if format not in FORMATS:
        raise Refused("bad_option", f"there is no format {format!r}", f"Choose one of: {', '.join(FORMATS)}")
    words = ["--format", format, *([] if out is None else ["--out", str(out)])]
    return files(_options("export", add, words, _folder(of)))


def _options(command: str, add: Callable[[ArgumentParser], None], words: Sequence[str], about: str | Path) -> Namespace:
    """The arguments as the command takes them, so that what is not said here is as it is there."""
    parser = ArgumentParser(prog=f"rig {command}")
    add(parser)
    return parser.parse_args([*words, "--", str(about)])


def _changed(changes: Changes | None) -> list[str]:
    """`--set` of each change, its value in YAML on one line."""
    words = []
    for path, value in (changes or {}).items():
        try:
            text = yaml.safe_dump(value, default_flow_style=True, width=float("inf"), allow_unicode=True)
        except yaml.YAMLError as error:
            why = f"{path}: a configuration has no value of type {type(value).__name__}"
            raise Refused("bad_option", why, "Give a number, a text, a list or a dictionary") from error
        words += ["--set", f"{path}={text.removesuffix('...' + chr(10)).strip()}"]
    return words


def _script(script: str | Path | None) -> list[str]:
    return [] if script is None else ["--script", str(script)]


def _folder(of: Run | str | Path) -> str | Path:
    return of.path if isinstance(of, Run) else of
