"""The parts as the drivers see them: registers behind a chip select, as far as needed to test a driver."""

from typing import Protocol


class Part(Protocol):
    """A part behind a chip select, with the level of its data-ready line."""

    @property
    def line_is_high(self) -> bool: ...

    def transfer(self, data: bytes, max_hz: int, time_us: int, /) -> bytes:
        """Make one access, from chip select to chip select; return the received bytes."""


class Nobody:
    """A line without a part: all ones by the pull-up, or all zeros if it is shorted."""

    def __init__(self, level: int = 0xFF) -> None:
        self.level = level
        self.transfers = 0
        self.line_is_high = False

    def transfer(self, data: bytes, _max_hz: int, _time_us: int) -> bytes:
        self.transfers += 1
        return bytes((self.level,)) * len(data)


class ByteRegisters:
    """Registers of one byte; the address counts up in a burst. `fresh`: whether there is an unread conversion.

    `max_hz`: the fastest clock of the bus. Each part's `read` defines what a burst reads and changes.
    """

    max_hz = 10e6

    def __init__(self, size: int = 128) -> None:
        self.values = bytearray(size)
        self.writes: list[tuple[int, int]] = []
        self.stuck: set[int] = set()  # registers that ignore writes
        self.transfers: list[int] = []
        self.fresh = False

    @property
    def line_is_high(self) -> bool:
        """False, for parts that signal by pulses."""
        return False

    def transfer(self, data: bytes, max_hz: int, time_us: int) -> bytes:
        """Make one access, from chip select to chip select; return the received bytes."""
        assert max_hz <= self.max_hz
        self.transfers.append(len(data))
        address, reading = data[0] & 0x7F, data[0] & 0x80
        if reading:
            return b"\0" + self.read(address, len(data) - 1)
        for offset, value in enumerate(data[1:]):
            self.writes.append((address + offset, value))
            if address + offset not in self.stuck:
                self.write(address + offset, value)
        return bytes(len(data))

    def write(self, address: int, value: int) -> None:
        """Handle a byte written to the part."""
        self.values[address] = value

    def read(self, address: int, size: int) -> bytes:
        """Return the bytes from `address` on, with all effects of reading them."""
        return bytes(self.values[address : address + size])
