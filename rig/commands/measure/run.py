"""`rig run`: the procedure a configuration names, or one in a script of its own."""

import sys
from argparse import ArgumentParser, Namespace
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from rig.commands.config_arguments import add_config, add_script
from rig.commands.measure.notice import add_notice, noticed
from rig.commands.page_arguments import add_page, wish
from rig.station.plain_text import say

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
    add_notice(parser)
    add_page(parser)


def run(options: Namespace) -> int:
    """Run the procedure in a new run folder; on a page too if wanted. Returns 0 passed, 1 verdict failed."""
    page = wish(options)
    with begun(options) as (folder, found):
        from rig.commands.measure.carry_out import (
            carry_out,  # which takes longer than all before, so the folder is said first
        )

        moved = frozenset(options.other_board)

        def work() -> int:
            return carry_out(folder, found, assume_yes=options.yes, moved=moved, as_json=options.json, page=page)

        return noticed(options.notify, folder, work)


@contextmanager
def begun(options: Namespace) -> "Iterator[tuple[Path, Configured]]":
    """A new run folder, and what is to be run in it; a simulated laboratory has an address of its own meanwhile.

    Of a run that nobody agreed to no folder is left: the same command can be given again. Raises Refused as
    `configured` and `new_folder`.
    """
    from rig.commands.configured import configured_here
    from rig.data.own_texts import note_own
    from rig.data.run_folder import discard, new_folder
    from rig.errors import Refused

    with configured_here(options.config, options.overrides, options.script) as found:
        folder = new_folder(options.out, found.loaded, found.script.text, found.script.identity)
        say(f"run folder: {folder}", sys.stderr)
        note_own(found.loaded.text, found.script.text)
        try:
            yield folder, found
        except Refused as refused:
            if refused.name in ("not_confirmed", "not_mounted"):
                discard(folder)
            raise
