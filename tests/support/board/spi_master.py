"""A bus master for one simulated sensor, in plain Python, and the interface of each part's driver."""

import math
from collections.abc import Callable, Sequence
from typing import Protocol

import numpy as np

from firmware_host.emulator.chip.spi_device import SpiDevice
from firmware_host.emulator.parts.accelerometer import AccelerometerTruth
from firmware_host.emulator.parts.gyroscope import GyroTruth

PAUSE_S = 20e-6  # between accesses; the ADIS16465 needs 16 µs

NO_ERRORS = GyroTruth()

Rate = Callable[[float], Sequence[float]]


def still(_time_s: float) -> Sequence[float]:
    return (0.0, 0.0, 0.0)


class Master:
    """A bus master that addresses `part` and advances its time."""

    def __init__(self, part: SpiDevice) -> None:
        self.part = part
        self.time_s = 0.0

    def exchange(self, data: bytes) -> bytes:
        """Make one access, from chip select to chip select, after a short pause; return the received bytes."""
        self.advance(self.time_s + PAUSE_S)
        self.part.select(self.time_s)
        answer = bytes(self.part.transfer(byte, self.time_s) for byte in data)
        self.part.deselect(self.time_s)
        return answer

    def advance(self, time_s: float) -> None:
        self.part.advance(time_s)
        self.time_s = time_s

    def await_data(self) -> None:
        """Let time pass until the data-ready line rises."""
        was_high = True
        while was_high or not self.part.interrupt_level:
            was_high = self.part.interrupt_level
            assert self.part.next_event_s < math.inf, "nothing is coming"
            self.advance(self.part.next_event_s)


class Driver(Protocol):
    """The common interface of all parts' drivers."""

    part: SpiDevice

    def identity(self) -> int: ...
    def start(self, rate_hz: float, range_deg_s: float, range_g: float = 8.0) -> None: ...
    def read(self) -> tuple[list[int], int]:
        """Return the rates (3,) and the temperature of the waiting conversion, in counts."""

    def accelerations(self) -> list[int]:
        """Return the accelerations (3,) of the waiting conversion, in counts; call this before `read`."""

    def exchange(self, data: bytes) -> bytes: ...
    def advance(self, time_s: float) -> None: ...
    def await_data(self) -> None: ...


def integers(data: bytes, order: str) -> list[int]:
    """Return 16-bit two's complement numbers, in the byte order `order`, "<" or ">"."""
    return [int(value) for value in np.frombuffer(data, f"{order}i2")]


class Registers(Master):
    """A driver of parts with registers of one byte, with bit 7 of the address set for reading."""

    def get(self, address: int, count: int = 1) -> bytes:
        return self.exchange(bytes([0x80 | address]) + bytes(count))[1:]

    def set(self, address: int, value: int) -> None:
        self.exchange(bytes([address, value]))


class ModelledRegisters(Registers):
    """A driver for a new `model` of such a part."""

    model: Callable[..., SpiDevice]

    def __init__(
        self,
        rate_at: Rate = still,
        truth: GyroTruth = NO_ERRORS,
        *,
        acceleration: AccelerometerTruth | None = None,
        range_deg_s: float = 500.0,
        temperature_c: float = 25.0,
        seed: int = 1,
        ppm: float = 0.0,
    ) -> None:
        del range_deg_s  # it is set
        super().__init__(
            type(self).model(
                rate_at, truth, acceleration=acceleration, temperature_c=temperature_c, seed=seed, oscillator_ppm=ppm
            )
        )
