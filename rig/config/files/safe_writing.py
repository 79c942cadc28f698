"""Writes files into folders of any user, never through a link or into a pipe."""

import os
import stat
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from pathlib import Path
from typing import BinaryIO

PART_SUFFIX = ".part"
# Temporary files by their final paths.
_held_back: ContextVar[dict[Path, Path] | None] = ContextVar("held_back", default=None)
NO_FOLLOW_FLAG = getattr(os, "O_NOFOLLOW", 0)


@contextmanager
def replace_together() -> Iterator[None]:
    """Keep the files that `new_file` writes in this block under temporary names, and move them at the block's end.

    They are moved in reverse order of writing. If the block raises an error, or a file cannot be moved, the files that
    have not been moved yet are removed.
    """
    parts: dict[Path, Path] = {}
    token = _held_back.set(parts)
    try:
        yield
        for path in reversed([*parts]):
            parts[path].replace(path)
            del parts[path]
    finally:
        _held_back.reset(token)
        for part in parts.values():
            with suppress(OSError):
                part.unlink()


@contextmanager
def new_file(path: Path) -> Iterator[BinaryIO]:
    """Yield a file to be written in this block. At its end the file replaces `path`, completely or not at all.

    Within `replace_together` this happens at the end of that block. If `path` is a link, the link is replaced, not its
    target. Raise OSError as writing does, also if another process creates a file of that name meanwhile.
    """
    part = path.with_name(path.name + PART_SUFFIX)
    part.unlink(missing_ok=True)
    try:
        with open(part, "xb", opener=_open_without_links) as file:
            yield file
        if (held_back := _held_back.get()) is None:
            part.replace(path)
        else:
            held_back[path] = part
    except BaseException as error:
        with suppress(OSError):
            part.unlink()
        if isinstance(error, OSError) and error.filename is None:
            error.filename = str(path)  # the error of a full disk does not name the file
        raise


def write_new(path: Path, content: bytes | str) -> None:
    """Replace `path` by a file with this content. Raise as `new_file` does."""
    with new_file(path) as file:
        file.write(content.encode() if isinstance(content, str) else content)


def open_to_append(path: str | Path) -> int:
    """Open a regular file to append to it, or create it; return its descriptor. Raise OSError."""
    flags = os.O_WRONLY | os.O_CREAT | os.O_APPEND | NO_FOLLOW_FLAG | getattr(os, "O_NONBLOCK", 0)
    descriptor = os.open(path, flags, 0o666)
    if not stat.S_ISREG(os.fstat(descriptor).st_mode):
        os.close(descriptor)
        raise OSError(f"{path} is not a regular file")
    return descriptor


def _open_without_links(path: str, flags: int) -> int:
    return os.open(path, flags | NO_FOLLOW_FLAG, 0o666)
