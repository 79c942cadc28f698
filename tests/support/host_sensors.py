"""The parts as the drivers see them: registers behind a chip select, enough to tell what a driver does."""

from collections.abc import Callable, Sequence
from typing import Protocol


class Part(Protocol):
    """What is at the other end of a chip select."""

    def transfer(self, data: bytes, max_hz: int, time_us: int, /) -> bytes:
        """One chip select: the bytes in, the bytes out."""


class Nobody:
    """A wire that nobody drives: all ones by the pull-up, or all zeros where it is shorted."""

    def __init__(self, level: int = 0xFF) -> None:
        self.level = level
        self.transfers = 0

    def transfer(self, data: bytes, _max_hz: int, _time_us: int) -> bytes:
        self.transfers += 1
        return bytes((self.level,)) * len(data)


class Lsm9ds1Registers:
    """Registers that count up in a burst; a new conversion raises flags that reading the last outputs lowers.

    Both triads are left-handed: the registers hold x with the other sign.
    """

    max_hz = 10e6

    def __init__(self) -> None:
        self.values = bytearray(128)
        self.values[0x0F] = 0x68
        self.values[0x22] = 0x04  # IF_ADD_INC, as after power-up
        self.writes: list[tuple[int, int]] = []
        self.stuck: set[int] = set()  # registers that ignore writes
        self.transfers: list[int] = []
        self.fresh = self.fresh_acceleration = False
        self.again_after_reading = 0  # so many times a conversion comes just when the last one has been read
        self.before_acceleration: Callable[[], None] | None = (
            None  # what happens once, before the accelerations are read
        )
        self.after_acceleration: Callable[[], None] | None = None  # or just after

    def transfer(self, data: bytes, max_hz: int, _time_us: int) -> bytes:
        """One chip select: the bytes in, the bytes out."""
        assert max_hz <= self.max_hz
        self.transfers.append(len(data))
        address, reading = data[0] & 0x7F, data[0] & 0x80
        if not reading:
            for offset, value in enumerate(data[1:]):
                self.writes.append((address + offset, value))
                if address + offset not in self.stuck:
                    self.values[address + offset] = value
            return bytes(len(data))
        return b"\0" + self._read(address, len(data) - 1, max_hz)

    def _read(self, address: int, size: int, _max_hz: int) -> bytes:
        reads_acceleration = address <= 0x2D < address + size
        if reads_acceleration and self.before_acceleration is not None:
            before, self.before_acceleration = self.before_acceleration, None
            before()
        self.values[0x17] = self.values[0x27] = 0x02 * self.fresh | 0x01 * self.fresh_acceleration
        read = bytes(self.values[address : address + size])
        if address <= 0x1D < address + size:
            self.fresh = self.again_after_reading > 0
            self.again_after_reading -= self.fresh
        if reads_acceleration:
            self.fresh_acceleration = False
            if self.after_acceleration is not None:
                after, self.after_acceleration = self.after_acceleration, None
                after()
        return read

    def convert(self, counts: Sequence[int], temperature: int, acceleration: Sequence[int] = (0, 0, 0)) -> None:
        """A new conversion in the output registers, of vectors in right-handed axes."""
        words = (temperature, -counts[0], *counts[1:], -acceleration[0], *acceleration[1:])
        for address, value in zip((0x15, 0x18, 0x1A, 0x1C, 0x28, 0x2A, 0x2C), words, strict=True):
            self.values[address : address + 2] = min(value, 32767).to_bytes(2, "little", signed=True)
        self.fresh = self.fresh_acceleration = True


class MagnetometerRegisters(Lsm9ds1Registers):
    """The LSM9DS1's other die: bit 6 of an address lets it count up; data are fresh until all have been read."""

    def __init__(self) -> None:
        super().__init__()
        self.values = bytearray(64)
        self.values[0x0F] = 0x3D
        self.values[0x20], self.values[0x22] = 0x10, 0x03  # as after power-up
        self.is_heard = True  # False: the wire it answers on is not connected

    def transfer(self, data: bytes, max_hz: int, time_us: int) -> bytes:
        assert len(data) == 2 or data[0] & 0x40, "without that bit the same register answers over and over"
        answer = super().transfer(bytes((data[0] & ~0x40,)) + data[1:], max_hz, time_us)
        return answer if self.is_heard else b"\xff" * len(data)

    def _read(self, address: int, size: int, _max_hz: int) -> bytes:
        self.values[0x27] = 0x0F * self.fresh
        read = bytes(self.values[address : address + size])
        self.fresh = self.fresh and not address <= 0x2D < address + size
        return read

    def convert(self, counts: Sequence[int], _temperature: int = 0, _acceleration: Sequence[int] = ()) -> None:
        """A new conversion of the field; the die has no thermometer."""
        self.values[0x28:0x2E] = b"".join(count.to_bytes(2, "little", signed=True) for count in counts)
        self.fresh = True


