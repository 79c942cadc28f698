"""The database behind a history: SQLite in a file, or PostgreSQL."""

from pathlib import Path
from typing import Any

from sqlalchemy import Connection, Engine, create_engine, event

from rig.errors import Refused
from rig.history.migrations import bring_up_to_date, version_of
from rig.history.place import Place
from rig.history.schema import VERSION
from rig.study.files import missing_extra

WAIT_S = 30  # for others who write; for nobody so long, since an entry takes milliseconds
CONNECT_S = 5
WRITES = "rig_writes"  # execution option of a connection that will write


def engine_of(place: Place) -> Engine:
    """Up to date and ready. Raises Refused as `bring_up_to_date`, `missing_extra`; SQLAlchemyError and OSError."""
    engine = _sqlite(place.file, place.url) if place.file is not None else _postgresql(place)
    try:
        with engine.connect() as connection:
            current = version_of(connection, place.label) == VERSION
        if not current:
            with engine.connect().execution_options(**{WRITES: True}) as connection, connection.begin():
                bring_up_to_date(connection, place.label)
    except BaseException:
        engine.dispose()
        raise
    return engine


def _sqlite(file: Path, url: str) -> Engine:
    """Write-ahead log, so that readers and a writer do not wait for each other. Not for network shares."""
    file.parent.mkdir(parents=True, exist_ok=True)
    engine = create_engine(url, connect_args={"timeout": WAIT_S})

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


def _postgresql(place: Place) -> Engine:
    limits = f"-c lock_timeout={WAIT_S}s -c statement_timeout={WAIT_S}s"
    try:
        return create_engine(place.url, connect_args={"connect_timeout": CONNECT_S, "options": limits})
    except ImportError as error:
        raise missing_extra(error, "postgres") from error
    except Exception as error:  # what the URL says is no database of this kind
        raise Refused("history_unreachable", f"{place.label}: {error}", "Correct the URL of the history") from error
