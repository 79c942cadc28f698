"""Opens files named by users, if they are regular and of a sensible size. A pipe or a device may never end."""

import os
import stat
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO, Final

RECORDING_MAX_BYTES: Final = 1 << 40  # more than a disk that is full of recordings of days
FileIdentity = tuple[int, int]  # device and inode: they identify the file, whatever name or link it is opened by
_shut: list[Callable[[], Iterable[FileIdentity]]] = []


class UnfitFile(Exception):
    """The reason why a file is not read, as the end of a sentence: "it is not a regular file"."""


def file_identity(path: Path) -> FileIdentity | None:
    """Return the identity of the file or link at a path; None if nothing exists there. Raise OSError."""
    try:
        status = path.lstat()
    except FileNotFoundError:
        return None
    return status.st_dev, status.st_ino


@contextmanager
def shut_files(identities: Callable[[], Iterable[FileIdentity]]) -> Iterator[None]:
    """Prevent this process from opening these files during the block, in which a database uses them.

    Opening and closing such a file would release the database's locks.
    """
    _shut.append(identities)
    try:
        yield
    finally:
        _shut.remove(identities)


@contextmanager
def open_regular_file(path: Path, max_bytes: int, *, follow_links: bool = True) -> Iterator[BinaryIO]:
    """Yield a regular file of at most `max_bytes`, open for reading.

    Raise `UnfitFile`, and OSError as `open` does. Pass `follow_links=False` for a folder in which another
    user can create links.
    """
    # Checked before opening: to open a device may have effects.
    _check(path.stat() if follow_links else path.lstat(), max_bytes)
    with open(path, "rb", opener=_open_nonblocking if follow_links else _open_nofollow) as file:
        _check(os.fstat(file.fileno()), max_bytes)  # another file may have taken its place meanwhile
        yield file


def read_regular_file(path: Path, max_bytes: int, *, follow_links: bool = True) -> bytes:
    """Return the content of a regular file. Raise as `open_regular_file` does."""
    with open_regular_file(path, max_bytes, follow_links=follow_links) as file:
        content = file.read(max_bytes + 1)
    if len(content) > max_bytes:  # it has grown meanwhile, or its size is not stated (files of /proc state 0)
        raise UnfitFile(f"it is longer than {max_bytes} bytes")
    return content


def _check(status: os.stat_result, max_bytes: int) -> None:
    """Raise UnfitFile unless the file is regular, short enough, and not a file of the open history."""
    if stat.S_ISLNK(status.st_mode):
        raise UnfitFile("it is a link")
    if not stat.S_ISREG(status.st_mode):
        raise UnfitFile("it is not a regular file")
    if any((status.st_dev, status.st_ino) in identities() for identities in tuple(_shut)):
        raise UnfitFile("it is the history that is open")
    if status.st_size > max_bytes:
        raise UnfitFile(f"it is longer than {max_bytes} bytes")


def _open_nonblocking(path: str, flags: int) -> int:
    """Return the descriptor of a file, opened without waiting, because a pipe may never have a writer."""
    return os.open(path, flags | getattr(os, "O_NONBLOCK", 0))


def _open_nofollow(path: str, flags: int) -> int:
    return _open_nonblocking(path, flags | getattr(os, "O_NOFOLLOW", 0))
