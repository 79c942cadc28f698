"""The run's log: a line with the time for everything that happened."""

import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from datetime import datetime
from pathlib import Path
from typing import TextIO

from rig.config.written_file import opened_to_append
from rig.errors.quoting import printable_lines
from rig.station.events import RunEvent
from rig.station.words import line, reason


class Log:
    """Writes into an open file. One that can no longer be written is no error here: the recording says so."""

    def __init__(self, file: TextIO) -> None:
        self._file = file

    def event(self, event: RunEvent) -> None:
        """Write the event's line, if it is worth one."""
        text = line(event) or reason(event)
        if text is not None:
            now = datetime.now().isoformat(sep=" ", timespec="milliseconds").replace(".", ",")
            with suppress(OSError):
                self._file.write(f"{now} INFO {printable_lines(text)}\n")
                self._file.flush()


@contextmanager
def log(path: Path) -> Iterator[Log]:
    """The log at `path`, for the length of the `with` block; what is there already stays. Raises OSError."""
    file = os.fdopen(opened_to_append(path), "a", encoding="utf-8")
    try:
        yield Log(file)
    finally:
        with suppress(OSError):
            file.close()
