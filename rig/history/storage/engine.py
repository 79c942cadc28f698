"""The database of a history: SQLite in a file, or PostgreSQL."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from sqlalchemy import URL, Connection, Engine, create_engine

from rig.errors.extras import requiring
from rig.history.storage import continuity, schema
from rig.history.storage.address import HistoryAddress
from rig.history.storage.forks import kept_from_children
from rig.history.storage.libpq import connect_arguments
from rig.history.storage.migrations import bring_up_to_date, version_of
from rig.history.storage.sqlite_engine import MAX_WAIT_S, WRITE_OPTION, share_engine, sqlite_engine
from rig.history.storage.sqlite_file import history_is_there, new_file_in_place


@contextmanager
def engine_of(address: HistoryAddress) -> Iterator[Engine]:
    """Yield the engine of a history, migrated and ready; a process has one engine for each file.

    Raise SQLAlchemyError, OSError, Refused `missing_extra`, `history_gone`, `history_exchanged`, and what
    `bring_up_to_date` and `history_is_there` raise.
    """
    continuity.refuse_another_file(address)
    where = address.where
    if isinstance(where, Path) and not history_is_there(where):
        continuity.refuse_emptied(address)
        _make(where, address.label)
    with share_engine(where, address.label) if isinstance(where, Path) else _server_engine(where) as engine:
        with engine.connect() as connection:
            version = version_of(connection, address.label)
        if version == 0:
            continuity.refuse_emptied(address)
        if version < schema.VERSION:
            _bring_up_to_date(engine, address.label)
        with engine.connect() as connection:
            continuity.refuse_another(address, connection)
        yield engine


@contextmanager
def connection_apart(engine: Engine) -> Iterator[Connection]:
    """Yield a new connection, not one of the pool, which may be the one that wrote the entries to be checked."""
    with engine.connect() as connection:
        connection.invalidate()  # the next use opens a new connection
        yield connection


def _bring_up_to_date(engine: Engine, label: str) -> None:
    with engine.connect().execution_options(**{WRITE_OPTION: True}) as connection, connection.begin():
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
    """Yield an engine for this block alone: a connection to a server that hangs would delay other users of the pool."""
    engine = _postgresql(server)
    try:
        yield engine
    finally:
        engine.dispose()


def _postgresql(server: URL) -> Engine:
    limits = f"-c lock_timeout={MAX_WAIT_S}s -c statement_timeout={MAX_WAIT_S}s"
    with requiring("postgres"):
        arguments = {"options": limits, **connect_arguments(server)}
        return kept_from_children(create_engine(server, connect_args=arguments))
