"""The database behind a history: SQLite in a file, or PostgreSQL."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from sqlalchemy import URL, Connection, Engine, create_engine

from rig.errors.extras import missing_extra
from rig.history.storage import continuity, schema
from rig.history.storage.address import Place
from rig.history.storage.forks import kept_from_children
from rig.history.storage.libpq import connect_arguments
from rig.history.storage.migrations import bring_up_to_date, version_of
from rig.history.storage.sqlite_engine import WAIT_S, WRITES, shared_engine, sqlite_engine
from rig.history.storage.sqlite_file import history_is_there, made_whole

__all__ = ["WRITES", "connection_apart", "engine_of"]


@contextmanager
def engine_of(place: Place) -> Iterator[Engine]:
    """Yield the engine of a history, up to date and ready; of a file the process has but one.

    Raises Refused as `bring_up_to_date`, `history_is_there`, `missing_extra` and `continuity`; SQLAlchemyError and
    OSError.
    """
    continuity.refuse_another_file(place)
    where = place.where
    if isinstance(where, Path) and not history_is_there(where):
        continuity.refuse_anew(place)
        _make(where, place.label)
    with shared_engine(where, place.label) if isinstance(where, Path) else _of_server(where) as engine:
        with engine.connect() as connection:
            version = version_of(connection, place.label)
        if version == 0:
            continuity.refuse_anew(place)
        if version < schema.VERSION:
            _bring_up_to_date(engine, place.label)
        with engine.connect() as connection:
            continuity.refuse_another(place, connection)
        yield engine


@contextmanager
def connection_apart(engine: Engine) -> Iterator[Connection]:
    """Yield a connection that is none of those before it: it reads what the history itself holds."""
    with engine.connect() as connection:
        connection.invalidate()  # the one that the pool has may be the one that wrote
        yield connection


def _bring_up_to_date(engine: Engine, label: str) -> None:
    with engine.connect().execution_options(**{WRITES: True}) as connection, connection.begin():
        bring_up_to_date(connection, label)


def _make(file: Path, label: str) -> None:
    """Make a history with all its tables and nothing in them."""
    with made_whole(file) as beside:
        engine = sqlite_engine(beside, label, new=True)
        try:
            _bring_up_to_date(engine, label)
            with engine.connect() as connection:  # raises on a full disk, where closing would leave half a history
                connection.exec_driver_sql("PRAGMA wal_checkpoint(TRUNCATE)")
        finally:
            engine.dispose()


@contextmanager
def _of_server(server: URL) -> Iterator[Engine]:
    """Yield an engine of this block's own: one that waits for a frozen server keeps nobody else waiting."""
    engine = _postgresql(server)
    try:
        yield engine
    finally:
        engine.dispose()


def _postgresql(server: URL) -> Engine:
    limits = f"-c lock_timeout={WAIT_S}s -c statement_timeout={WAIT_S}s"
    try:
        arguments = {"options": limits, **connect_arguments(server)}
        return kept_from_children(create_engine(server, connect_args=arguments))
    except ImportError as error:
        raise missing_extra(error, "postgres") from error
