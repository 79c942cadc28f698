"""Wall times, for the report of `make proof`, not for tests."""

import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager


@contextmanager
def time_block(times_s: list[float]) -> Iterator[None]:
    """Add the duration of the block to `times_s`."""
    began_s = time.monotonic()
    yield
    times_s.append(time.monotonic() - began_s)


def times_in_words(times_s: Sequence[float]) -> str:
    """Return the times in words."""
    return ", ".join(f"{time_s:.2f} s" for time_s in times_s)
