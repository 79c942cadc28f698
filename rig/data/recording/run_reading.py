"""Begins to read a run file in another process, while this one imports modules."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from rig.config.files.regular_file import RECORDING_MAX_BYTES, UnfitFile, open_regular_file
from rig.data.processes.reading_process import MAX_UNPACKED_RATIO, ReadingLimits, ReadingTask, size_without_holes
from rig.errors import Refused

FIRST_RECORDING = "run.h5"
READ_TIMEOUT_S, READ_BYTES_PER_S = 20.0, 5e6  # time for an empty file, and speed of reading the rest
MAX_UNWRITTEN_BYTES = 50_000_000  # bytes of all rows that are announced but missing
LIBRARIES_BYTES = 1 << 29  # memory: more than the libraries and the structures of any file take


def begin_reading(path: Path, timeout_s: float | None = None) -> ReadingTask:
    """Begin to read a run file, within `timeout_s` (None: by its size), and return the running task.

    Raise Refused `no_run_file`, and what `ReadingTask` raises.
    """
    stored = _measure_stored_bytes(path)
    if timeout_s is None:
        timeout_s = READ_TIMEOUT_S + stored / READ_BYTES_PER_S
    return ReadingTask("rig.data.recording.extract:contents", path, {}, _limits(stored, timeout_s))


def _limits(stored_bytes: int, time_s: float) -> ReadingLimits:
    """Return the limits for reading a run file of `stored_bytes` in at most `time_s`.

    They allow for the highest compression that a run file may have.
    """
    rows_bytes = MAX_UNPACKED_RATIO * stored_bytes + MAX_UNWRITTEN_BYTES
    return ReadingLimits(LIBRARIES_BYTES + 3 * rows_bytes, time_s, time_s, 2 * rows_bytes)  # rows, and their copies


def _measure_stored_bytes(path: Path) -> int:
    """Return the size of the data in a run file. Raise Refused `no_run_file`."""
    try:
        with open_regular_file(path, RECORDING_MAX_BYTES) as file:
            return size_without_holes(file)
    except FileNotFoundError:
        why = f"there is no file {path}"
    except UnfitFile as error:
        why = f"{path} cannot be read: {error}"
    except OSError as error:
        why = f"{path} cannot be read: {error.strerror}"
    raise Refused("no_run_file", why, "Give the path of a run.h5 that you may read")


@contextmanager
def reading_ahead(run: Path) -> Iterator[dict[Path, ReadingTask]]:
    """Begin to read the first recording of a run folder, or a run file, and yield the running task by the file's path.

    The task ends with the block. For a folder without a recording, an empty mapping is yielded. Raise as
    `begin_reading` does.
    """
    first = run / FIRST_RECORDING if run.is_dir() else run
    if first != run and not first.exists():
        yield {}
        return
    with begin_reading(first) as reading:
        yield {first: reading}
