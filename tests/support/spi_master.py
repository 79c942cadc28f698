"""A bus master for one simulated sensor, written out in Python, and the least a driver does with each of the parts."""

import math
from collections.abc import Callable, Sequence
from typing import Protocol

import numpy as np

from firmware_host.emulator.accelerometer import AccelerometerTruth
from firmware_host.emulator.adis16465 import Adis16465
from firmware_host.emulator.gyroscope import GyroTruth
from firmware_host.emulator.lsm9ds1 import Lsm9ds1
from firmware_host.emulator.mpu9250 import Mpu9250
from firmware_host.emulator.spi_device import SpiDevice

PAUSE_S = 20e-6  # between accesses; the ADIS16465 needs 16 µs

NO_ERRORS = GyroTruth()
# Codes by data rate in Hz and by range in degrees per second
LSM9DS1_RATES = {14.9: 1, 59.5: 2, 119.0: 3, 238.0: 4, 476.0: 5, 952.0: 6}
LSM9DS1_RANGES = {245.0: 0, 500.0: 1, 2000.0: 3}
LSM9DS1_RANGES_G = {2.0: 0, 4.0: 2, 8.0: 3, 16.0: 1}
MPU9250_RANGES = {250.0: 0, 500.0: 1, 1000.0: 2, 2000.0: 3}
MPU9250_RANGES_G = {2.0: 0, 4.0: 1, 8.0: 2, 16.0: 3}

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


class Lsm9ds1Driver(Registers):
    """Datasheet DocID025715."""

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
        super().__init__(
            Lsm9ds1(
                rate_at, truth, acceleration=acceleration, temperature_c=temperature_c, seed=seed, oscillator_ppm=ppm
            )
        )

    def identity(self) -> int:
        return self.get(0x0F)[0]

    def start(self, rate_hz: float, range_deg_s: float, range_g: float = 8.0) -> None:
        self.set(0x0C, 0x02)
        self.set(0x20, LSM9DS1_RATES[rate_hz] << 5 | LSM9DS1_RANGES_G[range_g] << 3)
        self.set(0x10, LSM9DS1_RATES[rate_hz] << 5 | LSM9DS1_RANGES[range_deg_s] << 3)

    def read(self) -> tuple[list[int], int]:
        (temperature,) = integers(self.get(0x15, 2), "<")
        return self._vector(0x18), temperature

    def accelerations(self) -> list[int]:
        return self._vector(0x28)

    def _vector(self, address: int) -> list[int]:
        """The part's own x points the other way than the right-handed one."""
        x, y, z = integers(self.get(address, 6), "<")
        return [max(-32768, min(32767, -x)), y, z]


class Mpu9250Driver(Registers):
    """Register map RM-MPU-9250A-00."""

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
        super().__init__(
            Mpu9250(
                rate_at, truth, acceleration=acceleration, temperature_c=temperature_c, seed=seed, oscillator_ppm=ppm
            )
        )

    def identity(self) -> int:
        return self.get(0x75)[0]

    def start(self, rate_hz: float, range_deg_s: float, range_g: float = 8.0) -> None:
        self.set(0x1A, 1)
        self.set(0x1C, MPU9250_RANGES_G[range_g] << 3)
        self.set(0x19, round(1000 / rate_hz) - 1)
        self.set(0x1B, MPU9250_RANGES[range_deg_s] << 3)
        self.set(0x38, 0x01)

    def read(self) -> tuple[list[int], int]:
        _status, *data = self.get(0x3A, 15)
        _x, _y, _z, temperature, *rates = integers(bytes(data), ">")
        return rates, temperature

    def accelerations(self) -> list[int]:
        return integers(self.get(0x3B, 6), ">")


class Adis16465Driver(Master):
    """Analog Devices data sheet ADIS16465."""

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
        part = Adis16465(
            rate_at,
            truth,
            acceleration=acceleration,
            temperature_c=temperature_c,
            seed=seed,
            oscillator_ppm=ppm,
            range_deg_s=int(range_deg_s),
        )
        super().__init__(part)

    def get(self, address: int) -> int:
        self.exchange(bytes([address, 0]))
        return int.from_bytes(self.exchange(bytes(2)), "big")

    def set(self, address: int, value: int) -> None:
        self.exchange(bytes([0x80 | address, value & 0xFF]))
        self.exchange(bytes([0x80 | address + 1, value >> 8]))

    def burst(self) -> bytes:
        """The 20 bytes after the command."""
        return self.exchange(bytes([0x68]) + bytes(21))[2:]

    def identity(self) -> int:
        return self.get(0x72)

    def start(self, rate_hz: float, range_deg_s: float, range_g: float = 8.0) -> None:
        assert range_g == 8.0, "the part has one range"
        self.set(0x64, round(2000 / rate_hz) - 1)
        self.await_data()  # of the old rate
        self.read()

    def read(self) -> tuple[list[int], int]:
        _status, *rates_and_rest = integers(self.burst()[:16], ">")
        return rates_and_rest[:3], rates_and_rest[6]

    def accelerations(self) -> list[int]:
        return integers(self.burst()[8:14], ">")
