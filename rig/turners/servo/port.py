"""The serial port under the maker's packet handler, with the maker's own names for what a port does.

The handler builds and reads the packets; which port it works on is its user's choice. The maker's own `PortHandler`
waits in a loop that takes a whole processor, measures its time-outs by the wall clock, which may be set meanwhile, has
one time-out for every adapter, shares the port with whoever opens it next, and is busy for ever after an exception.
Here the system waits, the clock is monotonic, the time-out is the line's, the port is locked, and a port that has
failed is never used again.
"""

from collections.abc import Sequence
from contextlib import suppress

import serial

from rig.turners.servo.clock import Clock

WAIT_S = 0.002  # a read waits so long at most for the bytes it asks for; then the time-out is looked at
WRITE_S = 1.0  # a write that takes longer has nobody at its far end; pyserial counts what holds this program up, too
BITS = 10  # of a byte on the line: start, eight, stop


class Port:
    """The port at a path or at socket://host:port. Raises `serial.SerialException` where it cannot be had.

    That at a path is locked for this process; at the other end of a socket whoever listens takes one at a time.
    The lock is seen by programs that ask for one. TIOCEXCL would be seen by all, but it outlasts a program that is
    killed wherever something else holds the port open. `slack_s`: how much later than its bytes need a reply may come.
    """

    def __init__(self, path: str, baud: int, slack_s: float, clock: Clock) -> None:
        locked = True if "://" not in path else None
        self.serial = serial.serial_for_url(path, baud, timeout=WAIT_S, write_timeout=WRITE_S, exclusive=locked)
        self.is_using = False
        self._baud, self._slack_s, self._clock = baud, slack_s, clock
        self._deadline_s = 0.0

    def close(self) -> None:
        """Give the port back; one that is gone already is no problem."""
        sock = getattr(self.serial, "_socket", None)  # which pyserial leaves open where the far end has closed it first
        with suppress(OSError):
            self.serial.close()
        if sock is not None:
            sock.close()

    @property
    def byte_s(self) -> float:
        """How long a byte takes."""
        return BITS / self._baud

    # What the packet handler calls ------------------------------------------------------------------------------
    def getBaudRate(self) -> int:  # noqa: N802
        """The baud rate."""
        return self._baud

    def clearPort(self) -> None:  # noqa: N802
        """Forget what has come."""
        self.serial.reset_input_buffer()

    def writePort(self, packet: Sequence[int]) -> int:  # noqa: N802
        """Send a packet; the number of bytes sent."""
        return self.serial.write(bytes(packet)) or 0

    def readPort(self, length: int) -> bytes:  # noqa: N802
        """The next `length` bytes at most, as soon as they are there."""
        data: bytes = self.serial.read(length)
        return data

    def setPacketTimeout(self, packet_length: int) -> None:  # noqa: N802
        """A reply of so many bytes is due from now on."""
        self._deadline_s = self._clock.now_s() + packet_length * self.byte_s + self._slack_s

    def setPacketTimeoutMillis(self, msec: float) -> None:  # noqa: N802
        """A reply is due within `msec`."""
        self._deadline_s = self._clock.now_s() + msec / 1000

    def isPacketTimeout(self) -> bool:  # noqa: N802
        """Whether it is late."""
        return self._clock.now_s() > self._deadline_s
