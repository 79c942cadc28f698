"""The MPU-9250, by the register map RM-MPU-9250A-00 and the specification PS-MPU-9250A-01."""

from collections.abc import Sequence

from firmware_host.emulator.parts.mpu9250 import Mpu9250
from support.board.data_sheet import DataSheet
from support.board.host_sensors import ByteRegisters
from support.board.spi_master import ModelledRegisters, integers

# Codes by range in degrees per second, and in g
RANGES = {250.0: 0, 500.0: 1, 1000.0: 2, 2000.0: 3}
RANGES_G = {2.0: 0, 4.0: 1, 8.0: 2, 16.0: 3}


class Mpu9250Driver(ModelledRegisters):
    """A driver by the register map RM-MPU-9250A-00."""

    model = Mpu9250

    def identity(self) -> int:
        return self.get(0x75)[0]

    def start(self, rate_hz: float, range_deg_s: float, range_g: float = 8.0) -> None:
        self.set(0x1A, 1)
        self.set(0x1C, RANGES_G[range_g] << 3)
        self.set(0x19, round(1000 / rate_hz) - 1)
        self.set(0x1B, RANGES[range_deg_s] << 3)
        self.set(0x38, 0x01)

    def read(self) -> tuple[list[int], int]:
        _status, *data = self.get(0x3A, 15)
        _x, _y, _z, temperature, *rates = integers(bytes(data), ">")
        return rates, temperature

    def accelerations(self) -> list[int]:
        return integers(self.get(0x3B, 6), ">")


SHEET = DataSheet(
    name="MPU-9250",
    new=Mpu9250Driver,
    identity=0x71,
    other_identity=0x70,
    rates_hz=(4.0, 100.0, 200.0, 500.0, 1000.0),
    per_count_deg_s={250.0: 1 / 131, 500.0: 1 / 65.5, 1000.0: 1 / 32.8, 2000.0: 1 / 16.4},
    per_count_g={2.0: 1 / 16384, 4.0: 1 / 8192, 8.0: 1 / 4096, 16.0: 1 / 2048},
    temperature_counts=lambda temperature_c: 333.87 * (temperature_c - 21),
    forbidden=(
        ("unmodelled_register", b"\xf2\x00"),  # FIFO count
        ("unmodelled_register", b"\x26\x01"),
        ("unmodelled_register", b"\x77\x00"),  # the accelerometer's offset, which is the factory's trim
        ("unmodelled_bits", b"\x1b\xe0"),  # self-test
        ("unmodelled_bits", b"\x6a\x40"),  # FIFO on
    ),
)


class Mpu9250Registers(ByteRegisters):
    """Registers, high byte first; only those of sensors and interrupt allow over 1 MHz; reading clears the status."""

    max_hz = 20e6

    def __init__(self) -> None:
        super().__init__()
        self.values[0x75] = 0x71
        self.values[0x6B] = 0x01  # CLKSEL, as after power-up

    def answer_as(self, who_am_i: int) -> None:
        """Answer with another identity."""
        self.values[0x75] = who_am_i

    def transfer(self, data: bytes, max_hz: int, time_us: int) -> bytes:
        first = data[0] & 0x7F
        is_data = data[0] & 0x80 and first >= 0x3A and first + len(data) - 2 <= 0x48
        assert is_data or max_hz <= 1e6
        return super().transfer(data, max_hz, time_us)

    def read(self, address: int, size: int) -> bytes:
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
