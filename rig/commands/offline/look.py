"""`rig look FILE`: the contents of another program's log, its possible solutions, and the map of its columns."""

import shlex
from argparse import ArgumentParser, Namespace
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rig.commands.config_arguments import add_columns, find_logs, read_column_map
from rig.errors import Refused
from rig.errors.quoting import printable
from rig.station.plain_text import say

if TYPE_CHECKING:
    from rig.analysis.external.convention import Convention
    from rig.analysis.log_contents import LookedFile
    from rig.config.column_map import ColumnMap
    from rig.report.terminal.look_lines import TriedSolutions

PLACEHOLDER = "columns.yaml"  # the name of a map in the commands that are printed
HEAD = """\
# The columns of {files}, as `rig look` found them: check the units.
# Every command that reads these files takes it with --columns.
"""


def add(parser: ArgumentParser) -> None:
    """Add the arguments of `rig look`."""
    parser.add_argument(
        "files",
        type=Path,
        nargs="+",
        metavar="FILE",
        help="a log of readings (CSV, text, a bag, .ulg, .mat), one of attitudes, or one of each",
    )
    add_columns(parser)
    parser.add_argument("--write", type=Path, metavar="NEW", help="write the map of the columns to a new file")


def run(options: Namespace) -> int:
    """Print the content of the files and the commands that can use them; with `--write` save their column map.

    Return 0. Raise Refused `bad_option`, `no_latest_run`, `configuration_not_written`, or any that the files' readers
    raise.
    """
    from rig.analysis.log_contents import correct_rate_unit, is_incomplete, join_maps, look_at

    if len(options.files) > 2:
        raise Refused("bad_option", f"{len(options.files)} files are given", "Give a log, or a log and its attitudes")
    if options.write is not None and options.columns is not None:
        raise Refused("bad_option", "--write makes a map, and --columns gives one", "Give one of them")
    for path in options.files:
        _refuse_run(path)
    stated = None if options.columns is None else read_column_map(options.columns)
    looks = [look_at(path, stated) for path in options.files]
    convention = _find_convention(looks)
    if convention is not None and stated is None:
        looks = [correct_rate_unit(looked, convention.ratio) for looked in looks]
    columns = join_maps(looks)
    _print(looks, convention, columns, stated, options.write or options.columns)
    if options.write is not None:
        _write(options.write, looks, columns)
    if is_incomplete(columns):
        again = shlex.join(["rig", "look", *map(str, options.files), "--columns", str(options.write or PLACEHOLDER)])
        print(printable(f'replace each "?" in the map, then: {again}'))
    return 0


def _refuse_run(path: Path) -> None:
    """Raise Refused `bad_option` for a run of the rig, which other commands read, and what `meant_run` raises."""
    from rig.data.latest_run import meant_run
    from rig.data.run_folder import recordings

    path = meant_run(path)
    run = path if path.is_dir() else path.parent
    if path.exists() and not find_logs(path) and recordings(run, "raw"):
        show, solve, export = (f"rig {name} {shlex.quote(str(run))}" for name in ("show", "solve", "export"))
        raise Refused(
            "bad_option",
            f"{path} is a run of this program, not a log of another one",
            f"For its result: {show} --all; to solve it again: {solve}; for its readings as tables: {export} "
            "--format csv",
        )


def _print(
    looks: "Sequence[LookedFile]",
    convention: "Convention | None",
    columns: dict[str, Any],
    stated: "ColumnMap | None",
    named: Path | None,
) -> None:
    """Print the files and the commands that can use them. Enter the quaternions' `convention` into `columns`."""
    from rig.analysis.log_contents import find_pair
    from rig.data.quantity import RATE
    from rig.report.terminal.look_lines import describe_convention, describe_file, describe_solutions

    for looked in looks:
        for line in describe_file(looked):
            say(line)
    log, reference = find_pair(looks)
    if log is not None and reference is not None and RATE in log.quantities:
        for line in describe_convention(convention, is_order_named=_names_order(reference)):
            say(line)
        if convention is not None and convention.inverse is not None and stated is None:
            _adopt(columns, inverse=convention.inverse, scalar_last=convention.scalar_last)
    tried = _try_solutions(log, reference, convention, stated, columns)
    needs_map = bool(columns) or stated is not None
    name = (named or Path(PLACEHOLDER)) if needs_map else None
    for line in describe_solutions(log, reference, replace(tried, columns=name)):
        print(printable(line))  # not wrapped: a command must stay in one line
    if needs_map and named is None:
        say(f"--write {PLACEHOLDER} writes the map of these columns")


