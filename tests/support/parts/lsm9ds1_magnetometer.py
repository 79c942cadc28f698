"""The LSM9DS1's magnetometer, by the datasheet DocID025715."""

from collections.abc import Sequence

from support.board.host_sensors import ByteRegisters


class Lsm9ds1MagnetometerRegisters(ByteRegisters):
    """The LSM9DS1's other die: with bit 6 an address counts up; data are fresh until all have been read."""

    def __init__(self) -> None:
        super().__init__(64)
        self.values[0x0F] = 0x3D
        self.values[0x20], self.values[0x22] = 0x10, 0x03  # as after power-up
        self.is_heard = True  # False: the wire it answers on is not connected

    @property
    def line_is_high(self) -> bool:
        """Whether the data-ready line is high; it is until the outputs are read."""
        return self.fresh

    def transfer(self, data: bytes, max_hz: int, time_us: int) -> bytes:
        assert len(data) == 2 or data[0] & 0x40, "without that bit the same register answers over and over"
        answer = super().transfer(bytes((data[0] & ~0x40,)) + data[1:], max_hz, time_us)
        return answer if self.is_heard else b"\xff" * len(data)

    def read(self, address: int, size: int) -> bytes:
        self.values[0x27] = 0x0F * self.fresh
        read = bytes(self.values[address : address + size])
        self.fresh = self.fresh and not address <= 0x2D < address + size
        return read

    def convert(self, counts: Sequence[int], _temperature: int = 0, _acceleration: Sequence[int] = ()) -> None:
        """Put a new conversion of the field into the output registers; the die has no thermometer."""
        self.values[0x28:0x2E] = b"".join(count.to_bytes(2, "little", signed=True) for count in counts)
        self.fresh = True
