"""Arguments of several commands: the configuration, changes of its values, a script in place of its procedure."""

import argparse
from argparse import ArgumentParser, ArgumentTypeError, _ActionsContainer
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rig.errors import Refused

if TYPE_CHECKING:
    from rig.config.column_map import ColumnMap

RUN_SUFFIXES = (".h5", ".hdf5", ".json")
TABLE_SUFFIXES = (".csv", ".csv.gz", ".txt")


def add_config(parser: ArgumentParser) -> None:
    """Add the arguments `CONFIG` and `--set`."""
    parser.add_argument("config", type=Path, metavar="CONFIG", help="YAML configuration file")
    add_set(parser, "change one value of the file")


def add_set(parser: ArgumentParser, text: str, metavar: str = "PATH=VALUE") -> None:
    """Add the argument `--set`, which may be repeated."""
    parser.add_argument("--set", action="append", default=[], metavar=metavar, dest="overrides", help=text)


def add_script(parser: ArgumentParser) -> None:
    """Add the argument `--script`."""
    parser.add_argument("--script", type=Path, metavar="FILE", help="your own procedure, in place of the file's")


def add_run(
    parser: _ActionsContainer, name: str, text: str, *, metavar: str = "RUN", nargs: str | None = None, **more: Any
) -> None:
    """Add an argument that names a run; `latest` is this user's last one."""
    text += "; latest: your last one"
    action = parser.add_argument(name, type=parse_run, metavar=metavar, nargs=nargs, help=text, **more)
    action.completer = _complete_runs  # pyrefly: ignore[missing-attribute]  # as argcomplete asks for it


def parse_run(text: str) -> Path:
    """Return the path that an argument names; raise ArgumentTypeError for `latest` without a run."""
    from rig.data.latest_run import meant_run

    try:
        return meant_run(text)
    except Refused as error:
        raise ArgumentTypeError(f"{text}: {error.what}. {error.remedy}") from None


def _complete_runs(prefix: str, **_: Any) -> Iterator[str]:
    from argcomplete.completers import FilesCompleter

    from rig.data.latest_run import LATEST

    yield LATEST
    yield from FilesCompleter()(prefix)


def add_columns(parser: _ActionsContainer) -> None:
    """Add the argument `--columns`, the same for all commands that read files of other programs."""
    parser.add_argument(
        "--columns",
        type=Path,
        metavar="YAML",
        help="map of the files' columns, if they have names and units of their own; rig look FILE --write YAML writes "
        "one",
    )


def read_column_map(path: Path | None) -> "ColumnMap":
    """Return the map that `--columns` names; an empty one without the option. Raise as `load_as` does."""
    from rig.config.column_map import MAP_REMEDY, STANDARD_NAMES, ColumnMap
    from rig.config.load import load_as

    return STANDARD_NAMES if path is None else load_as(ColumnMap, path, MAP_REMEDY)


def find_logs(path: Path) -> list[Path]:
    """Return the logs at a path: the file itself, or all in a folder of `rig record`; an empty list for a run."""
    from rig.observation.formats.sample_files import is_in_format, whole

    if is_in_format(path):
        return [path]
    if path.is_dir():
        tables = (file for file in path.iterdir() if file.name.lower().endswith(TABLE_SUFFIXES))
        return [] if any(path.glob("*.h5")) else sorted(tables)
    return [path] if whole(path).is_file() and path.suffix.lower() not in RUN_SUFFIXES else []


def add_json(parser: _ActionsContainer) -> None:
    """Add the argument `--json`."""
    parser.add_argument("--json", action="store_true", help="print JSON")


def add_history(parser: argparse._ActionsContainer) -> None:
    """Add the argument `--history`."""
    parser.add_argument(
        "--history",
        metavar="PLACE",
        help="an SQLite file, a postgresql:// URL, or a configuration file that names one (default: RIG_HISTORY, "
        "else the user's own)",
    )


def read_history_name(name_or_file: str | None) -> str | None:
    """Return a history's file or URL: the name itself or, for a configuration's name, the URL in it; None without one.

    Raise Refused as `load` does.
    """
    if name_or_file is None or not name_or_file.endswith((".yaml", ".yml")):
        return name_or_file
    from rig.config.load import load

    return load(Path(name_or_file), sections=None).config.history.url
