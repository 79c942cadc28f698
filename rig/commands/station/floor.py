"""`rig floor`: several rigs that share a history, on one page."""

import sys
from argparse import ArgumentParser, Namespace

from rig.commands.history.named_history import add_history, named_history
from rig.commands.page_arguments import PageWish, add_place, token_said, wait_for_interrupt
from rig.errors import Refused
from rig.station.plain_text import say


def add(parser: ArgumentParser) -> None:
    """The arguments of `rig floor`."""
    add_history(parser)
    add_place(parser)


def run(options: Namespace) -> int:
    """Show what each rig does now, until Ctrl-C; the history is only read. Returns 0.

    Raises Refused `page_address`, `no_history`, and as `open_history`.
    """
    from rig.floor.feed import looking
    from rig.history.storage.address import own_history_address
    from rig.history.storage.continuity import is_there
    from rig.history.store import open_history
    from rig.page.server.control import Control
    from rig.page.server.serving import Page, serving

    place = own_history_address(named_history(options.history))
    if place is None or not is_there(place):
        what = "the history is off" if place is None else f"there is no history {place.label}"
        raise Refused("no_history", what, "Name the history that the rigs share: rig floor --history URL")
    with open_history(place):
        pass  # one that cannot be read is refused before there is a page
    address = PageWish(options.page_address, token_said(options)).address()
    with looking(place) as feed, serving(feed, Control(may_answer=False), None, address, Page("floor.html")) as url:
        say(f"page: {url}", sys.stderr)
        wait_for_interrupt()
    return 0
