"""A script in place of the scanner and the operator: it types at a station's terminal and reads the output."""

import os
import pty
import subprocess
import termios
import threading
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from support.processes.waiting import PATIENCE_S
from support.processes.warm import start_module


class Scanner:
    """The keyboard and display of a station that was started with a terminal as its standard input."""

    def __init__(self, process: "subprocess.Popen[bytes]", terminal: int) -> None:
        self.process = process
        self._terminal = terminal
        self._output = ""
        self._read = 0  # end of the text waited for so far
        self._over = False  # it says no more
        self._more = threading.Condition()
        threading.Thread(target=self._listen, daemon=True).start()

    def types(self, line: str) -> None:
        """Type a line and Enter."""
        os.write(self._terminal, f"{line}\n".encode())

    def waits_for(self, words: str) -> None:
        """Wait for these words, behind those waited for before."""
        self._read = self.sees(words)

    def sees(self, words: str) -> int:
        """Wait for these words without a move of the reading position."""
        with self._more:
            self._more.wait_for(lambda: self._end(words) >= 0 or self._over, PATIENCE_S)
            end = self._end(words)
            assert end >= 0, f"{words!r} not said after:\n{self._output[max(0, self._read - 2000) :]}"
            return end

    def has_printed(self, words: str) -> bool:
        """Return whether these words were ever printed."""
        with self._more:
            return words in self._output

    def _end(self, words: str) -> int:
        """Return the end of the words behind the reading position; -1 if they are not there."""
        position = self._output.find(words, self._read)
        return position + len(words) if position >= 0 else -1

    def _listen(self) -> None:
        assert self.process.stderr is not None
        while data := os.read(self.process.stderr.fileno(), 65536):
            with self._more:
                self._output += data.decode(errors="replace")
                self._more.notify_all()
        with self._more:
            self._over = True
            self._more.notify_all()


@contextmanager
def station(*arguments: str | Path, start: Callable[..., "subprocess.Popen[Any]"] = start_module) -> Iterator[Scanner]:
    """Run `rig station …`, ended by force if it has not ended by itself after the block."""
    terminal, far_end = pty.openpty()
    modes = termios.tcgetattr(far_end)
    modes[3] &= ~termios.ECHO
    termios.tcsetattr(far_end, termios.TCSANOW, modes)
    with start("station", *arguments, stdin=far_end, stdout=subprocess.PIPE, stderr=subprocess.PIPE) as process:
        os.close(far_end)
        try:
            yield Scanner(process, terminal)
        finally:
            process.kill()
            process.wait()
            os.close(terminal)
