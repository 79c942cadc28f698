"""A full disk, as this process sees it."""

import sys
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def full_disk(left_bytes: int = 0) -> Iterator[None]:
    """Prevent writing any file beyond `left_bytes` in this block; the system's error is then "File too large".

    Python stores no compiled modules here either: they would be truncated without an error.
    """
    import resource  # which Windows has not

    compiles, soft_hard = sys.dont_write_bytecode, resource.getrlimit(resource.RLIMIT_FSIZE)
    sys.dont_write_bytecode = True
    resource.setrlimit(resource.RLIMIT_FSIZE, (left_bytes, soft_hard[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, soft_hard)
        sys.dont_write_bytecode = compiles
