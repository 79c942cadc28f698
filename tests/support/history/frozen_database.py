"""A PostgreSQL that freezes: a relay passes everything on until certain words occur, and nothing afterwards."""

import select
import socket
import threading
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from urllib.parse import parse_qs, urlsplit


@contextmanager
def freezing_at(words: bytes, url: str) -> Iterator[tuple[str, threading.Event]]:
    """Yield a relay's URL for the database of `url`, and the event of its freezing. Its connections stay open."""
    folder = Path(parse_qs(urlsplit(url).query)["host"][0])
    frozen = threading.Event()
    with ExitStack() as stack:
        server = stack.enter_context(socket.create_server(("127.0.0.1", 0)))

        def serve() -> None:
            try:
                while True:
                    client = stack.enter_context(server.accept()[0])
                    database = stack.enter_context(socket.socket(socket.AF_UNIX))
                    database.connect(str(folder / ".s.PGSQL.5432"))
                    _pass_on(client, database, words, frozen)
            except OSError:
                return

        threading.Thread(target=serve, daemon=True).start()
        yield f"postgresql://rig@127.0.0.1:{server.getsockname()[1]}/postgres", frozen
        server.shutdown(socket.SHUT_RDWR)


def _pass_on(client: socket.socket, database: socket.socket, words: bytes, frozen: threading.Event) -> None:
    while not frozen.is_set():
        for source in select.select([client, database], [], [])[0]:
            data = source.recv(65536)
            if not data:
                return
            if source is client and words in data:
                frozen.set()
                return
            (database if source is client else client).sendall(data)
