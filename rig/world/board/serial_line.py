"""A serial line: bytes between a device and the host, corrupted by unequal baud rates or a bad wire."""

from collections.abc import Callable
from typing import Protocol

import numpy as np

BAUD_TOLERANCE = 0.03  # relative error of the baud rate at which a receiver still reads ten bits correctly


def misread(data: bytes, sent_baud: float, read_baud: float) -> bytes:
    """Return the bytes that a receiver at `read_baud` makes of `data` sent back to back at `sent_baud` (8N1)."""
    if abs(sent_baud / read_baud - 1.0) < BAUD_TOLERANCE:
        return data
    line = [bit for byte in data for bit in (0, *(byte >> i & 1 for i in range(8)), 1)]
    bit_length = sent_baud / read_baud  # length of a receiver's bit in the sender's bits

    def level(time: float) -> int:
        return line[int(time)] if time < len(line) else 1  # an idle line is high

    received = bytearray()
    time = 0.0
    while time < len(line):
        if level(time):
            time = float(int(time) + 1)  # the next possible falling edge
            continue
        if level(time + 0.5 * bit_length) == 0:  # else a glitch shorter than half a bit
            received.append(sum(level(time + (1.5 + i) * bit_length) << i for i in range(8)))
            time += 9.5 * bit_length
        else:
            time = float(int(time) + 1)
    return bytes(received)


class Device(Protocol):
    """The device at the far end of a serial line."""

    @property
    def baud_rate(self) -> float | None:
        """The device's baud rate; None while it neither sends nor receives."""

    def take_sent(self) -> bytes: ...
    def receive(self, data: bytes) -> None: ...


class SerialLine:
    """The line between the host and a simulated device; `device` returns None for a device without power.

    `host_baud`: the host's baud rate if the transport does not carry it; None if it equals the device's. A `silent`
    line loses everything. Each bit from the device is wrong with the probability `bit_error_rate`. In a tick, another
    program on the same port takes the last of the device's bytes with the probability `stolen`.
    """

    def __init__(self, device: Callable[[], Device | None], seed: int = 0) -> None:
        self._device = device
        self._random = np.random.default_rng(seed)
        self.host_baud: float | None = None
        self.silent = False
        self.bit_error_rate = 0.0
        self.stolen = 0.0
        self.fresh = b""  # the device's bytes of the last tick, as the line carries them

    @property
    def baud(self) -> float | None:
        """The device's baud rate; None while its USART is off or the device has no power."""
        device = self._device()
        return device.baud_rate if device is not None else None

    def tick(self) -> None:
        device = self._device()
        self.fresh = device.take_sent() if device is not None else b""
        if self.stolen and self.fresh and self._random.random() < self.stolen:
            self.fresh = self.fresh[: int(self._random.integers(len(self.fresh)))]
        if self.bit_error_rate and self.fresh:
            bits = np.unpackbits(np.frombuffer(self.fresh, np.uint8))
            self.fresh = np.packbits(bits ^ (self._random.random(len(bits)) < self.bit_error_rate)).tobytes()

    def read_as_host(self, host_baud: float | None) -> bytes:
        """Return the bytes that a host at `host_baud` reads in this tick."""
        if self.silent or not self.fresh:
            return b""
        host_rate, baud = host_baud or self.host_baud, self.baud
        return misread(self.fresh, baud, host_rate) if host_rate and baud else self.fresh

    def send_to_device(self, data: bytes, host_baud: float | None) -> None:
        """Send the bytes of a host at `host_baud`."""
        device, baud = self._device(), self.baud
        if self.silent or device is None or not baud:
            return
        host_rate = host_baud or self.host_baud
        device.receive(misread(data, host_rate, baud) if host_rate else data)


class SerialSession:
    """The session of a client that uses the line over TCP, which carries no baud rate."""

    closing = False
    dialogue = False

    def __init__(self, line: SerialLine) -> None:
        self._line = line

    def greeting(self) -> bytes:
        return b""

    def receive(self, data: bytes) -> bytes:
        self._line.send_to_device(data, None)
        return b""

    def tick(self) -> bytes:
        return self._line.read_as_host(None)

    def handle_close(self) -> None:
        pass
