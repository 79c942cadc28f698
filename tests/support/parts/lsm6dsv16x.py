"""The LSM6DSV16X, by the data sheet DS13510, revision 4."""

from collections.abc import Sequence

from firmware_host.emulator.parts.lsm6dsv16x import Lsm6dsv16x
from support.board.data_sheet import DataSheet
from support.board.host_sensors import ByteRegisters
from support.board.spi_master import ModelledRegisters, integers

# Table 20: the set and the code by data rate in Hz; tables 63 and 68: codes by range in degrees per second, and in g
RATES = {
    12.5: (2, 3), 15.0: (0, 3), 15.625: (1, 3), 25.0: (2, 4), 30.0: (0, 4), 31.25: (1, 4), 50.0: (2, 5), 60.0: (0, 5),
    62.5: (1, 5), 100.0: (2, 6), 120.0: (0, 6), 125.0: (1, 6), 200.0: (2, 7), 240.0: (0, 7), 250.0: (1, 7),
    400.0: (2, 8), 480.0: (0, 8), 500.0: (1, 8), 800.0: (2, 9), 960.0: (0, 9), 1000.0: (1, 9), 1600.0: (2, 10),
    1920.0: (0, 10), 2000.0: (1, 10),
}  # fmt: skip
RANGES = {125.0: 0, 250.0: 1, 500.0: 2, 1000.0: 3, 2000.0: 4}
RANGES_G = {2.0: 0, 4.0: 1, 8.0: 2, 16.0: 3}


class Lsm6dsv16xDriver(ModelledRegisters):
    """A driver by sections 9.1 to 9.35."""

    model = Lsm6dsv16x

    def identity(self) -> int:
        return self.get(0x0F)[0]

    def start(self, rate_hz: float, range_deg_s: float, range_g: float = 8.0) -> None:
        selection, code = RATES[rate_hz]
        self.set(0x62, selection)
        self.set(0x13, 0x02)  # pulses
        self.set(0x15, RANGES[range_deg_s])
        self.set(0x17, RANGES_G[range_g])
        self.set(0x0D, 0x02)
        self.set(0x10, 0x10 | code)
        self.set(0x11, 0x10 | code)

    def read(self) -> tuple[list[int], int]:
        temperature, *rates = integers(self.get(0x20, 8), "<")
        return rates, temperature

    def accelerations(self) -> list[int]:
        return integers(self.get(0x28, 6), "<")


SHEET = DataSheet(
    name="LSM6DSV16X",
    new=Lsm6dsv16xDriver,
    identity=0x70,
    other_identity=0x6C,
    rates_hz=tuple(RATES),
    per_count_deg_s={125.0: 4.375e-3, 250.0: 8.75e-3, 500.0: 17.5e-3, 1000.0: 35e-3, 2000.0: 70e-3},
    per_count_g={2.0: 0.061e-3, 4.0: 0.122e-3, 8.0: 0.244e-3, 16.0: 0.488e-3},
    temperature_counts=lambda temperature_c: 256 * (temperature_c - 25),
    forbidden=(
        ("unmodelled_register", b"\x9b\x00"),  # FIFO_STATUS1
        ("unmodelled_register", b"\x50\x01"),  # FUNCTIONS_ENABLE
        ("unmodelled_bits", b"\x19\x04"),  # the gyroscope's self-test
        ("unmodelled_bits", b"\x0a\x06"),  # FIFO on
        ("unmodelled_bits", b"\x11\x57"),  # low-power mode
        ("unmodelled_bits", b"\x16\x01"),  # the first low-pass, which is not modelled
    ),
)


class Lsm6dsv16xRegisters(ByteRegisters):
    """Registers in pages, low byte first; reading a high byte of a sensor's outputs clears its flag."""

    def __init__(self) -> None:
        super().__init__()
        self._deliver()
        self.resets_for = 2  # so often SW_RESET reads 1 before it is over

    def _deliver(self) -> None:
        """Set all registers to their state after power-up or a reset (section 8), which keeps the interface's (9.3)."""
        interface = self.values[0x03]
        self.values[:] = bytes(128)
        self.values[0x03] = interface
        self.values[0x0F], self.values[0x12] = 0x70, 0x44
        self._resetting = 0

    def answer_as(self, who_am_i: int) -> None:
        """Answer with another identity."""
        self.values[0x0F] = who_am_i

    def write(self, address: int, value: int) -> None:
        if self.values[0x01] and address != 0x01:
            return  # of another page
        if address == 0x12 and value & 0x01:
            self._deliver()
            self._resetting = self.resets_for
        else:
            self.values[address] = value

    def read(self, address: int, size: int) -> bytes:
        if self.values[0x01] and address != 0x01:
            return bytes(size)  # of another page
        self.values[0x1E] = 0x07 if self.fresh else 0x00
        if address <= 0x23 < address + size:
            self.fresh = False
        content = bytearray(super().read(address, size))
        if address == 0x12 and self._resetting:
            self._resetting -= 1
            content[0] |= 0x01
        return bytes(content)

    def convert(
        self, counts: Sequence[int], temperature: int, acceleration: Sequence[int] = (0x11, -0x22, 0x33)
    ) -> None:
        """Put a new conversion into the output registers."""
        words = (temperature, *counts, *acceleration)
        self.values[0x20:0x2E] = b"".join(word.to_bytes(2, "little", signed=True) for word in words)
        self.fresh = True