def _names_order(reference: "LookedFile") -> bool:
    """Return whether the file names the four numbers of the quaternion, by headings or by its format."""
    from rig.data.recording.motion_file import QUATERNION

    headings = () if reference.layout is None else reference.layout.headings
    return reference.layout is None or all(name in headings for name in QUATERNION)


def _find_convention(looks: "Sequence[LookedFile]") -> "Convention | None":
    """Return the convention of the attitudes' quaternions, if a gyroscope's readings show it."""
    from rig.analysis.external.convention import find_convention
    from rig.analysis.log_contents import find_pair

    log, reference = find_pair(looks)
    if log is None or log.samples is None or reference is None or reference.attitudes is None:
        return None
    return find_convention(log.samples, reference.attitudes, is_order_named=_names_order(reference))


def _try_solutions(
    log: "LookedFile | None",
    reference: "LookedFile | None",
    convention: "Convention | None",
    stated: "ColumnMap | None",
    columns: Mapping[str, Any],
) -> "TriedSolutions":
    """Return the solutions that the log permits: Allan deviation, turns, attitudes."""
    from rig.analysis.log_trials import find_allan_obstacle, try_attitudes, try_turns
    from rig.config.column_map import ColumnMap
    from rig.data.quantity import RATE
    from rig.report.terminal.look_lines import TriedSolutions

    if log is None or log.samples is None:
        return TriedSolutions(None, None, "", finds_clock=False, turns=None, attitudes=None)
    column_map = stated if stated is not None else ColumnMap.model_validate(dict(columns))
    turns = try_turns(log.path, column_map) if RATE in log.quantities else None
    up, finds_clock, attitudes = "" if convention is None else convention.up, False, None
    if reference is not None and reference.attitudes is not None:
        rows, time_s = reference.attitudes, log.samples.time_s
        finds_clock = not (rows["start_s"].min() < time_s[-1] and rows["end_s"].max() > time_s[0])
        sensors = [quantity.sensor for quantity in log.quantities]
        attitudes = try_attitudes(
            log.path, reference.path, column_map, up or "+z", find_clock=finds_clock, sensors=sensors
        )
    return TriedSolutions(
        None, find_allan_obstacle(log.samples), up, finds_clock=finds_clock, turns=turns, attitudes=attitudes
    )


def _adopt(columns: dict[str, Any], *, inverse: bool, scalar_last: bool) -> None:
    """Change the map `columns` of a reference to the convention of its quaternions.

    `inverse`: the quaternions rotate in the inverse direction. `scalar_last`: their scalar is the last of four numbers.
    """
    from rig.data.recording.motion_file import QUATERNION

    if inverse:
        columns["motion_inverse"] = True
    if scalar_last:
        motion = dict(columns.get("motion", {}))
        read = [motion.get(name, {"column": name}) for name in QUATERNION]
        columns["motion"] = {**motion, **dict(zip(("qx", "qy", "qz", "qw"), read, strict=True))}


def _write(path: Path, looks: "Sequence[LookedFile]", columns: Mapping[str, Any]) -> None:
    """Write the column map, if one is needed, to a new file. Raise Refused `configuration_not_written`."""
    import yaml

    from rig.config.files.safe_writing import write_new

    if not columns:
        is_read = any(looked.samples is not None or looked.attitudes is not None for looked in looks)
        say("no map is needed: the columns have the rig's own names" if is_read else "not written: no column is known")
        return
    if path.exists() or path.is_symlink():
        raise Refused("configuration_not_written", f"{path} is there already", "Choose another with --write")
    files = " and ".join(looked.path.name for looked in looks)
    text = yaml.safe_dump(dict(columns), sort_keys=False, allow_unicode=True, default_flow_style=None, width=100)
    try:
        write_new(path, HEAD.format(files=files) + text)
    except OSError as error:
        raise Refused(
            "configuration_not_written", f"{path} cannot be written: {error}", "Choose another with --write"
        ) from error
    say(f"written: {path}")
