"""The database behind a history: SQLite in a file, or PostgreSQL."""

import os
import sqlite3
from pathlib import Path
from typing import Any

from sqlalchemy import URL, Connection, Engine, create_engine, event

from rig.errors.extras import missing_extra
from rig.history.address import Place
from rig.history.libpq import connect_arguments
from rig.history.migrations import bring_up_to_date, version_of
from rig.history.schema import VERSION
from rig.history.sqlite_file import history_is_there, made_whole

WAIT_S = 30  # for others who write; for nobody so long, since an entry takes milliseconds
WRITES = "rig_writes"  # execution option of a connection that will write


def engine_of(place: Place) -> Engine:
    """The engine of a history, up to date and ready.

    Raises Refused as `bring_up_to_date`, `history_is_there`, `missing_extra`; SQLAlchemyError and OSError.
    """
    where = place.where
    engine = _of_file(where, place.label) if isinstance(where, Path) else _postgresql(where)
    try:
        with engine.connect() as connection:
            current = version_of(connection, place.label) == VERSION
        if not current:
            _bring_up_to_date(engine, place.label)
    except BaseException:
        engine.dispose()
        raise
    return engine


def _bring_up_to_date(engine: Engine, label: str) -> None:
    with engine.connect().execution_options(**{WRITES: True}) as connection, connection.begin():
        bring_up_to_date(connection, label)


def _of_file(file: Path, label: str) -> Engine:
    """The engine of a file, looked at before it is opened to be written; without one, one with all tables is made."""
    if not history_is_there(file):
        with made_whole(file) as beside:
            engine = _sqlite(beside)
            try:
                _bring_up_to_date(engine, label)
                with engine.connect() as connection:  # raises on a full disk, where closing would leave half a history
                    connection.exec_driver_sql("PRAGMA wal_checkpoint(TRUNCATE)")
            finally:
                engine.dispose()
    return _sqlite(file) if os.access(file, os.W_OK) and os.access(file.parent, os.W_OK) else _only_read(file)


def _only_read(file: Path) -> Engine:
    """The engine of a file that this user may only read, in a folder in which nothing can be laid beside it.

    Whoever writes it has a log beside it; without one it stays as it is while it is read, so that nothing is locked.
    """
    log = file.with_name(f"{file.name}-wal")
    address = f"{file.absolute().as_uri()}?mode=ro{'' if log.exists() else '&immutable=1'}"

    def connect() -> sqlite3.Connection:
        return sqlite3.connect(address, uri=True, timeout=WAIT_S, check_same_thread=False)

    return create_engine(URL.create("sqlite", database=str(file)), creator=connect)


def _sqlite(file: Path) -> Engine:
    """Write-ahead log, so that readers and a writer do not wait for each other. Not for network shares."""
    engine = create_engine(URL.create("sqlite", database=str(file)), connect_args={"timeout": WAIT_S})

    @event.listens_for(engine, "connect")
    def prepare(connection: Any, _: Any) -> None:
        connection.isolation_level = None  # transactions are begun below, not by the driver at the first change
        for pragma in ("journal_mode = WAL", "synchronous = NORMAL", "foreign_keys = ON"):
            connection.execute(f"PRAGMA {pragma}")

    @event.listens_for(engine, "begin")
    def begin(connection: Connection) -> None:
        # A transaction that reads first and writes then cannot wait for a writer: it would have read what is old.
        writes = connection.get_execution_options().get(WRITES)
        connection.exec_driver_sql("BEGIN IMMEDIATE" if writes else "BEGIN")

    return engine


def _postgresql(server: URL) -> Engine:
    limits = f"-c lock_timeout={WAIT_S}s -c statement_timeout={WAIT_S}s"
    try:
        return create_engine(server, connect_args={"options": limits, **connect_arguments(server)})
    except ImportError as error:
        raise missing_extra(error, "postgres") from error
