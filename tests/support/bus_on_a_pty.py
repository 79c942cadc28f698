"""A bus of servos on a pseudo-terminal, at the pace of the clock on the wall: for programs that only want a port."""

import selectors
import time
from collections.abc import Callable

from rig.world.board.pty_port import PtyPort
from rig.world.board.serial_line import SerialLine
from rig.world.servo.bus import Bus

TICK_S = 0.002  # the world looks at its servos at least this often


class BusOnAPty:
    """`port` is the path to open; `live` lets it live for a while, in whatever thread or process it is called."""

    def __init__(self, make: Callable[[Callable[[], float]], Bus]) -> None:
        self._selector = selectors.DefaultSelector()
        self.bus = make(time.monotonic)
        self.line = SerialLine(lambda: self.bus, seed=3)
        self._pty = PtyPort(self.line, self._selector)
        self._open = True
        self.port = self._pty.path

    def live(self, duration_s: float = TICK_S) -> None:
        """Serve the port for about so long. What has come is heard before it is too late for the watchdog."""
        ends_s = time.monotonic() + duration_s
        while (now_s := time.monotonic()) < ends_s:
            wait_s = min(ends_s, self.bus.due_s()) - now_s
            if self._open:
                for key, events in self._selector.select(max(0.0, min(wait_s, TICK_S))):
                    key.data(events)
            else:
                time.sleep(TICK_S)
            self.bus.advance()
            self.line.tick()
            if self._open:
                self._pty.tick()

    def pull_out(self) -> None:
        """Take the converter out of the host: the port is gone."""
        if self._open:
            self._open = False
            self._pty.close()

    def close(self) -> None:
        """End with it."""
        self.pull_out()
        self._selector.close()
