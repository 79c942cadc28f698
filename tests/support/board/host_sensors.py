"""The parts as the drivers see them: registers behind a chip select, enough to tell what a driver does."""

from typing import Protocol


class Part(Protocol):
    """What is at the other end of a chip select, and the level of its data-ready line."""

    @property
    def line_is_high(self) -> bool: ...

    def transfer(self, data: bytes, max_hz: int, time_us: int, /) -> bytes:
        """One chip select: the bytes in, the bytes out."""


class Nobody:
    """A wire that nobody drives: all ones by the pull-up, or all zeros where it is shorted."""

    def __init__(self, level: int = 0xFF) -> None:
        self.level = level
        self.transfers = 0
        self.line_is_high = False

    def transfer(self, data: bytes, _max_hz: int, _time_us: int) -> bytes:
        self.transfers += 1
        return bytes((self.level,)) * len(data)


class ByteRegisters:
    """Registers of one byte that count up in a burst. `fresh`: there is a conversion that nobody has read.

    `max_hz`: the fastest clock of the bus. What a burst reads, and what that changes, is the part's own `read`.
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
        """False, for parts with pulses."""
        return False

    def transfer(self, data: bytes, max_hz: int, time_us: int) -> bytes:
        """One chip select: the bytes in, the bytes out."""
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
        """Handle a byte that is written to the part."""
        self.values[address] = value

    def read(self, address: int, size: int) -> bytes:
        """The bytes from `address` on, and what reading them changes."""
        return bytes(self.values[address : address + size])
