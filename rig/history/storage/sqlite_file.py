"""A history's file is looked at before anything opens it to write: what is no history stays as it is.

SQLite alone opens the file. Its locks belong to the process (POSIX advisory locks): if any other code of the process
opens the file and closes it, the locks of all its connections are gone, and the next process believes that it is alone.
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

BESIDE = ("-wal", "-shm")  # what SQLite lays beside a database: its log, and the log's index with locks of its own


def history_is_there(file: Path) -> bool:
    """Return whether there is a history; False if there is nothing at all.

    Raises Refused `not_a_history`, `history_too_old`; OSError.
    """
    try:
        status = file.lstat()
    except FileNotFoundError:
        return False
    try:
        _refuse_unfit(status)
        _look(file)
    except UnfitFile as error:
        raise _refused(file, str(error)) from error
    return True


def identities(file: Path) -> Iterator[FileIdentity]:
    """Identify a history's file, its log and the log's index, as far as they are there."""
    for name in ("", *BESIDE):
        if (found := file_identity(file.with_name(file.name + name))) is not None:
            yield found


def address_of(file: Path, options: str) -> str:
    """The address under which SQLite opens a file; `options` as in https://sqlite.org/uri.html, 3.3."""
    return f"{file.absolute().as_uri()}?{options}"


def refuse_unmarked(connection: sqlite3.Connection, file: Path) -> None:
    """Read from a new connection whose database it is, before it writes anything. Raises Refused `not_a_history`."""
    if not _is_marked(connection):
        raise _refused(file, "it is a database of something else")


@contextmanager
def made_whole(file: Path) -> Iterator[Path]:
    """The path for a new database, which is put in place of `file` when it is finished, or is gone.

    Somebody else's that is there by then stays. Nobody ever sees a part of one. Raises OSError.
    """
    file.parent.mkdir(parents=True, exist_ok=True)
    with TemporaryDirectory(prefix=".history-", dir=file.parent) as folder:
        beside = Path(folder) / file.name
        yield beside
        try:
            os.link(beside, file)
        except FileExistsError:
            pass
        except OSError:  # a file system without links, where of two that begin at the same moment the later one stays
            if not file.exists():
                beside.replace(file)


def _refuse_unfit(status: os.stat_result) -> None:
    if stat.S_ISLNK(status.st_mode):
        raise UnfitFile("it is a link to something else")
    if not stat.S_ISREG(status.st_mode):
        raise UnfitFile("it is no regular file")
    if status.st_size == 0:
        raise UnfitFile("it is an empty file, and a new history needs a name that does not exist yet")


def _look(file: Path) -> None:
    """Read a file as on a medium that takes no more: lock and write nothing.

    Raises UnfitFile if it is no history, Refused `history_too_old`.
    """
    try:
        with closing(sqlite3.connect(address_of(file, "mode=ro&immutable=1"), uri=True)) as connection:
            if _is_too_old(connection):
                raise too_old(str(file))
            if not _is_marked(connection):
                raise UnfitFile("it is a database of something else")
    except sqlite3.DatabaseError as error:
        code = getattr(error, "sqlite_errorcode", None)
        if code == sqlite3.SQLITE_NOTADB:
            raise UnfitFile("it is no database of SQLite") from error
        if code == sqlite3.SQLITE_CANTOPEN:
            raise OSError(str(error)) from error
        # Read without a lock, a history into which another process just writes its log may look damaged: whoever opens
        # it looks again under a lock, by `refuse_unmarked`.


def _is_marked(connection: sqlite3.Connection) -> bool:
    (mark,) = connection.execute("PRAGMA application_id").fetchone()
    return bool(mark == APPLICATION_ID)


def _is_too_old(connection: sqlite3.Connection) -> bool:
    """Return whether it has the tables of a history before 0.1.0, of which not all were marked."""
    try:
        version = connection.execute("SELECT value FROM meta WHERE key = ?", [DEVELOPMENT_KEY]).fetchone()
        return version is not None and connection.execute("SELECT count(*) FROM run").fetchone() is not None
    except sqlite3.OperationalError:  # it has no such table
        return False


def _refused(file: Path, why: str) -> Refused:
    return Refused(
        "not_a_history",
        f"{file} is not a history, and was not changed: {why}",
        "Give a history, or a file or database that is new",
    )
