"""Standard streams that cannot end a run: without a reader of the output the work continues."""

import os
import sys
from pathlib import Path
from typing import Any, TextIO


class _Unbroken:
    """A text stream whose writes never fail: after an OSError, this and all later output is discarded.

    `lost`: the error; None if there was none, or if the reader closed the pipe.
    """

    def __init__(self, stream: TextIO) -> None:
        self._stream = stream
        self.lost: OSError | None = None

    def write(self, text: str) -> int:
        try:
            return self._stream.write(text)
        except OSError as error:
            self._lose(error)
            return len(text)

    def flush(self) -> None:
        try:
            self._stream.flush()
        except OSError as error:
            self._lose(error)

    def __getattr__(self, name: str) -> Any:
        return getattr(self._stream, name)

    def _lose(self, error: OSError) -> None:
        # On the descriptor itself: what is still buffered would fail again when the interpreter ends.
        nothing = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nothing, self._stream.fileno())
        os.close(nothing)
        if not isinstance(error, BrokenPipeError):
            self.lost = error


def output_lost() -> OSError | None:
    """Return why stdout has lost output since the last call; None if it has lost nothing."""
    stream = sys.stdout
    if not isinstance(stream, _Unbroken):
        return None
    stream.flush()
    lost, stream.lost = stream.lost, None
    return lost


def say_where_the_result_is(result: Path) -> None:
    """Print on stderr where the complete `result` is, if stdout has lost output. The exit status is unchanged."""
    from rig.station.plain_text import say

    if (lost := output_lost()) is not None:
        why = f"stdout has not taken what was to be printed ({lost.strerror or lost})"
        say(f"rig: output_lost: {why}. The result is complete: {result}", sys.stderr)


def keep_streams_usable() -> None:
    """Make stdin, stdout and stderr usable in any state: closed, a pipe without a reader, a closed terminal.

    If one of them is lost, the work continues. stderr has only progress. If stdout is a file on a full disk, results
    are lost, and `output_lost` returns why; a reader that has closed the pipe (`rig plan … | head`) has read enough.
    """
    # A closed descriptor would go to the next file opened, and stray output into that file.
    for descriptor, name in enumerate(("stdin", "stdout", "stderr")):
        if getattr(sys, name) is None:
            nothing = os.open(os.devnull, os.O_RDWR)  # the lowest free number, which is `descriptor`
            os.set_inheritable(nothing, True)  # the processes we start need them too
            setattr(sys, name, os.fdopen(descriptor, "r" if name == "stdin" else "w", encoding="utf-8"))
    if isinstance(sys.stdout, _Unbroken) or isinstance(sys.stderr, _Unbroken):
        return
    reconfigure = getattr(sys.stdout, "reconfigure", None)
    if reconfigure is not None:
        reconfigure(errors="replace")  # a terminal without the character ° shows a question mark
    sys.stdout, sys.stderr = _Unbroken(sys.stdout), _Unbroken(sys.stderr)