class Mpu9250Registers(Lsm9ds1Registers):
    """High byte first; only sensor and interrupt registers are read faster than 1 MHz; reading clears the status."""

    max_hz = 20e6

    def __init__(self) -> None:
        super().__init__()
        self.values = bytearray(128)
        self.values[0x75] = 0x71
        self.values[0x6B] = 0x01  # CLKSEL, as after power-up

    def transfer(self, data: bytes, max_hz: int, time_us: int) -> bytes:
        first = data[0] & 0x7F
        is_data = data[0] & 0x80 and first >= 0x3A and first + len(data) - 2 <= 0x48
        assert is_data or max_hz <= 1e6
        return super().transfer(data, max_hz, time_us)

    def _read(self, address: int, size: int, _max_hz: int) -> bytes:
        self.values[0x3A] = 0x01 if self.fresh else 0x00
        if address <= 0x3A < address + size:
            self.fresh = False
        return bytes(self.values[address : address + size])

    def convert(
        self, counts: Sequence[int], temperature: int, acceleration: Sequence[int] = (0x11, -0x22, 0x33)
    ) -> None:
        words = (*acceleration, temperature, *counts)
        self.values[0x3B:0x49] = b"".join(word.to_bytes(2, "big", signed=True) for word in words)
        self.fresh = True


class Adis16465Registers:
    """Words of 16 bits, high byte first; an answer comes one frame later, a setting some time after its writing."""

    def __init__(self) -> None:
        self.words = {
            0x00: 0,
            0x02: 0,
            **dict.fromkeys(range(0x04, 0x1C, 2), 0),
            **dict.fromkeys(range(0x40, 0x58, 2), 0),
        }
        self.words |= {0x5C: 0, 0x5E: 0x0007, 0x60: 0x00C1, 0x64: 0, 0x68: 0, 0x72: 0x4051}
        self.writes: list[tuple[int, int]] = []
        self.stuck: set[int] = set()  # registers that ignore writes
        self.transfers: list[int] = []
        self.status = 0
        self.counter = 0
        self.taking_us = 150
        self.cured_by_reset = False  # what DIAG_STAT says goes with the next reset
        self.before_burst: Callable[[], None] | None = None  # what happens once, just before the registers are read
        self.after_burst: Callable[[], None] | None = None  # or just after
        self.damage = 0  # added to the next bursts' last data byte
        self._data = [0] * 7
        self._answer = 0
        self._pending: dict[int, tuple[int, int]] = {}  # register → when its new value can be read, the value
        self._idle_since_us = -100

    def transfer(self, data: bytes, max_hz: int, time_us: int) -> bytes:
        """One chip select: the bytes in, the bytes out."""
        assert max_hz <= (2e6 if len(data) == 2 else 1e6), "a burst is slow"
        assert (time_us - self._idle_since_us) % 2**32 >= 16, "the part needs 16 µs between frames"
        self._idle_since_us = time_us
        self.transfers.append(len(data))
        if data == b"\x68" + bytes(21):
            before, self.before_burst = self.before_burst, None
            if before is not None:
                before()
            burst = self._answer.to_bytes(2, "big") + self._burst()
            after, self.after_burst = self.after_burst, None
            if after is not None:
                after()
            return burst
        assert len(data) == 2
        answer, address = self._answer, data[0] & 0x7E
        if data[0] & 0x80:
            self._write(data[0] & 0x7F, data[1], time_us)
        else:
            due_us, value = self._pending.get(address, (0, 0))
            if address in self._pending and time_us >= due_us:
                self.words[address] = value
            self._answer = self.words[address]
        return answer.to_bytes(2, "big")

    def _write(self, address: int, byte: int, time_us: int) -> None:
        self.writes.append((address, byte))
        word = address & 0x7E
        if (word, byte) == (0x68, 0x80) and self.cured_by_reset:
            self.words[0x02] = 0
        if word not in self.stuck:
            _, value = self._pending.get(word, (0, self.words[word]))
            value = value & 0x00FF | byte << 8 if address & 1 else value & 0xFF00 | byte
            self._pending[word] = (time_us + self.taking_us, value)

    def _burst(self) -> bytes:
        words = [self.status, *self._data, self.counter]
        body = bytearray(b"".join((word & 0xFFFF).to_bytes(2, "big") for word in words))
        total = sum(body)
        body[-1] = (body[-1] + self.damage) & 0xFF
        return bytes(body) + total.to_bytes(2, "big")

    def convert(
        self,
        counts: Sequence[int],
        temperature: int,
        acceleration: Sequence[int] = (0x0111, -0x0222, 0x0333),
        low_words: Sequence[int] = (0, 0, 0, 0, 0, 0),
    ) -> None:
        """A new conversion in the output registers: upper words, and the lower ones of all six."""
        self._data = [*counts, *acceleration, temperature]
        self.counter = (self.counter + 1) & 0xFFFF
        for output, (low, upper) in enumerate(zip(low_words, self._data[:6], strict=True)):
            self.words[0x04 + 4 * output] = low
            self.words[0x06 + 4 * output] = upper & 0xFFFF
        self.words[0x22] = self.counter
