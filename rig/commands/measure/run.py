"""`rig run`: the procedure of a configuration, or one in a script."""

import sys
from argparse import ArgumentParser, Namespace
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from rig.commands.config_arguments import add_config, add_script
from rig.commands.measure.notice import add_notice, notify_after
from rig.commands.page_arguments import add_page, read_page_wish
from rig.station.plain_text import say

if TYPE_CHECKING:
    from rig.commands.configured import Configured


def add(parser: ArgumentParser, *, script: bool = True) -> None:
    """Add the arguments of `rig run`, with `--script` only if `script` is set: a script that runs itself needs none."""
    add_config(parser)
    if script:
        add_script(parser)
    parser.add_argument("--out", type=Path, metavar="DIR", help="run folder (default: a new one under output.folder)")
    add_outcome(parser)


def add_outcome(parser: ArgumentParser) -> None:
    """Add the arguments that `rig run` and `rig resume` share."""
    parser.add_argument("--yes", action="store_true", help="do not ask before the arm moves")
    parser.add_argument(
        "--other-board",
        action="append",
        default=[],
        metavar="SERIAL",
        help="confirm that the sensor of this serial number was moved to another board since its last calibration",
    )
    parser.add_argument("--json", action="store_true", help="print result.json instead of tables")
    add_notice(parser)
    add_page(parser)


def run(options: Namespace) -> int:
    """Run the procedure in a new run folder, on a page too if requested. Return 0 if it passed, 1 if it failed."""
    page = read_page_wish(options)
    with prepare_run(options) as (folder, configured):
        from rig.commands.measure.carry_out import (
            carry_out,  # slow to import, so the folder is printed first
        )

        moved = frozenset(options.other_board)

        def work() -> int:
            return carry_out(folder, configured, assume_yes=options.yes, moved=moved, as_json=options.json, page=page)

        return notify_after(options.notify, folder, work)


@contextmanager
def prepare_run(options: Namespace) -> "Iterator[tuple[Path, Configured]]":
    """Yield a new run folder and its configuration; during the block a simulated laboratory has its own address.

    If the operator does not agree, the folder is removed, so that the same command can be repeated. Raise Refused
    `only_on_linux` for a simulated laboratory on another system, and what `load_configured` and `new_folder` raise.
    """
    from rig.commands.configured import open_configured
    from rig.commands.laboratory.only_on_linux import refuse_unless_linux
    from rig.data.run_folder import discard, new_folder
    from rig.data.user_texts import note_own
    from rig.errors import Refused

    with open_configured(options.config, options.overrides, options.script) as configured:
        if configured.loaded.simulated:
            refuse_unless_linux("the simulated laboratory")
        folder = new_folder(options.out, configured.loaded, configured.script.text, configured.script.identity)
        say(f"run folder: {folder}", sys.stderr)
        note_own(configured.loaded.text, configured.script.text)
        try:
            yield folder, configured
        except Refused as refused:
            if refused.name in ("not_confirmed", "not_mounted", "only_on_linux"):
                discard(folder)
            raise
