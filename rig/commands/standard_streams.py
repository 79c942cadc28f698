"""Standard streams that cannot end a run: whoever reads our words may go away at any time; the work goes on."""

import os
import sys
from typing import Any, TextIO


class _Unbroken:
    """A text stream whose loss is no error where it is refused with one of `lost`, and an error once where it is not.

    What it refuses is thrown away, and all that follows.
    """

    def __init__(self, stream: TextIO, lost: type[OSError]) -> None:
        self._stream = stream
        self._lost = lost

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
        if not isinstance(error, self._lost):
            raise error


def keep_streams_usable() -> None:
    """Make stdin, stdout and stderr usable whatever they are: closed, a pipe without a reader, a closed terminal.

    A lost stderr carries only progress, so its loss is never an error. A full disk under stdout loses results, which
    stays an `OSError`; a reader that has gone away (`rig plan … | head`) has what it wanted.
    """
    # A closed descriptor would go to the next file opened, and stray output into that file.
    for descriptor, name in enumerate(("stdin", "stdout", "stderr")):
        if getattr(sys, name) is None:
            nothing = os.open(os.devnull, os.O_RDWR)  # the lowest free number, which is `descriptor`
            os.set_inheritable(nothing, True)  # the processes we start need the same
            setattr(sys, name, os.fdopen(descriptor, "r" if name == "stdin" else "w", encoding="utf-8"))
    if isinstance(sys.stdout, _Unbroken) or isinstance(sys.stderr, _Unbroken):
        return
    reconfigure = getattr(sys.stdout, "reconfigure", None)
    if reconfigure is not None:
        reconfigure(errors="replace")  # a terminal that knows no ° shows a question mark
    sys.stdout, sys.stderr = _Unbroken(sys.stdout, BrokenPipeError), _Unbroken(sys.stderr, OSError)
