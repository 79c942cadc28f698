"""Opens files that anybody may have named: regular ones of a sensible size. A pipe or a device may never end."""

import stat
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO


class UnfitFile(Exception):
    """Why a file is not read, as the end of the sentence that names it: "it is no regular file"."""


@contextmanager
def open_regular_file(path: Path, max_bytes: int) -> Iterator[BinaryIO]:
    """A regular file of at most `max_bytes`, open for reading. Raises `UnfitFile`, and OSError as `open` does."""
    status = path.stat()
    if not stat.S_ISREG(status.st_mode):
        raise UnfitFile("it is no regular file")
    if status.st_size > max_bytes:
        raise UnfitFile(f"it is longer than {max_bytes} bytes")
    with path.open("rb") as file:
        yield file


def read_regular_file(path: Path, max_bytes: int) -> bytes:
    """What is in it. Raises as `open_regular_file`."""
    with open_regular_file(path, max_bytes) as file:
        content = file.read(max_bytes + 1)
    if len(content) > max_bytes:  # it has grown meanwhile, or its size is not told (those of /proc say 0)
        raise UnfitFile(f"it is longer than {max_bytes} bytes")
    return content
