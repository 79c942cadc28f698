"""`rig demo`: a calibration in a simulated laboratory, and files for further steps."""

import sys
from argparse import ArgumentParser, Namespace
from pathlib import Path

from rig.commands.config_arguments import add_json
from rig.commands.page_arguments import add_page
from rig.config.files.supplied_files import NAMES, locate_supplied
from rig.errors import Refused
from rig.station.plain_text import say

DEMO = "configs/demo.yaml"


def add(parser: ArgumentParser) -> None:
    """Add the arguments of `rig demo`."""
    parser.add_argument(
        "--files", type=Path, metavar="DIR", help="only copy the supplied configurations and examples into this folder"
    )
    parser.add_argument("--out", type=Path, metavar="DIR", help="run folder (default: a new one in runs)")
    add_json(parser)
    add_page(parser)
    parser.set_defaults(overrides=[], script=None, yes=False, other_board=[], notify=None)


def run(options: Namespace) -> int:
    """Run the demonstration and return the exit status of `rig run`; with `--files` copy the files and return 0.

    Raise Refused `files_not_copied`, and what `rig run` raises.
    """
    if options.files is not None:
        return _copy(options.files)
    from rig.commands.measure.run import run as run_configuration

    say("the demonstration: a simulated arm turns a simulated LSM9DS1 gyroscope; about ten seconds", sys.stderr)
    options.config = locate_supplied(DEMO)
    return run_configuration(options)


def _copy(folder: Path) -> int:
    """Copy each supplied file to the folder, unless it exists there; return 0. Raise Refused `files_not_copied`."""
    import shutil

    copied = existing = 0
    try:
        for source, target in _pairs(folder):
            if target.exists() or target.is_symlink():
                existing += 1
                continue
            target.parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(source, target)
            copied += 1
    except OSError as error:
        what = f"{folder} cannot be written: {error.strerror or error}"
        raise Refused("files_not_copied", what, "Name another folder with --files") from error
    say(f"{copied} files copied into {folder}, {existing} existing ones kept")
    say(f"next: rig plan {folder / DEMO}")
    return 0


def _pairs(folder: Path) -> list[tuple[Path, Path]]:
    """Return every supplied file with its path in the folder."""
    pairs = []
    for name in NAMES:
        source = locate_supplied(name)
        files = sorted(source.rglob("*")) if source.is_dir() else [source]
        pairs.extend(
            (file, folder / name / file.relative_to(source) if source.is_dir() else folder / name)
            for file in files
            if file.is_file() and "__pycache__" not in file.parts
        )
    return pairs
