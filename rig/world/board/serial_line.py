"""A serial line: bytes between what it comes from and the host, spoilt by unlike baud rates or a bad wire."""

from collections.abc import Callable
from typing import Protocol

import numpy as np

TOLERANCE = 0.03  # of the baud rate; a receiver still reads ten bits right


def misread(data: bytes, sent_baud: float, read_baud: float) -> bytes:
    """What a receiver at `read_baud` makes of `data` sent back to back at `sent_baud` (8 data bits, 1 stop bit)."""
    if abs(sent_baud / read_baud - 1.0) < TOLERANCE:
        return data
    line = [bit for byte in data for bit in (0, *(byte >> i & 1 for i in range(8)), 1)]
    bit_length = sent_baud / read_baud  # of the receiver's bits, in the sender's

    def level(time: float) -> int:
        return line[int(time)] if time < len(line) else 1  # an idle line is high

    seen = bytearray()
    time = 0.0
    while time < len(line):
        if level(time):
            time = float(int(time) + 1)  # the next place where the line may fall
            continue
        if level(time + 0.5 * bit_length) == 0:  # else a glitch shorter than half a bit
            seen.append(sum(level(time + (1.5 + i) * bit_length) << i for i in range(8)))
            time += 9.5 * bit_length
        else:
            time = float(int(time) + 1)
    return bytes(seen)


class Device(Protocol):
    """What stands at the far end of a serial line."""

    @property
    def baud_rate(self) -> float | None:
        """The device's baud rate; None while it neither sends nor hears."""

    def transmitted(self) -> bytes: ...
    def receive(self, data: bytes) -> None: ...


class SerialLine:
    """A line between a device of the laboratory (None: it has no power) and the host's end.

    `host_baud` is the host's baud rate where the transport does not tell (None: the same as the device's); a `silent`
    line loses everything both ways; of what the device sends, each bit is wrong with the probability `bit_error_rate`.
    Another program that has opened the same port takes the rest of what came in a tick with the probability `stolen`.
    """

    def __init__(self, device: Callable[[], Device | None], seed: int = 0) -> None:
        self._device = device
        self._random = np.random.default_rng(seed)
        self.host_baud: float | None = None
        self.silent = False
        self.bit_error_rate = 0.0
        self.stolen = 0.0
        self.fresh = b""  # what the device has sent in the last tick, as the line carries it

    @property
    def baud(self) -> float | None:
        """The device's baud rate; None while its USART is off or it has no power."""
        device = self._device()
        return device.baud_rate if device is not None else None

    def tick(self) -> None:
        device = self._device()
        self.fresh = device.transmitted() if device is not None else b""
        if self.stolen and self.fresh and self._random.random() < self.stolen:
            self.fresh = self.fresh[: int(self._random.integers(len(self.fresh)))]
        if self.bit_error_rate and self.fresh:
            bits = np.unpackbits(np.frombuffer(self.fresh, np.uint8))
            self.fresh = np.packbits(bits ^ (self._random.random(len(bits)) < self.bit_error_rate)).tobytes()

    def to_host(self, host_baud: float | None) -> bytes:
        """What a host at `host_baud` reads in this tick."""
        if self.silent or not self.fresh:
            return b""
        wanted, baud = host_baud or self.host_baud, self.baud
        return misread(self.fresh, baud, wanted) if wanted and baud else self.fresh

    def to_device(self, data: bytes, host_baud: float | None) -> None:
        """A host at `host_baud` sends."""
        device, baud = self._device(), self.baud
        if self.silent or device is None or not baud:
            return
        wanted = host_baud or self.host_baud
        device.receive(misread(data, wanted, baud) if wanted else data)


class SerialSession:
    """The line over TCP, which carries no baud rate."""

    closing = False
    dialogue = False

    def __init__(self, line: SerialLine) -> None:
        self._line = line

    def greeting(self) -> bytes:
        return b""

    def receive(self, data: bytes) -> bytes:
        self._line.to_device(data, None)
        return b""

    def tick(self) -> bytes:
        return self._line.to_host(None)

    def closed(self) -> None:
        pass
