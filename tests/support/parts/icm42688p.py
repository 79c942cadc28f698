"""The ICM-42688-P, by the data sheet DS-000347, revision 1.8."""

from collections.abc import Sequence

from firmware_host.emulator.parts.icm42688p import Icm42688P
from support.board.data_sheet import DataSheet
from support.board.host_sensors import ByteRegisters
from support.board.spi_master import ModelledRegisters, integers

# Sections 14.37 and 14.38: codes by data rate in Hz, by range in degrees per second, and in g
RATES = {12.5: 11, 25.0: 10, 50.0: 9, 100.0: 8, 200.0: 7, 500.0: 15, 1000.0: 6, 2000.0: 5}
RANGES = {2000.0: 0, 1000.0: 1, 500.0: 2, 250.0: 3, 125.0: 4, 62.5: 5, 31.25: 6, 15.625: 7}
RANGES_G = {16.0: 0, 8.0: 1, 4.0: 2, 2.0: 3}


class Icm42688PDriver(ModelledRegisters):
    """A driver by sections 14.1 to 14.59."""

    model = Icm42688P

    def identity(self) -> int:
        return self.get(0x75)[0]

    def start(self, rate_hz: float, range_deg_s: float, range_g: float = 8.0) -> None:
        self.set(0x4C, 0xB3)  # the whole range of numbers, high byte first, no I2C
        self.set(0x14, 0x03)
        self.set(0x64, 0x00)
        self.set(0x65, 0x08)
        self.set(0x4F, RANGES[range_deg_s] << 5 | RATES[rate_hz])
        self.set(0x50, RANGES_G[range_g] << 5 | RATES[rate_hz])
        self.set(0x4E, 0x0F)

    def read(self) -> tuple[list[int], int]:
        self.get(0x2D)
        temperature, _x, _y, _z, *rates = integers(self.get(0x1D, 14), ">")
        return rates, temperature

    def accelerations(self) -> list[int]:
        return integers(self.get(0x1F, 6), ">")


SHEET = DataSheet(
    name="ICM-42688-P",
    new=Icm42688PDriver,
    identity=0x47,
    other_identity=0x42,
    rates_hz=tuple(RATES),
    per_count_deg_s={
        15.625: 1 / 2097.2, 31.25: 1 / 1048.6, 62.5: 1 / 524.3, 125.0: 1 / 262,
        250.0: 1 / 131, 500.0: 1 / 65.5, 1000.0: 1 / 32.8, 2000.0: 1 / 16.4,
    },
    per_count_g={2.0: 1 / 16384, 4.0: 1 / 8192, 8.0: 1 / 4096, 16.0: 1 / 2048},
    temperature_counts=lambda temperature_c: 132.48 * (temperature_c - 25),
    forbidden=(
        ("unmodelled_register", b"\xae\x00"),  # FIFO count
        ("unmodelled_register", b"\x4b\x08"),  # SIGNAL_PATH_RESET
        ("unmodelled_bits", b"\x70\x01"),  # self-test
        ("unmodelled_bits", b"\x16\x40"),  # FIFO on
        ("unmodelled_bits", b"\x4e\x20"),  # thermometer off
    ),
)  # fmt: skip


class Icm42688PRegisters(ByteRegisters):
    """Registers in banks, high byte first; reading the status clears it; outputs are those of the latest conversion."""

    max_hz = 24e6

    def __init__(self) -> None:
        super().__init__()
        self._deliver()

    def _deliver(self) -> None:
        """Set all registers to their state after power-up (section 14)."""
        self.values[:] = bytes(128)
        defaults = {0x13: 0x05, 0x4C: 0x30, 0x4D: 0x91, 0x4F: 6, 0x50: 6, 0x51: 0x16, 0x52: 0x11, 0x53: 0x0D}
        for address, value in (defaults | {0x64: 0x10, 0x65: 0x10, 0x75: 0x47}).items():
            self.values[address] = value

    def answer_as(self, who_am_i: int) -> None:
        """Answer with another identity."""
        self.values[0x75] = who_am_i

    def write(self, address: int, value: int) -> None:
        if self.values[0x76] and address != 0x76:
            return  # of another bank
        if (address, value) == (0x11, 0x01):
            self._deliver()
        else:
            self.values[address] = value

    def read(self, address: int, size: int) -> bytes:
        if self.values[0x76] and address != 0x76:
            return bytes(size)  # of another bank
        self.values[0x2D] = 0x08 if self.fresh else 0x00
        if address <= 0x2D < address + size:
            self.fresh = False
        return super().read(address, size)

    def convert(
        self, counts: Sequence[int], temperature: int, acceleration: Sequence[int] = (0x11, -0x22, 0x33)
    ) -> None:
        """Put a new conversion into the output registers."""
        words = (temperature, *acceleration, *counts)
        self.values[0x1D:0x2B] = b"".join(word.to_bytes(2, "big", signed=True) for word in words)
        self.fresh = True
