"""The server in a thread of its own, beside whatever it shows."""

import asyncio
import socket
import sys
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from ipaddress import ip_address
from pathlib import Path
from typing import TYPE_CHECKING

from rig.errors import Refused
from rig.page.server.connections import Connections, counted
from rig.page.server.control import Control
from rig.page.server.feed import Broadcast, Source
from rig.page.server.guard import Door, new_token
from rig.station.plain_text import say

if TYPE_CHECKING:
    import uvicorn
    from starlette.routing import Route

ADDRESS, PORT = "127.0.0.1", 8137
LAST_NEWS_S = 4.0  # for browsers to take what was shown last
ENDING_S = 8.0
SHORTEST_TOKEN = 22  # characters of base64, 128 bits
AT_ONCE = 8  # connections accepted between two looks at those that are there
WAITING = 128  # … and as many may wait for that
IDLE_S = 3  # a browser's connection is kept for its next request
LARGEST_HEADERS = 8192  # bytes


@dataclass(frozen=True, slots=True)
class Address:
    """Where the page is: without a `port`, the usual one, or any that is free where that is taken."""

    host: str = ADDRESS
    port: int | None = None
    token: str | None = None

    @property
    def loopback(self) -> bool:
        """Whether only this computer reaches it."""
        try:
            return ip_address(self.host).is_loopback
        except ValueError:
            return self.host == "localhost"


@dataclass(frozen=True, slots=True)
class Page:
    """Which page opens first, its `home`, and the addresses that it has beyond those to look on."""

    home: str = "page.html"
    routes: "Callable[[Door], Sequence[Route]]" = lambda door: ()


RUN = Page()


@contextmanager
def serving(feed: Source, control: Control, folder: Path | None, address: Address, shown: Page = RUN) -> Iterator[str]:
    """Show `feed` to browsers on a page for the length of the block; yields its address, with the token.

    Without a `folder` there is no run behind it, which could be stopped, and no certificate.
    A page that fails says so on stderr and is gone: what it shows goes on. Raises Refused `page_address`.
    """
    check(address)
    listening = _bound(address)
    port = listening.getsockname()[1]
    host = f"[{address.host}]" if ":" in address.host else address.host
    names = {host, "localhost"} if address.loopback else {host}
    token = address.token or new_token()
    door = Door(frozenset(f"{name}:{port}".lower() for name in names), token, not address.loopback)
    broadcast = Broadcast(feed)
    server = _server(broadcast, control, door, folder, shown)
    loop, over = asyncio.new_event_loop(), asyncio.Event()

    async def serve() -> None:
        posting = asyncio.create_task(broadcast.run())
        served = asyncio.create_task(server.serve([listening]))
        while not server.started and not served.done():
            await asyncio.sleep(0.01)
        listening.listen(WAITING)  # the server has made it AT_ONCE
        ending = asyncio.create_task(over.wait())
        await asyncio.wait((ending, served, posting), return_when=asyncio.FIRST_COMPLETED)
        ending.cancel()
        try:
            await broadcast.close(LAST_NEWS_S)
        finally:
            server.should_exit = True
            await asyncio.wait((posting, served))
            for task in (posting, served):
                task.result()

    def work() -> None:
        try:
            with asyncio.Runner(loop_factory=lambda: loop) as runner:
                runner.run(serve())
            why = "" if over.is_set() else "its server ended"
        except (Exception, SystemExit) as error:
            why = f"{type(error).__name__}: {error}"
        finally:
            listening.close()
            control.leave()
        if why:
            say(f"The page has ended ({why}). What it showed goes on without it.", sys.stderr)

    thread = threading.Thread(target=work, name="page", daemon=True)
    thread.start()
    try:
        yield f"http://{host}:{port}/#{token}"
    finally:
        with suppress(RuntimeError):  # its loop is closed: it has ended before
            loop.call_soon_threadsafe(over.set)
        thread.join(ENDING_S)  # which closes what it listened at; one that is starved ends with the process


def _server(broadcast: Broadcast, control: Control, door: Door, folder: Path | None, shown: Page) -> "uvicorn.Server":
    import uvicorn

    from rig.page.server.application import guarded, looking, of_a_run

    connections = Connections()
    served = [*looking(broadcast, door, shown.home), *shown.routes(door)]
    if folder is not None:
        served = [*served, *of_a_run(broadcast, control, door, folder)]
    config = uvicorn.Config(
        guarded(served, door, connections),
        http=counted(connections),
        h11_max_incomplete_event_size=LARGEST_HEADERS,
        backlog=AT_ONCE,
        timeout_keep_alive=IDLE_S,
        proxy_headers=False,  # anybody can write one, and a connection is known by where it comes from
        log_config=None,
        log_level="critical",  # what strangers send is not to fill the terminal
        access_log=False,
        lifespan="off",
        ws="none",
        server_header=False,
        timeout_graceful_shutdown=1,
    )
    return uvicorn.Server(config)


def check(address: Address) -> None:
    """Raises Refused `page_address` for one that will not do, whatever is free here."""
    if address.host in ("", "0.0.0.0", "::", "*"):
        raise Refused(
            "page_address",
            "the page cannot be served on every address of this computer",
            "Give the one address by which the tablet reaches it: --page-address ADDRESS:PORT",
        )
    if address.token is not None and (
        len(address.token) < SHORTEST_TOKEN or not address.token.replace("-", "").replace("_", "").isalnum()
    ):
        raise Refused(
            "page_address",
            f"the page's token has fewer than {SHORTEST_TOKEN} characters, or others than letters, digits, - and _",
            "Make one with: python -c 'import secrets; print(secrets.token_urlsafe(16))'",
        )
    if not address.loopback and address.token is None:
        raise Refused(
            "page_address",
            f"other computers can reach {address.host}, so the page there needs a token",
            "Give --page-token-file FILE as well, or leave the address out",
        )


def _bound(address: Address) -> socket.socket:
    """The listening socket, of which uvicorn makes its server."""
    wanted = [PORT, 0] if address.port is None else [address.port]
    why: OSError | None = None
    for port in wanted:
        try:
            family = socket.AF_INET6 if ":" in address.host else socket.AF_INET
            return socket.create_server((address.host, port), family=family, backlog=64)
        except (OSError, OverflowError) as error:
            why = error if isinstance(error, OSError) else OSError(str(error))
    raise Refused(
        "page_address",
        f"the page cannot be served at {address.host}:{wanted[0]} ({why})",
        "Give an address of this computer and a port that is free: --page-address ADDRESS:PORT",
    )
