"""Readers of files that take more than they may: for `rig.data.processes.reading_process`."""

import os
import signal
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from rig.data.processes.reading_parts import Part

ZEROS = np.zeros(1_000_000)


def memory(path: Path) -> Iterator[Part]:
    """Keep without end."""
    kept = []
    while True:
        kept.append(bytes(1 << 20))
        yield {}


def processor(path: Path) -> Iterator[Part]:
    """Reckon without end."""
    while True:
        pass
    yield dict[str, object]()


def output(path: Path) -> Iterator[Part]:
    """Tell without end."""
    while True:
        yield ZEROS


def room(path: Path) -> Iterator[Part]:
    """Unpack without end, beside what is told."""
    with Path(os.environ["TMPDIR"], "unpacked").open("wb") as file:
        while True:
            file.write(ZEROS.tobytes())
    yield {}


def patience(path: Path) -> Iterator[Part]:
    """Sleep without end, which uses up nothing, once there is a file that says so."""
    (path / "asleep").touch()
    while True:
        signal.pause()
    yield dict[str, object]()


def crash(path: Path) -> Iterator[Part]:
    """End as a library does that breaks down."""
    os.kill(os.getpid(), signal.SIGSEGV)
    yield {}


def words(path: Path) -> Iterator[Part]:
    """Print, on every stream, and complain at length."""
    os.write(1, b"it is corrupt\n")
    print("it is corrupt")
    yield {"whole": "yes"}
    raise ValueError("a\nb\x1b[2J" * 1000)
