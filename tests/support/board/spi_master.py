"""A bus master for one simulated sensor, written out in Python, and what each part's driver offers."""

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
    """Speaks to `part` and lets its time pass."""

    def __init__(self, part: SpiDevice) -> None:
        self.part = part
        self.time_s = 0.0

    def exchange(self, data: bytes) -> bytes:
        """One access, from chip select to chip select, after a short pause. Returns what came back."""
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
    """The same few things of every part."""

    part: SpiDevice

    def identity(self) -> int: ...
    def start(self, rate_hz: float, range_deg_s: float, range_g: float = 8.0) -> None: ...
    def read(self) -> tuple[list[int], int]:
        """The rates and the temperature of the conversion that is waiting, as counts."""

    def accelerations(self) -> list[int]:
        """Of the same conversion; to be asked for first."""

    def exchange(self, data: bytes) -> bytes: ...
    def advance(self, time_s: float) -> None: ...
    def await_data(self) -> None: ...


def integers(data: bytes, order: str) -> list[int]:
    """16-bit two's complement numbers, `order` "<" or ">"."""
    return [int(value) for value in np.frombuffer(data, f"{order}i2")]


class Registers(Master):
    """Parts with registers of one byte, bit 7 of the address set for reading."""

    def get(self, address: int, count: int = 1) -> bytes:
        return self.exchange(bytes([0x80 | address]) + bytes(count))[1:]

    def set(self, address: int, value: int) -> None:
        self.exchange(bytes([address, value]))


class ModelledRegisters(Registers):
    """Speaks to a new `model`, of such a part."""

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
