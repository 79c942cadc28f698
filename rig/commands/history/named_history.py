"""The history that a command names, itself or by a configuration file."""

import argparse
from pathlib import Path


def add_history(parser: argparse._ActionsContainer) -> None:
    """Add the argument `--history`."""
    parser.add_argument(
        "--history",
        metavar="PLACE",
        help="an SQLite file, a postgresql:// URL, or a configuration file that names one (default: RIG_HISTORY, "
        "else the user's own)",
    )


def read_history_name(name_or_file: str | None) -> str | None:
    """Return the file or URL of the named history; None if none is named. Raise Refused as `load` does."""
    if name_or_file is None or not name_or_file.endswith((".yaml", ".yml")):
        return name_or_file
    from rig.config.load import load

    return load(Path(name_or_file), sections=None).config.history.url
