"""The arguments that request an operator's page, set its address, and let it answer questions."""

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
    from rig.station.operator_station import Listener

Answer = Callable[[Sequence[str], str], bool]
TOKEN_VARIABLE = "RIG_PAGE_TOKEN"
MAX_TOKEN_BYTES = 1000  # of the file that contains the token


@dataclass(frozen=True, slots=True)
class PageWish:
    """A requested page: its `host_and_port` and token, and whether it may answer for the operator."""

    host_and_port: str | None = None
    token: str | None = None
    may_answer: bool = False

    def address(self) -> "PageAddress":
        """Return the address. Raise Refused `page_address` for a wrong port."""
        from rig.page.server.serving import ADDRESS, PageAddress

        host, colon, port = (self.host_and_port or ADDRESS).rpartition(":")
        if not colon or (host.count(":") and not host.endswith("]")):  # no port, or an IPv6 address alone
            host, port = self.host_and_port or ADDRESS, ""
        if port and not (port.isascii() and port.isdecimal() and int(port) < 65536):
            raise Refused("page_address", f"{port!r} is not a port", "Give --page-address ADDRESS:PORT")
        return PageAddress(host.strip("[]"), int(port) if port else None, self.token)


@dataclass(frozen=True, slots=True)
class OperatorsPage:
    """The page of a run: the `listeners` through which it shows the run, and two functions.

    `answer` asks the operator on the page; it is None if the terminal asks. `stay` keeps the page open after the run.
    """

    listeners: "tuple[Listener, ...]" = ()
    answer: Answer | None = None
    stay: Callable[[], None] = lambda: None


def add_page(parser: argparse.ArgumentParser) -> None:
    """Add the page's arguments of `rig run` and `rig resume`."""
    parser.add_argument("--page", action="store_true", help="show the run also in a browser")
    parser.add_argument("--confirm-on-page", action="store_true", help="ask the operator on the page, not the terminal")
    add_page_address(parser)


def add_page_address(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of the page's address and token."""
    parser.add_argument(
        "--page-address",
        metavar="ADDRESS[:PORT]",
        help="the page's address (default: 127.0.0.1:8137); an address that others can reach needs a token",
    )
    token = parser.add_mutually_exclusive_group()
    token.add_argument(
        "--page-token-file",
        type=Path,
        metavar="FILE",
        help=f"file with the page's token (default: the variable {TOKEN_VARIABLE}, else a new one each time)",
    )
    token.add_argument(
        "--page-token", metavar="TOKEN", help="the token itself; everyone who lists this computer's processes sees it"
    )


def read_page_token(options: argparse.Namespace) -> str | None:
    """Return the page's token, given by the command line, a file or the environment, if any.

    Raise Refused `page_address` for a file that cannot be read, or that others can read or write.
    """
    path: Path | None = options.page_token_file
    if path is None:
        token: str | None = options.page_token
        return token if token is not None else os.environ.get(TOKEN_VARIABLE)
    try:
        if os.name == "posix" and stat.S_IMODE(path.stat().st_mode) & (stat.S_IRWXG | stat.S_IRWXO):
            raise UnfitFile("others than you can read or write it")
        return read_regular_file(path, MAX_TOKEN_BYTES).decode("utf-8", errors="replace").strip()
    except (OSError, UnfitFile) as error:
        raise Refused(
            "page_address",
            f"the page's token cannot be read from {path}: {error}",
            "Give a file that contains only the token and that only you can read: chmod 600 FILE",
        ) from error


def read_page_wish(options: argparse.Namespace) -> PageWish | None:
    """Return the page that the arguments request; None for no page.

    Raise Refused `page_address` for an unusable address, and for options that need `--page`.
    """
    if not options.page:
        if options.confirm_on_page or options.page_address or options.page_token or options.page_token_file:
            raise Refused("page_address", "this option needs a page, but --page is not given", "Give --page as well")
        return None
    from rig.page.server.serving import check

    wish = PageWish(options.page_address, read_page_token(options), options.confirm_on_page)
    check(wish.address())  # before there is a run folder
    return wish


@contextmanager
def serve_operators_page(
    wanted: PageWish | None, folder: Path, about: "Callable[[], About]"
) -> Iterator[OperatorsPage]:
    """Yield a run's page, served during the block; if none is `wanted`, one without effect. Raise `page_address`."""
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

        def ask_on_page(announcement: Sequence[str], to_do: str) -> bool:
            say(f"The operator is asked on the page whether to {to_do}.", sys.stderr)
            agreed = control.ask(announcement, to_do)
            return ask_operator(announcement, to_do) if agreed is None else agreed

        yield OperatorsPage(
            (feed, lookout, _Address(url)), ask_on_page if wanted.may_answer else None, stay_for_the_operator
        )


class _Address:
    """A listener that prints the page's address after the pre-flight, because most refusals come before."""

    def __init__(self, url: str) -> None:
        self._url: str | None = url

    def event(self, event: "RunEvent") -> None:
        """Handle an event, as a Listener does."""
        from rig.station.events import PreflightPassed, Prompt

        if self._url is not None and isinstance(event, PreflightPassed | Prompt):
            say(f"page: {self._url}", sys.stderr)
            self._url = None


def stay_for_the_operator() -> None:
    """Keep the page with its verdict until Ctrl-C; without a terminal return at once."""
    if sys.stdin is not None and sys.stdin.isatty():
        say("The page stays until Ctrl-C.", sys.stderr)
        wait_for_interrupt()


def wait_for_interrupt() -> None:
    """Wait until Ctrl-C, the normal end of the command."""
    with suppress(KeyboardInterrupt):
        threading.Event().wait()
