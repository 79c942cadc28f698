"""A history's file is looked at before anything opens it to write: what is no history stays as it is."""

import os
import sqlite3
import stat
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from tempfile import TemporaryDirectory

from rig.config.regular_file import UnfitFile
from rig.errors import Refused

APPLICATION_ID = 0x52494748  # "RIGH", at bytes 68 to 71 of the file (SQLite's file format, 1.3.13)
HEADER_BYTES, MAGIC, ID_AT = 100, b"SQLite format 3\0", slice(68, 72)


def history_is_there(file: Path) -> bool:
    """Whether there is a history; False where there is nothing at all. Raises Refused `not_a_history`, OSError."""
    try:
        header = _header(file)
        if header is None:
            return False
        ours = header[ID_AT] == APPLICATION_ID.to_bytes(4, "big") or _is_of_before(file)
    except UnfitFile as error:
        raise _refused(file, str(error)) from error
    if not ours:
        raise _refused(file, "it is a database of something else")
    return True


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


def _header(file: Path) -> bytes | None:
    try:
        # Opened without waiting for the other end of a pipe, and never through a link.
        descriptor = os.open(file, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK)
    except FileNotFoundError:
        return None
    except OSError as error:
        if file.is_symlink():
            raise UnfitFile("it is a link to something else") from error
        raise
    try:
        if not stat.S_ISREG(os.fstat(descriptor).st_mode):
            raise UnfitFile("it is no regular file")
        header = os.read(descriptor, HEADER_BYTES)
    finally:
        os.close(descriptor)
    if not header:
        raise UnfitFile("it is an empty file, and a new history needs a name that does not exist yet")
    if len(header) < HEADER_BYTES or not header.startswith(MAGIC):
        raise UnfitFile("it is no database of SQLite")
    return header


def _is_of_before(file: Path) -> bool:
    """Whether it has the tables of a history made before files were marked. Reads; locks and writes nothing."""
    path = f"{file.absolute().as_uri()}?mode=ro&immutable=1"
    try:
        with closing(sqlite3.connect(path, uri=True)) as connection:
            version = connection.execute("SELECT value FROM meta WHERE key = 'version'").fetchone()
            return version is not None and connection.execute("SELECT count(*) FROM run").fetchone() is not None
    except sqlite3.DatabaseError:
        return False


def _refused(file: Path, why: str) -> Refused:
    return Refused(
        "not_a_history",
        f"{file} is not a history, and was not changed: {why}",
        "Give a history, or a file or database that is new",
    )
