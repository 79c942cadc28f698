"""The server of a page, in a thread of its own."""

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
from rig.page.server.connections import Connections, counting_protocol
from rig.page.server.control import Control
from rig.page.server.feed import Broadcast, Source
from rig.page.server.guard import Door, Guard, new_token
from rig.station.plain_text import say

if TYPE_CHECKING:
    import uvicorn
    from starlette.routing import Route

ADDRESS, PORT = "127.0.0.1", 8137
MAX_LAST_NEWS_S = 4.0  # time for browsers to receive the last news
MAX_EXIT_S = 8.0
MIN_TOKEN = 22  # characters of base64, for 128 bits
MAX_ACCEPTED = 8  # connections in one cycle of the event loop
BACKLOG = 128  # connections that may wait to be accepted
MAX_IDLE_S = 3  # for which a browser's connection waits for another request
MAX_HEADER_BYTES = 8192


@dataclass(frozen=True, slots=True)
class PageAddress:
    """The page's address; if `port` is None, the usual port, or a free one if another program uses the usual port."""

    host: str = ADDRESS
    port: int | None = None
    token: str | None = None

    @property
    def loopback(self) -> bool:
        """Whether only this computer can reach the page."""
        try:
            return ip_address(self.host).is_loopback
        except ValueError:
            return self.host == "localhost"


@dataclass(frozen=True, slots=True)
class Page:
    """The page that opens first (`home`), and its routes beyond those for spectators."""

    home: str = "page.html"
    routes: "Callable[[Door], Sequence[Route]]" = lambda door: ()


RUN = Page()


@contextmanager
def serving(
    feed: Source, control: Control, folder: Path | None, address: PageAddress, shown: Page = RUN
) -> Iterator[str]:
    """Show `feed` to browsers during the block; yield the page's address, with the token.

    Without a `folder` there is no run to stop, and no certificate. If the page fails, it ends with a message on stderr,
    and the run continues. Raise Refused `page_address`.
    """
    check(address)
    listening = _listen(address)
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
        listening.listen(BACKLOG)  # the server has already set it to MAX_ACCEPTED
        ending = asyncio.create_task(over.wait())
        await asyncio.wait((ending, served, posting), return_when=asyncio.FIRST_COMPLETED)
        ending.cancel()
        try:
            await broadcast.close(MAX_LAST_NEWS_S)
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
            say(f"The page has ended ({why}). The run is not affected.", sys.stderr)

    thread = threading.Thread(target=work, name="page", daemon=True)
    thread.start()
    try:
        yield f"http://{host}:{port}/#{token}"
    finally:
        with suppress(RuntimeError):  # its loop is closed: the server has already ended
            loop.call_soon_threadsafe(over.set)
        thread.join(MAX_EXIT_S)  # it closes its socket; a starved one ends with the process


def _server(broadcast: Broadcast, control: Control, door: Door, folder: Path | None, shown: Page) -> "uvicorn.Server":
    """Return uvicorn's server of the page, with limits against strangers."""
    import uvicorn
    from starlette.applications import Starlette

    from rig.page.server.application import read_only_routes, run_routes

    connections = Connections()
    served = [*read_only_routes(broadcast, door, shown.home), *shown.routes(door)]
    if folder is not None:
        served = [*served, *run_routes(broadcast, control, door, folder)]
    config = uvicorn.Config(
        Guard(Starlette(routes=served), door, connections),
        http=counting_protocol(connections),
        h11_max_incomplete_event_size=MAX_HEADER_BYTES,
        backlog=MAX_ACCEPTED,
        timeout_keep_alive=MAX_IDLE_S,
        proxy_headers=False,  # anyone can send such headers; a connection is identified by its own address
        log_config=None,
        log_level="critical",  # requests of strangers must not fill the terminal
        access_log=False,
        lifespan="off",
        ws="none",
        server_header=False,
        timeout_graceful_shutdown=1,
    )
    return uvicorn.Server(config)


def check(address: PageAddress) -> None:
    """Raise Refused `page_address` for an address that no computer can have."""
    if address.host in ("", "0.0.0.0", "::", "*"):
        raise Refused(
            "page_address",
            "the page cannot be served on every address of this computer",
            "Give the one address by which the tablet reaches it: --page-address ADDRESS:PORT",
        )
    if address.token is not None and (
        len(address.token) < MIN_TOKEN or not address.token.replace("-", "").replace("_", "").isalnum()
    ):
        raise Refused(
            "page_address",
            f"the page's token has fewer than {MIN_TOKEN} characters, or others than letters, digits, - and _",
            "Make one with: python -c 'import secrets; print(secrets.token_urlsafe(16))'",
        )
    if not address.loopback and address.token is None:
        raise Refused(
            "page_address",
            f"other computers can reach {address.host}, so the page there needs a token",
            "Give --page-token-file FILE as well, or leave the address out",
        )


def _listen(address: PageAddress) -> socket.socket:
    """Return the listening socket for uvicorn. Raise Refused `page_address`."""
    ports = [PORT, 0] if address.port is None else [address.port]
    why: OSError | None = None
    for port in ports:
        try:
            family = socket.AF_INET6 if ":" in address.host else socket.AF_INET
            return socket.create_server((address.host, port), family=family, backlog=64)
        except (OSError, OverflowError) as error:
            why = error if isinstance(error, OSError) else OSError(str(error))
    raise Refused(
        "page_address",
        f"the page cannot be served at {address.host}:{ports[0]} ({why})",
        "Give an address of this computer and a port that is free: --page-address ADDRESS:PORT",
    )
