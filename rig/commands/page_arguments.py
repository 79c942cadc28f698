"""The operator's page on the command line: whether it is wanted, where, and what it may answer."""

import argparse
import os
import stat
import sys
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from rig.config.files.regular_file import UnfitFile, read_regular_file
from rig.errors import Refused
from rig.station.confirm import ask_operator
from rig.station.plain_text import say

if TYPE_CHECKING:
    from rig.page.about import About
    from rig.page.server.serving import PageAddress
    from rig.station.events import RunEvent
    from rig.station.station import Listener

Answer = Callable[[Sequence[str], str], bool]
TOKEN_VARIABLE = "RIG_PAGE_TOKEN"
LONGEST_TOKEN = 1000  # bytes of its file


@dataclass(frozen=True, slots=True)
class PageWish:
    """Where the page is wanted (`place` is ADDRESS or ADDRESS:PORT), and whether it may answer for the operator."""

    place: str | None = None
    token: str | None = None
    may_answer: bool = False

    def address(self) -> "PageAddress":
        """Raises Refused `page_address`."""
        from rig.page.server.serving import ADDRESS, PageAddress

        host, colon, port = (self.place or ADDRESS).rpartition(":")
        if not colon or (host.count(":") and not host.endswith("]")):  # no port, or an IPv6 address alone
            host, port = self.place or ADDRESS, ""
        if port and not (port.isascii() and port.isdecimal() and int(port) < 65536):
            raise Refused("page_address", f"{port!r} is no port", "Give --page-address ADDRESS:PORT")
        return PageAddress(host.strip("[]"), int(port) if port else None, self.token)


@dataclass(frozen=True, slots=True)
class OperatorsPage:
    """What a run needs of its page: who listens, who answers instead of the terminal, and how to wait at the end."""

    listeners: "tuple[Listener, ...]" = ()
    answer: Answer | None = None
    stay: Callable[[], None] = lambda: None


def add_page(parser: argparse.ArgumentParser) -> None:
    """Add the page's arguments of `rig run` and `rig resume`."""
    parser.add_argument("--page", action="store_true", help="show the run in a browser as well")
    parser.add_argument("--confirm-on-page", action="store_true", help="ask the operator there, not on the terminal")
    add_place(parser)


def add_place(parser: argparse.ArgumentParser) -> None:
    """Where the page is, and its token."""
    parser.add_argument(
        "--page-address",
        metavar="ADDRESS[:PORT]",
        help="where (default: 127.0.0.1:8137); one that others reach needs a token",
    )
    token = parser.add_mutually_exclusive_group()
    token.add_argument(
        "--page-token-file",
        type=Path,
        metavar="FILE",
        help=f"holds the page's token (default: what {TOKEN_VARIABLE} says, or a new one each time)",
    )
    token.add_argument(
        "--page-token", metavar="TOKEN", help="the token itself, which whoever lists this computer's processes sees"
    )


def token_said(options: argparse.Namespace) -> str | None:
    """The page's token where one is given: by the command line, a file or the environment.

    Raises Refused `page_address` for a file that cannot be read, or that others can.
    """
    path: Path | None = options.page_token_file
    if path is None:
        given: str | None = options.page_token
        return given if given is not None else os.environ.get(TOKEN_VARIABLE)
    try:
        if os.name == "posix" and stat.S_IMODE(path.stat().st_mode) & (stat.S_IRWXG | stat.S_IRWXO):
            raise UnfitFile("others than you may read or write it")
        return read_regular_file(path, LONGEST_TOKEN).decode("utf-8", errors="replace").strip()
    except (OSError, UnfitFile) as error:
        raise Refused(
            "page_address",
            f"the page's token cannot be taken from {path}: {error}",
            "Give a file that contains only the token and that only you can read: chmod 600 FILE",
        ) from error


def wish(options: argparse.Namespace) -> PageWish | None:
    """What the arguments ask for, None for no page.

    Raises Refused `page_address` for a place that will not do, and for what goes with a page alone.
    """
    if not options.page:
        if options.confirm_on_page or options.page_address or options.page_token or options.page_token_file:
            raise Refused(
                "page_address", "this option is for the page, and no page was asked for", "Give --page as well"
            )
        return None
    from rig.page.server.serving import check

    made = PageWish(options.page_address, token_said(options), options.confirm_on_page)
    check(made.address())  # before there is a run folder
    return made


@contextmanager
def operators_page(wanted: PageWish | None, folder: Path, about: "Callable[[], About]") -> Iterator[OperatorsPage]:
    """The page of a run in `folder`, for the length of the block; nothing where none is wanted.

    Raises Refused `page_address`.
    """
    if wanted is None:
        yield OperatorsPage()
        return
    from rig.page.analysis_process import looking_out
    from rig.page.page_state import PageState
    from rig.page.server.control import Control
    from rig.page.server.feed import Feed
    from rig.page.server.serving import serving

    feed, control = Feed(PageState(about())), Control(may_answer=wanted.may_answer)
    with ExitStack() as stack:
        url = stack.enter_context(serving(feed, control, folder, wanted.address()))
        lookout = stack.enter_context(looking_out(folder, feed))
        stack.enter_context(control.stoppable())

        def asked(announcement: Sequence[str], to_do: str) -> bool:
            say(f"The operator is asked on the page, whether to {to_do}.", sys.stderr)
            agreed = control.ask(announcement, to_do)
            return ask_operator(announcement, to_do) if agreed is None else agreed

        yield OperatorsPage((feed, lookout, _Address(url)), asked if wanted.may_answer else None, stay_for_the_operator)


class _Address:
    """A listener that says where the page is once it stays: most refusals end a run before, and the page with it."""

    def __init__(self, url: str) -> None:
        self._url: str | None = url

    def event(self, event: "RunEvent") -> None:
        """Take an event, as a Listener does."""
        from rig.station.events import PreflightPassed, Prompt

        if self._url is not None and isinstance(event, PreflightPassed | Prompt):
            say(f"page: {self._url}", sys.stderr)
            self._url = None


def stay_for_the_operator() -> None:
    """Where somebody sits at the terminal, the page with its verdict stays until Ctrl-C; a script goes on."""
    if sys.stdin is not None and sys.stdin.isatty():
        say("The page stays until Ctrl-C.", sys.stderr)
        wait_for_interrupt()


def wait_for_interrupt() -> None:
    """Wait until Ctrl-C, which is how the command is meant to end."""
    with suppress(KeyboardInterrupt):
        threading.Event().wait()
