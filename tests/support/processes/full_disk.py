"""A disk that takes no more, as this process sees it."""

import sys
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def full_disk(left_bytes: int = 0) -> Iterator[None]:
    """No file can be written beyond `left_bytes` in this block: "File too large", as the system says then.

    Nor is what Python compiles of a module that is imported here: it would be kept cut short, and no error said.
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
