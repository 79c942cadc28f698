"""A serial port as a pseudo-terminal (POSIX): a path that pyserial opens like /dev/ttyACM0."""

import os
import selectors
import termios
import tty
from contextlib import suppress

from rig.world.board.serial_line import SerialLine

_BAUD = {getattr(termios, name): float(name[1:]) for name in dir(termios) if name[0] == "B" and name[1:].isdigit()}
OUTPUT_SPEED = 5  # index in the list that tcgetattr returns


class PtyPort:
    """A pseudo-terminal as the host's end of the serial line, with the baud rate to which the client sets it."""

    def __init__(self, line: SerialLine, selector: selectors.BaseSelector) -> None:
        self._line, self._selector = line, selector
        # The user's side stays open here, which keeps the port alive while no client has it open.
        self._master, self._slave = os.openpty()
        tty.setraw(self._slave)
        os.set_blocking(self._master, False)
        self.path = os.ttyname(self._slave)
        selector.register(self._master, selectors.EVENT_READ, self._ready)

    def _baud(self) -> float | None:
        return _BAUD.get(termios.tcgetattr(self._slave)[OUTPUT_SPEED])

    def _ready(self, events: int) -> None:
        with suppress(OSError):
            self._line.send_to_device(os.read(self._master, 4096), self._baud())

    def tick(self) -> None:
        """Write the device's bytes. Bytes that are not read in time are lost, as on a real port."""
        if self._line.fresh and (data := self._line.read_as_host(self._baud())):
            with suppress(BlockingIOError):
                os.write(self._master, data)

    def close(self) -> None:
        self._selector.unregister(self._master)
        os.close(self._master)
        os.close(self._slave)
