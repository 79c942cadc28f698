"""`rig floor`: several rigs that share a history, on one page."""

import sys
from argparse import ArgumentParser, Namespace

from rig.commands.config_arguments import add_history, read_history_name
from rig.commands.page_arguments import PageWish, add_page_address, read_page_token, wait_for_interrupt
from rig.errors import Refused
from rig.station.plain_text import say


def add(parser: ArgumentParser) -> None:
    """Add the arguments of `rig floor`."""
    add_history(parser)
    add_page_address(parser)


def run(options: Namespace) -> int:
    """Show the state of each rig until Ctrl-C; the history is only read.

    Return 0. Raise Refused `page_address`, `no_history`, and what `open_history` raises.
    """
    from rig.floor.floor_feed import polled_feed
    from rig.history.storage.address import default_history_address
    from rig.history.storage.continuity import is_there
    from rig.history.store import open_history
    from rig.page.server.control import Control
    from rig.page.server.serving import Page, serving

    shared = default_history_address(read_history_name(options.history))
    if shared is None or not is_there(shared):
        what = "the history is off" if shared is None else f"there is no history {shared.label}"
        raise Refused("no_history", what, "Name the history that the rigs share: rig floor --history URL")
    with open_history(shared):
        pass  # an unreadable history is refused before there is a page
    address = PageWish(options.page_address, read_page_token(options)).address()
    with (
        polled_feed(shared) as feed,
        serving(feed, Control(may_answer=False), None, address, Page("floor.html")) as url,
    ):
        say(f"page: {url}", sys.stderr)
        wait_for_interrupt()
    return 0
