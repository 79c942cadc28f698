"""The LSM9DS1's gyroscope and accelerometer, by the datasheet DocID025715."""

from collections.abc import Callable, Sequence

from firmware_host.emulator.parts.lsm9ds1 import Lsm9ds1
from support.board.data_sheet import DataSheet
from support.board.host_sensors import ByteRegisters
from support.board.spi_master import ModelledRegisters, integers

# Codes by data rate in Hz and by range in degrees per second
RATES = {14.9: 1, 59.5: 2, 119.0: 3, 238.0: 4, 476.0: 5, 952.0: 6}
RANGES = {245.0: 0, 500.0: 1, 2000.0: 3}
RANGES_G = {2.0: 0, 4.0: 2, 8.0: 3, 16.0: 1}


class Lsm9ds1Driver(ModelledRegisters):
    """A driver by the data sheet DocID025715."""

    model = Lsm9ds1

    def identity(self) -> int:
        return self.get(0x0F)[0]

    def start(self, rate_hz: float, range_deg_s: float, range_g: float = 8.0) -> None:
        self.set(0x0C, 0x02)
        self.set(0x20, RATES[rate_hz] << 5 | RANGES_G[range_g] << 3)
        self.set(0x10, RATES[rate_hz] << 5 | RANGES[range_deg_s] << 3)

    def read(self) -> tuple[list[int], int]:
        (temperature,) = integers(self.get(0x15, 2), "<")
        return self._vector(0x18), temperature

    def accelerations(self) -> list[int]:
        return self._vector(0x28)

    def _vector(self, address: int) -> list[int]:
        """Read three outputs, and return them in right-handed axes: the part's own x has the opposite sign."""
        x, y, z = integers(self.get(address, 6), "<")
        return [max(-32768, min(32767, -x)), y, z]


SHEET = DataSheet(
    name="LSM9DS1",
    new=Lsm9ds1Driver,
    identity=0x68,
    other_identity=0x69,
    rates_hz=(14.9, 59.5, 119.0, 238.0, 476.0, 952.0),
    per_count_deg_s={245.0: 8.75e-3, 500.0: 17.5e-3, 2000.0: 70.0e-3},
    per_count_g={2.0: 0.061e-3, 4.0: 0.122e-3, 8.0: 0.244e-3, 16.0: 0.732e-3},
    temperature_counts=lambda temperature_c: 16 * (temperature_c - 25),
    forbidden=(
        ("unmodelled_register", b"\xa6\x00"),
        ("unmodelled_register", b"\x06\x01"),
        ("unmodelled_bits", b"\x21\x04"),  # the accelerometer's second filter
    ),
)


class Lsm9ds1Registers(ByteRegisters):
    """Registers whose address counts up in a burst. Conversions raise flags; reading the last outputs clears them.

    Both triads are left-handed: the registers hold x with the opposite sign.
    """

    def __init__(self) -> None:
        super().__init__()
        self.values[0x0F] = 0x68
        self.values[0x22] = 0x04  # IF_ADD_INC, as after power-up
        self.fresh_acceleration = False
        self.again_after_reading = 0  # number of conversions right after a read
        self.before_acceleration: Callable[[], None] | None = None  # called once, before the accelerations are read
        self.after_acceleration: Callable[[], None] | None = None  # or just after

    @property
    def line_is_high(self) -> bool:
        """Whether the data-ready line is high; it is until the outputs are read."""
        return self.fresh

    def answer_as(self, who_am_i: int) -> None:
        """Answer with another identity."""
        self.values[0x0F] = who_am_i

    def read(self, address: int, size: int) -> bytes:
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
        """Put a new conversion of vectors in right-handed axes into the output registers."""
        words = (temperature, -counts[0], *counts[1:], -acceleration[0], *acceleration[1:])
        for address, value in zip((0x15, 0x18, 0x1A, 0x1C, 0x28, 0x2A, 0x2C), words, strict=True):
            self.values[address : address + 2] = min(value, 32767).to_bytes(2, "little", signed=True)
        self.fresh = self.fresh_acceleration = True
