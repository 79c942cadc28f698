"""`rig run`: the procedure a configuration names, or one in a script of its own."""

from argparse import ArgumentParser, Namespace
from pathlib import Path
from typing import TYPE_CHECKING

from rig.commands.config_arguments import add_config, add_script
from rig.commands.page_arguments import add_page, wish

if TYPE_CHECKING:
    from rig.commands.configured import Configured


def add(parser: ArgumentParser, *, script: bool = True) -> None:
    """The arguments of `rig run`, and without `--script` those of a procedure's script that is run by itself."""
    add_config(parser)
    if script:
        add_script(parser)
    parser.add_argument("--out", type=Path, metavar="DIR", help="run folder (default: a new one under output.folder)")
    add_outcome(parser)


def add_outcome(parser: ArgumentParser) -> None:
    """The arguments of `rig run` and `rig resume` alike."""
    parser.add_argument("--yes", action="store_true", help="do not ask before the arm moves")
    parser.add_argument(
        "--other-board",
        action="append",
        default=[],
        metavar="SERIAL",
        help="the sensor of this serial number is on another board than when it was last calibrated, and that is right",
    )
    parser.add_argument("--json", action="store_true", help="print result.json instead of tables")
    add_page(parser)


def run(options: Namespace) -> int:
    """Run the procedure in a new run folder; on a page too if wanted. Returns 0 passed, 1 verdict failed."""
    page = wish(options)
    from rig.commands.carry_out import carry_out

    folder, found = begun(options)
    moved = frozenset(options.other_board)
    return carry_out(folder, found, assume_yes=options.yes, moved=moved, as_json=options.json, page=page)


def begun(options: Namespace) -> "tuple[Path, Configured]":
    """A new run folder, and what is to be run in it. Raises Refused as `configured` and `new_folder`."""
    from rig.commands.configured import configured
    from rig.data.own_texts import note_own
    from rig.data.run_folder import new_folder

    found = configured(options.config, options.overrides, options.script)
    folder = new_folder(options.out, found.loaded, found.script.text, found.script.identity)
    note_own(found.loaded.text, found.script.text)
    return folder, found
