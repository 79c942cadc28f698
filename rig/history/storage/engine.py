"""The database of a history: SQLite in a file, or PostgreSQL."""

import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from ipaddress import ip_address
from pathlib import Path
from typing import TYPE_CHECKING

from sqlalchemy import URL, Connection, Engine, create_engine

from rig.config.judging.history_address import ENCRYPTED
from rig.errors.extras import requiring
from rig.history.storage import continuity, schema
from rig.history.storage.address import HistoryAddress
from rig.history.storage.forks import kept_from_children
from rig.history.storage.migrations import bring_up_to_date, version_of
from rig.history.storage.sqlite_engine import WAIT_S, WRITES, share_engine, sqlite_engine
from rig.history.storage.sqlite_file import history_is_there, new_file_in_place

if TYPE_CHECKING:
    from sqlalchemy import URL

CONNECT_S = 5
SILENCE_S = 5  # time after which an unresponsive connection is closed


@contextmanager
def engine_of(address: HistoryAddress) -> Iterator[Engine]:
    """Yield the engine of a history, migrated and ready; a process has one engine for each file.

    Raise Refused `missing_extra`, and as `bring_up_to_date`, `history_is_there` and the module `continuity` do;
    SQLAlchemyError and OSError.
    """
    continuity.refuse_another_file(address)
    where = address.where
    if isinstance(where, Path) and not history_is_there(where):
        continuity.refuse_anew(address)
        _make(where, address.label)
    with share_engine(where, address.label) if isinstance(where, Path) else _server_engine(where) as engine:
        with engine.connect() as connection:
            version = version_of(connection, address.label)
        if version == 0:
            continuity.refuse_anew(address)
        if version < schema.VERSION:
            _bring_up_to_date(engine, address.label)
        with engine.connect() as connection:
            continuity.refuse_another(address, connection)
        yield engine


@contextmanager
def connection_apart(engine: Engine) -> Iterator[Connection]:
    """Yield a new connection with its own view of the history."""
    with engine.connect() as connection:
        connection.invalidate()  # the pool's connection may be the one that wrote
        yield connection


def _bring_up_to_date(engine: Engine, label: str) -> None:
    with engine.connect().execution_options(**{WRITES: True}) as connection, connection.begin():
        bring_up_to_date(connection, label)


def _make(file: Path, label: str) -> None:
    """Make a history with all its tables, empty."""
    with new_file_in_place(file) as temporary:
        engine = sqlite_engine(temporary, label, new=True)
        try:
            _bring_up_to_date(engine, label)
            with engine.connect() as connection:  # raises on a full disk; closing alone would leave half a history
                connection.exec_driver_sql("PRAGMA wal_checkpoint(TRUNCATE)")
        finally:
            engine.dispose()


@contextmanager
def _server_engine(server: URL) -> Iterator[Engine]:
    """Yield an engine for this block alone, so that a frozen server delays no other block."""
    engine = _postgresql(server)
    try:
        yield engine
    finally:
        engine.dispose()


def _postgresql(server: URL) -> Engine:
    limits = f"-c lock_timeout={WAIT_S}s -c statement_timeout={WAIT_S}s"
    with requiring("postgres"):
        arguments = {"options": limits, **connect_arguments(server)}
        return kept_from_children(create_engine(server, connect_args=arguments))


def connect_arguments(server: "URL", environment: Mapping[str, str] = os.environ) -> dict[str, str | int]:
    """Return the options of a connection, which to another computer is always encrypted and authenticated.

    On this computer there is no network to listen on, and the system may authenticate the user without a password. A
    user may require more encryption by PGSSLMODE, and another method, such as `gss`, by PGREQUIREAUTH.
    """
    is_local = _is_on_this_computer(server, environment)
    options: dict[str, str | int] = {
        "require_auth": environment.get("PGREQUIREAUTH") or ("scram-sha-256,none" if is_local else "scram-sha-256"),
        "connect_timeout": CONNECT_S,
        "tcp_user_timeout": SILENCE_S * 1000,
        "keepalives_idle": SILENCE_S,
    }
    if "sslmode" not in server.query:
        requested = environment.get("PGSSLMODE", "")
        options["sslmode"] = requested if requested in ENCRYPTED else "prefer" if is_local else ENCRYPTED[0]
    return options


def _is_on_this_computer(server: "URL", environment: Mapping[str, str]) -> bool:
    if environment.get("PGHOSTADDR") or environment.get("PGSERVICE"):
        return False  # these name a server that is unknown here
    queried = server.query.get("host", ())
    names = [server.host or "", *([queried] if isinstance(queried, str) else queried)]
    hosts = [host for name in names for host in name.split(",") if host] or [environment.get("PGHOST", "")]
    return all(map(_is_at_hand, hosts))


def _is_at_hand(host: str) -> bool:
    """Return whether the host is this computer: a local address, or a socket's folder."""
    if host in ("", "localhost") or host[0] in "/@":
        return True
    try:
        return ip_address(host).is_loopback
    except ValueError:
        # If there are several hosts in a query, each may have a port.
        name, _, port = host.rpartition(":")
        return port.isdecimal() and _is_at_hand(name)
