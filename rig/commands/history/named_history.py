"""The history that somebody names in a command: itself, or by the configuration that names it."""

import argparse
from pathlib import Path


def add_history(parser: argparse._ActionsContainer) -> None:
    """`--history PLACE`."""
    parser.add_argument(
        "--history",
        metavar="PLACE",
        help="an SQLite file, a postgresql:// URL, or a configuration file that names one (default: RIG_HISTORY, "
        "else the user's own)",
    )


def named_history(given: str | None) -> str | None:
    """A file's name or a URL, None where nothing is said. Raises Refused as `load`."""
    if given is None or not given.endswith((".yaml", ".yml")):
        return given
    from rig.config.load import load

    return load(Path(given), sections=None).config.history.url
