"""Arguments of several commands: the configuration, changes to it, a script in place of the procedure it names."""

from argparse import ArgumentParser, _ActionsContainer
from pathlib import Path


def add_config(parser: ArgumentParser) -> None:
    """`CONFIG` and `--set`."""
    parser.add_argument("config", type=Path, metavar="CONFIG", help="YAML configuration file")
    add_set(parser, "change one value of the file")


def add_set(parser: ArgumentParser, text: str, metavar: str = "PATH=VALUE") -> None:
    """`--set`, any number of times."""
    parser.add_argument("--set", action="append", default=[], metavar=metavar, dest="overrides", help=text)


def add_script(parser: ArgumentParser) -> None:
    """Add the argument `--script`."""
    parser.add_argument("--script", type=Path, metavar="FILE", help="a procedure of your own, in place of the file's")


def add_json(parser: _ActionsContainer) -> None:
    """Add the argument `--json`."""
    parser.add_argument("--json", action="store_true", help="for machines")
