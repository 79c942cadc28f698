"""Inspection of a history's file before it is opened for writing: a file that is not a history remains unchanged.

Only SQLite opens the file. Its locks belong to the process (POSIX advisory locks): if any other code of the process
opens and closes the file, the locks of all its connections are lost, and another process may regard the file as unused.
Source: "How To Corrupt An SQLite Database File", 2.2, https://sqlite.org/howtocorrupt.html.
"""

import os
import sqlite3
import stat
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory

from rig.config.files.regular_file import FileIdentity, UnfitFile, file_identity
from rig.errors import Refused
from rig.history.storage.migrations import DEVELOPMENT_KEY, too_old
from rig.history.storage.schema import APPLICATION_ID

SUFFIXES = ("-wal", "-shm")  # SQLite's log, and the log's index, which has separate locks


def history_is_there(file: Path) -> bool:
    """Return whether there is a history in the file. Raise Refused `not_a_history`, `history_too_old`; OSError."""
    try:
        status = file.lstat()
    except FileNotFoundError:
        return False
    try:
        _refuse_unfit(status)
        _check_without_locks(file)
    except UnfitFile as error:
        raise _not_a_history(file, str(error)) from error
    return True


def identities(file: Path) -> Iterator[FileIdentity]:
    """Yield the identities of a history's file, its log and the log's index, if they exist."""
    for suffix in ("", *SUFFIXES):
        if (identity := file_identity(file.with_name(file.name + suffix))) is not None:
            yield identity


def address_of(file: Path, options: str) -> str:
    """Return the URI with which SQLite opens a file; `options` as in https://sqlite.org/uri.html, 3.3."""
    return f"{file.absolute().as_uri()}?{options}"


def refuse_unmarked(connection: sqlite3.Connection, file: Path) -> None:
    """Raise Refused `not_a_history` for a database that is not a history, before the connection writes."""
    if not _is_marked(connection):
        raise _not_a_history(file, "it is another kind of database")


@contextmanager
def new_file_in_place(file: Path) -> Iterator[Path]:
    """Yield the path for a new database, which is moved to `file` when complete, or removed.

    A file that another process creates at `file` meanwhile remains. No incomplete database is ever at `file`. Raise
    OSError.
    """
    file.parent.mkdir(parents=True, exist_ok=True)
    with TemporaryDirectory(prefix=".history-", dir=file.parent) as folder:
        temporary = Path(folder) / file.name
        yield temporary
        try:
            os.link(temporary, file)
        except FileExistsError:
            pass
        except OSError:  # a file system without links: if two files are created simultaneously, the later one remains
            if not file.exists():
                temporary.replace(file)


def _refuse_unfit(status: os.stat_result) -> None:
    if stat.S_ISLNK(status.st_mode):
        raise UnfitFile("it is a link")
    if not stat.S_ISREG(status.st_mode):
        raise UnfitFile("it is not a regular file")
    if status.st_size == 0:
        raise UnfitFile("it is an empty file; a new history needs a name that does not exist yet")


def _check_without_locks(file: Path) -> None:
    """Read a file without locking or writing. Raise UnfitFile if it is not a history, Refused `history_too_old`."""
    try:
        with closing(sqlite3.connect(address_of(file, "mode=ro&immutable=1"), uri=True)) as connection:
            if _is_too_old(connection):
                raise too_old(str(file))
            if not _is_marked(connection):
                raise UnfitFile("it is another kind of database")
    except sqlite3.DatabaseError as error:
        code = getattr(error, "sqlite_errorcode", None)
        if code == sqlite3.SQLITE_NOTADB:
            raise UnfitFile("it is not an SQLite database") from error
        if code == sqlite3.SQLITE_CANTOPEN:
            raise OSError(str(error)) from error
        # Without a lock, a history may look damaged while another process writes its log into it: `refuse_unmarked`
        # reads it again under a lock.


def _is_marked(connection: sqlite3.Connection) -> bool:
    (mark,) = connection.execute("PRAGMA application_id").fetchone()
    return bool(mark == APPLICATION_ID)


def _is_too_old(connection: sqlite3.Connection) -> bool:
    """Return whether the file has the tables of a history before 0.1.0, which may have no version number."""
    try:
        version = connection.execute("SELECT value FROM meta WHERE key = ?", [DEVELOPMENT_KEY]).fetchone()
        return version is not None and connection.execute("SELECT count(*) FROM run").fetchone() is not None
    except sqlite3.OperationalError:  # it has no such table
        return False


def _not_a_history(file: Path, why: str) -> Refused:
    return Refused(
        "not_a_history",
        f"{file} is not a history, and was not changed: {why}",
        "Give a history, or a new file or database",
    )
