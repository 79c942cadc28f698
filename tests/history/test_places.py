"""Where a history may be: what an address may say, what is left as it is, and to whom no password is said."""

import os
import socket
import sqlite3
import struct
import threading
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path

import pytest
from sqlalchemy import URL

from rig.config.load import ConfigurationRefused, load
from rig.errors import Refused
from rig.history.storage.address import resolve_address
from rig.history.storage.libpq import connect_arguments
from rig.history.store import open_history
from support.paths import DEMO

CLEAR_TEXT, MD5 = struct.pack(">i", 3), struct.pack(">i4s", 5, b"salt")
SECRET = "a-secret-of-the-operator"


@pytest.mark.parametrize(
    "query",
    ["?%70assword=x", "?passfile=/tmp/p", "?options=-csearch_path%3Dx", "?sslkey=k", "?service=s", "?sslmode=disable"],
)
def test_a_url_of_a_history_says_where_it_is_and_nothing_else(query: str) -> None:
    url = f"postgresql://rig@lab/history{query}"
    with pytest.raises(Refused, match="history_address"):
        resolve_address(url)
    with pytest.raises(ConfigurationRefused, match=r"question mark|sslmode"):
        load(DEMO, [f"history.url={url}"])


def test_a_url_may_name_a_socket_and_ask_for_more_encryption() -> None:
    for query in ("?host=/run/postgresql", "?sslmode=verify-full&sslrootcert=system"):
        assert load(DEMO, [f"history.url=postgresql://rig@/history{query}"]).config.history.url is not None


def files_of(folder: Path) -> dict[str, bytes]:
    return {path.name: path.read_bytes() for path in folder.iterdir()}


def test_what_is_no_history_stays_as_it_is(tmp_path: Path) -> None:
    (tmp_path / "empty").touch()
    with closing(sqlite3.connect(tmp_path / "letters")) as other:
        other.execute("CREATE TABLE letters (id INTEGER)")
        other.commit()
    with closing(sqlite3.connect(tmp_path / "meta")) as other:
        other.executescript("CREATE TABLE meta (key, value); INSERT INTO meta VALUES ('schema', '7');")
    before = files_of(tmp_path)
    for name in before:
        with pytest.raises(Refused, match="not_a_history"), open_history(str(tmp_path / name)):
            pass
    assert files_of(tmp_path) == before


def test_a_history_is_no_link_and_no_pipe(tmp_path: Path) -> None:
    with open_history(str(tmp_path / "history.sqlite")):
        pass
    (tmp_path / "link").symlink_to("history.sqlite")
    (tmp_path / "nowhere").symlink_to("not there")
    os.mkfifo(tmp_path / "pipe")
    for name in ("link", "nowhere", "pipe", "."):
        with pytest.raises(Refused, match="not_a_history"), open_history(str(tmp_path / name)):
            pass
    assert not (tmp_path / "not there").exists()


@contextmanager
def asks_for_a_password(how: bytes) -> Iterator[tuple[int, bytearray]]:
    """A server that speaks no TLS and asks for the password in that way: its port, and all that it was told."""
    told = bytearray()
    with socket.create_server(("127.0.0.1", 0)) as server:

        def serve() -> None:
            try:
                while True:
                    with server.accept()[0] as client:
                        told.extend(client.recv(4096))
                        client.sendall(b"N")  # no TLS here
                        while said := client.recv(4096):
                            told.extend(said)
                            client.sendall(b"R" + struct.pack(">i", 4 + len(how)) + how)
            except OSError:
                return

        threading.Thread(target=serve, daemon=True).start()
        yield server.getsockname()[1], told
        server.shutdown(socket.SHUT_RDWR)


@pytest.mark.slow
@pytest.mark.parametrize("how", [CLEAR_TEXT, MD5])
@pytest.mark.parametrize("host", ["127.0.0.1", "0.0.0.0"])  # the second leads here as well, and is not known to
def test_a_password_is_said_to_no_server_that_asks_for_it(
    how: bytes, host: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Neither in clear text nor as a hash; to another computer nothing at all is said without encryption."""
    monkeypatch.setenv("PGPASSWORD", SECRET)
    with (
        asks_for_a_password(how) as (port, told),
        pytest.raises(Refused, match="history_unreachable"),
        open_history(f"postgresql://rig@{host}:{port}/x"),
    ):
        pass
    assert told and SECRET.encode() not in told
    assert b"md5" not in told and (b"user" in told) == (host == "127.0.0.1")


def test_another_computer_has_to_prove_that_it_knows_the_password() -> None:
    def arguments(url: str, **environment: str) -> tuple[object, object]:
        server = resolve_address(url).where
        assert isinstance(server, URL)
        said = connect_arguments(server, environment)
        return said["require_auth"], said.get("sslmode")

    for url in (
        "postgresql://rig@/x",
        "postgresql://[::1]/x",
        "postgresql:///x?host=/run/p",
        "postgresql://localhost/x",
    ):
        assert arguments(url) == ("scram-sha-256,none", "prefer")
    for url in ("postgresql://192.0.2.1/x", "postgresql:///x?host=lab:5433&host=127.0.0.1"):
        assert arguments(url) == ("scram-sha-256", "require")
    assert arguments("postgresql:///x", PGHOST="lab") == ("scram-sha-256", "require")
    assert arguments("postgresql:///x", PGHOSTADDR="192.0.2.1") == ("scram-sha-256", "require")
    assert arguments("postgresql://lab/x", PGSSLMODE="disable") == ("scram-sha-256", "require")
    assert arguments("postgresql://lab/x", PGSSLMODE="verify-full") == ("scram-sha-256", "verify-full")
    assert arguments("postgresql://lab/x?sslmode=verify-ca") == ("scram-sha-256", None)
