"""What the models of the parts share: registers that keep what is written, those that show what was measured, and the
clock that conversions follow.
"""

import math
import struct
from collections.abc import Mapping, Sequence

from firmware_host.emulator.chip.bus import Violation
from firmware_host.emulator.parts.triad import saturated

_COUNTS = struct.Struct("<3h")


class PartRegisters:
    """The registers of a part that can be written.

    `part`: its name, for messages; `model`: the file that models it; `reset_and_bits`: address → value after reset, and
    the bits that have a model; `digits`: of a value in hexadecimal. Writing a one to any other bit fails the run: it
    would switch on something that is not simulated.
    """

    def __init__(
        self, part: str, model: str, reset_and_bits: Mapping[int, tuple[int, int]], *, digits: int = 2
    ) -> None:
        self._part = part
        self._model = model
        self._reset_and_bits = reset_and_bits
        self._digits = digits
        self.values: dict[int, int] = {}
        self.reset()

    def reset(self) -> None:
        """Every register has its value after reset."""
        self.values = {address: initial for address, (initial, _bits) in self._reset_and_bits.items()}

    def check(self, address: int, value: int) -> None:
        """Raises Violation when `value` cannot be written to a register, or the part has none there."""
        if address not in self._reset_and_bits:
            raise self.unmodelled("write to", address)
        _initial, bits = self._reset_and_bits[address]
        if value & ~bits:
            raise Violation(
                "unmodelled_bits",
                f"{self._part} register 0x{address:02X} = 0x{value:0{self._digits}X} sets bits that are not modelled",
                f"Clear them in the firmware, or model them in {self._model}",
            )

    def unmodelled(self, access: str, address: int) -> Violation:
        """The refusal of an access, "read of" or "write to", to a register without a model."""
        return Violation(
            "unmodelled_register", f"{access} {self._part} register 0x{address:02X}", f"Model it in {self._model}"
        )


class Conversions:
    """When a part converts: evenly by its own oscillator, which is `oscillator_ppm` fast, from a start on."""

    def __init__(self, oscillator_ppm: float) -> None:
        self._speed = 1 + oscillator_ppm * 1e-6
        self._started_s = 0.0
        self._period_s = math.inf
        self.count = 0  # since the start
        self.next_s = math.inf

    def start(self, time_s: float, rate_hz: float) -> None:
        """Convert anew, first one period of the nominal rate from now."""
        self._started_s = time_s
        self._period_s = 1 / (rate_hz * self._speed)
        self.count = 0
        self.next_s = time_s + self._period_s

    def stop(self) -> None:
        """Convert no more."""
        self.next_s = math.inf

    def take(self) -> float:
        """The instant of the conversion that is due; counts it."""
        now_s = self.next_s
        self.count += 1
        self.next_s = self._started_s + (self.count + 1) * self._period_s
        return now_s


class OutputRegisters:
    """The output registers of one triad of the LSM9DS1: two bytes an axis, low byte first, x and y and z."""

    def __init__(self) -> None:
        self._latest = bytes(6)
        self._output = bytearray(6)
        self._held = [False, False, False]  # block update: low byte read, high byte not yet

    def show(self, vector: Sequence[float], per_count: float) -> None:
        """A new conversion of a vector in the part's own axes."""
        self._latest = data = _COUNTS.pack(*[saturated(round(component / per_count)) for component in vector])
        for axis, held in enumerate(self._held):
            if not held:
                self._output[2 * axis : 2 * axis + 2] = data[2 * axis : 2 * axis + 2]

    def read(self, index: int, *, block_update: bool) -> int:
        """One byte of the outputs."""
        axis, high = divmod(index, 2)
        value = self._output[index]
        if block_update:
            self._held[axis] = not high
            if high:
                self._output[index - 1 : index + 1] = self._latest[index - 1 : index + 1]
        return value
