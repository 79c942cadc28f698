"""The serial port under the maker's packet handler, with the methods that the handler calls.

The maker's own `PortHandler` polls with a full processor core, measures time-outs by the wall clock, which may be set,
has one time-out for every adapter, shares the port with other programs, and remains busy after an exception. `Port`
lets the operating system wait for data, uses a monotonic clock and a time-out that suits the line, locks the port, and
never uses a failed port again.
"""

from collections.abc import Sequence
from contextlib import suppress

import serial

from rig.turners.servo.driver_clock import Clock

READ_WAIT_S = 0.002  # longest wait of a read for its bytes, after which the time-out is checked
WRITE_S = 1.0  # a write that takes longer has no receiver; pyserial's time-out includes delays of this program
BITS_PER_BYTE = 10  # on the line: start, eight, stop


class Port:
    """The port at a path or at socket://host:port. Raise `serial.SerialException` if it cannot be opened.

    A path is locked against programs that request a lock; the server behind a socket takes one client at a time.
    (TIOCEXCL would exclude all programs, but outlasts a killed program while another program has the port open.)
    `slack_s`: the delay of a reply beyond the time of its bytes.
    """

    def __init__(self, path: str, baud: int, slack_s: float, clock: Clock) -> None:
        locked = True if "://" not in path else None
        self.serial = serial.serial_for_url(path, baud, timeout=READ_WAIT_S, write_timeout=WRITE_S, exclusive=locked)
        self.is_using = False
        self._baud, self._slack_s, self._clock = baud, slack_s, clock
        self._deadline_s = 0.0

    def close(self) -> None:
        """Close the port, if it is still open."""
        sock = getattr(self.serial, "_socket", None)  # pyserial leaves it open if the far end has closed it first
        with suppress(OSError):
            self.serial.close()
        if sock is not None:
            sock.close()

    @property
    def byte_s(self) -> float:
        """The duration of a byte, s."""
        return BITS_PER_BYTE / self._baud

    # Called by the packet handler ------------------------------------------------------------------------------
    def getBaudRate(self) -> int:  # noqa: N802
        """Return the baud rate."""
        return self._baud

    def clearPort(self) -> None:  # noqa: N802
        """Discard received bytes."""
        self.serial.reset_input_buffer()

    def writePort(self, packet: Sequence[int]) -> int:  # noqa: N802
        """Send a packet; return the number of bytes sent."""
        return self.serial.write(bytes(packet)) or 0

    def readPort(self, length: int) -> bytes:  # noqa: N802
        """Return the next bytes, at most `length`, as soon as they have arrived."""
        data: bytes = self.serial.read(length)
        return data

    def setPacketTimeout(self, packet_length: int) -> None:  # noqa: N802
        """Start the time-out of a reply of `packet_length` bytes."""
        self._deadline_s = self._clock.now_s() + packet_length * self.byte_s + self._slack_s

    def setPacketTimeoutMillis(self, msec: float) -> None:  # noqa: N802
        """Start a time-out of `msec`."""
        self._deadline_s = self._clock.now_s() + msec / 1000

    def isPacketTimeout(self) -> bool:  # noqa: N802
        """Return whether the reply is late."""
        return self._clock.now_s() > self._deadline_s
