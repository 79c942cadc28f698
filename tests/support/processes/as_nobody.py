"""A user who may not read what is closed to others: root may read everything."""

import os
from collections.abc import Iterator
from contextlib import contextmanager

NOBODY = 65534


@contextmanager
def drop_root() -> Iterator[None]:
    """In this block the process is no root, in no matter whose hands the tests are."""
    root = os.geteuid() == 0
    if root:
        os.seteuid(NOBODY)
    try:
        yield
    finally:
        if root:
            os.seteuid(0)
