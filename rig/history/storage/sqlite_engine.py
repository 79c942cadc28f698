"""Engines of SQLite files: one for each file in a process, for all its users; none survives a fork."""

import os
import sqlite3
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from sqlalchemy import URL, Connection, Engine, create_engine, event

from rig.config.files.regular_file import file_identity, shut_files
from rig.history.storage.continuity import refuse_unlike
from rig.history.storage.forks import kept_from_children
from rig.history.storage.sqlite_file import address_of, identities, refuse_unmarked

MAX_WAIT_S = 30  # for other writers: far longer than an entry takes
WRITE_OPTION = "rig_writes"  # execution option of a connection that will write


@dataclass(slots=True)
class _SharedEngine:
    """An engine and the number of its users."""

    engine: Engine
    users: int = 0


_engines: dict[Path, _SharedEngine] = {}
_sharing = threading.Lock()


@contextmanager
def share_engine(file: Path, label: str) -> Iterator[Engine]:
    """Yield this process's engine of a history's file. The last user's exit closes the connections."""
    key = file.parent.resolve() / file.name
    with _sharing:
        if key not in _engines:
            _engines[key] = _SharedEngine(sqlite_engine(file, label))
        shared = _engines[key]
        shared.users += 1
    try:
        with shut_files(partial(identities, file)):
            yield shared.engine
    finally:
        with _sharing:
            shared.users -= 1
            if last := not shared.users:
                _engines.pop(key, None)
        if last:
            shared.engine.dispose()


def sqlite_engine(file: Path, label: str, *, new: bool = False) -> Engine:
    """Return an engine of a history's file, or of a `new` one.

    Each use of a connection raises Refused `history_gone` or `history_exchanged` if the file is missing or replaced.
    """
    may_write = new or (os.access(file, os.W_OK) and os.access(file.parent, os.W_OK))
    identity = file_identity(file)

    def refuse_another_file(*_: Any) -> None:
        if not new:
            refuse_unlike(identity, file, label)

    def connect() -> sqlite3.Connection:
        refuse_another_file()
        return _connect_to_write(file, new=new) if may_write else _connect_to_read(file)

    url = URL.create("sqlite", database=str(file))
    engine = kept_from_children(create_engine(url, creator=connect))
    event.listen(engine, "checkout", refuse_another_file)

    if may_write:

        @event.listens_for(engine, "begin")
        def begin(connection: Connection) -> None:
            # A transaction that reads before it writes cannot wait for a writer: it would have read old rows.
            writes = connection.get_execution_options().get(WRITE_OPTION)
            connection.exec_driver_sql("BEGIN IMMEDIATE" if writes else "BEGIN")

    return engine


def _connect_to_write(file: Path, *, new: bool) -> sqlite3.Connection:
    """Return a connection that writes by a write-ahead log (WAL), so readers need not wait for a writer.

    A write-ahead log does not work on network shares.
    """
    connection = _connect(file, "mode=rwc" if new else "mode=rw")
    if not new:
        refuse_unmarked(connection, file)
    connection.isolation_level = None  # transactions are begun by the engine, not by the driver at the first change
    # A reported entry survives a power failure: its transaction ends when the disk has it (FULL).
    for pragma in ("journal_mode = WAL", "synchronous = FULL", "foreign_keys = ON"):
        connection.execute(f"PRAGMA {pragma}")
    return connection


def _connect_to_read(file: Path) -> sqlite3.Connection:
    """Return a connection for reading only, to a file in a folder in which the user cannot create files.

    If the file is open for writing, its write-ahead log is in that folder. Without a log, nothing changes the file
    during reading, so no lock is needed.
    """
    log = file.with_name(f"{file.name}-wal")
    return _connect(file, "mode=ro" if log.exists() else "mode=ro&immutable=1")


def _connect(file: Path, options: str) -> sqlite3.Connection:
    # For any thread: the engine's pool gives a connection to one thread at a time.
    return sqlite3.connect(address_of(file, options), uri=True, timeout=MAX_WAIT_S, check_same_thread=False)


def _drop_parents_engines() -> None:
    """Drop the parent's engines in a forked process."""
    _engines.clear()
    _sharing.release()


if hasattr(os, "register_at_fork"):
    os.register_at_fork(before=_sharing.acquire, after_in_parent=_sharing.release, after_in_child=_drop_parents_engines)
