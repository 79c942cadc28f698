"""Engines of SQLite files: one for each file in a process, whoever works on it there, and none that crosses a fork."""

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

WAIT_S = 30  # for others who write; for nobody so long, since an entry takes milliseconds
WRITES = "rig_writes"  # execution option of a connection that will write


@dataclass(slots=True)
class _Shared:
    engine: Engine
    users: int = 0


_shared: dict[Path, _Shared] = {}
_sharing = threading.Lock()


@contextmanager
def shared_engine(file: Path, label: str) -> Iterator[Engine]:
    """Yield the one engine that this process has of a history's file; the last who uses it closes its connections."""
    key = file.parent.resolve() / file.name
    with _sharing:
        if key not in _shared:
            _shared[key] = _Shared(sqlite_engine(file, label))
        shared = _shared[key]
        shared.users += 1
    try:
        with shut_files(partial(identities, file)):
            yield shared.engine
    finally:
        with _sharing:
            shared.users -= 1
            if last := not shared.users:
                _shared.pop(key, None)
        if last:
            shared.engine.dispose()


def sqlite_engine(file: Path, label: str, *, new: bool = False) -> Engine:
    """Make an engine of a file that is a history, or that will be a `new` one.

    Each use of a connection raises Refused `history_gone` or `history_exchanged` where the file is not there any more,
    or another is.
    """
    may_write = new or (os.access(file, os.W_OK) and os.access(file.parent, os.W_OK))
    there = file_identity(file)

    def refuse_another_file(*_: Any) -> None:
        if not new:
            refuse_unlike(there, file, label)

    def connect() -> sqlite3.Connection:
        refuse_another_file()
        return _to_write(file, new=new) if may_write else _only_to_read(file)

    url = URL.create("sqlite", database=str(file))
    engine = kept_from_children(create_engine(url, creator=connect))
    event.listen(engine, "checkout", refuse_another_file)

    if may_write:

        @event.listens_for(engine, "begin")
        def begin(connection: Connection) -> None:
            # A transaction that reads first and writes then cannot wait for a writer: it would have read what is old.
            writes = connection.get_execution_options().get(WRITES)
            connection.exec_driver_sql("BEGIN IMMEDIATE" if writes else "BEGIN")

    return engine


def _to_write(file: Path, *, new: bool) -> sqlite3.Connection:
    """Open a file with a write-ahead log: readers and a writer do not wait for each other. Not for network shares."""
    connection = _connected(file, "mode=rwc" if new else "mode=rw")
    if not new:
        refuse_unmarked(connection, file)
    connection.isolation_level = None  # transactions are begun by the engine, not by the driver at the first change
    # An entry that is told as such outlasts a power cut: its transaction ends when the disk has it (FULL).
    for pragma in ("journal_mode = WAL", "synchronous = FULL", "foreign_keys = ON"):
        connection.execute(f"PRAGMA {pragma}")
    return connection


def _only_to_read(file: Path) -> sqlite3.Connection:
    """Open a file that this user may only read, in a folder in which nothing can be laid beside it.

    Whoever writes it has a log beside it; without one it stays as it is while it is read, so that nothing is locked.
    """
    log = file.with_name(f"{file.name}-wal")
    return _connected(file, "mode=ro" if log.exists() else "mode=ro&immutable=1")


def _connected(file: Path, options: str) -> sqlite3.Connection:
    # Of any thread: the engine's pool hands a connection to one at a time.
    return sqlite3.connect(address_of(file, options), uri=True, timeout=WAIT_S, check_same_thread=False)


def _begin_anew() -> None:
    """Forget in a forked process the engines that its parent shares: who works on a file there, begins there."""
    _shared.clear()
    _sharing.release()


if hasattr(os, "register_at_fork"):
    os.register_at_fork(before=_sharing.acquire, after_in_parent=_sharing.release, after_in_child=_begin_anew)
