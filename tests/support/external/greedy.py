"""Readers of files that exceed a limit, for `rig.data.processes.reading_process`."""

import os
import signal
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from rig.data.processes.reading_parts import Part

ZEROS = np.zeros(1_000_000)


def memory(path: Path) -> Iterator[Part]:
    """Allocate memory without end."""
    kept = []
    while True:
        kept.append(bytes(1 << 20))
        yield {}


def processor(path: Path) -> Iterator[Part]:
    """Compute without end."""
    while True:
        pass
    yield dict[str, object]()


def output(path: Path) -> Iterator[Part]:
    """Send parts without end."""
    while True:
        yield ZEROS


def room(path: Path) -> Iterator[Part]:
    """Write to the disk without end, in addition to the parts sent."""
    with Path(os.environ["TMPDIR"], "unpacked").open("wb") as file:
        while True:
            file.write(ZEROS.tobytes())
    yield {}


def patience(path: Path) -> Iterator[Part]:
    """Create the file `asleep`, then sleep without end, which uses no processor."""
    (path / "asleep").touch()
    while True:
        signal.pause()
    yield dict[str, object]()


def crash(path: Path) -> Iterator[Part]:
    """Crash as a library does."""
    os.kill(os.getpid(), signal.SIGSEGV)
    yield {}


def words(path: Path) -> Iterator[Part]:
    """Print, directly and by `print`, and raise an error with a long text."""
    os.write(1, b"it is corrupt\n")
    print("it is corrupt")
    yield {"whole": "yes"}
    raise ValueError("a\nb\x1b[2J" * 1000)
