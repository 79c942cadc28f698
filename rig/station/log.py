"""The run's log: a line with its time for every event."""

import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from datetime import datetime
from pathlib import Path
from typing import TextIO

from rig.config.files.safe_writing import open_to_append
from rig.errors import Refused
from rig.errors.quoting import printable_lines
from rig.station.events import RunEvent
from rig.station.words import line, reason


class Log:
    """The writer of an open log file. It ignores a full disk, which the recording in the same folder reports."""

    def __init__(self, file: TextIO) -> None:
        self._file = file

    def event(self, event: RunEvent) -> None:
        """Write the event's line, if it has one."""
        text = line(event) or reason(event)
        if text is not None:
            now = datetime.now().isoformat(sep=" ", timespec="milliseconds").replace(".", ",")
            with suppress(OSError):
                self._file.write(f"{now} INFO {printable_lines(text)}\n")
                self._file.flush()


@contextmanager
def log(path: Path) -> Iterator[Log]:
    """Open the log at `path` for the block; existing lines remain.

    Raise Refused `run_folder` if the log cannot be written, because the recording next to it could not be either.
    """
    try:
        file = os.fdopen(open_to_append(path), "a", encoding="utf-8")
    except OSError as error:
        what = f"{path} cannot be written: {error.strerror or error}"
        raise Refused(
            "run_folder", what, "Free space on the disk, or copy the folder to one that you may write"
        ) from error
    try:
        yield Log(file)
    finally:
        with suppress(OSError):
            file.close()
