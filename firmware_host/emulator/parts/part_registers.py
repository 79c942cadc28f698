"""The common part of the register models: writable registers, output registers, and the clock of conversions."""

import math
import struct
from collections.abc import Mapping, Sequence

from firmware_host.emulator.chip.bus import Violation
from firmware_host.emulator.parts.triad import saturate

_COUNTS = struct.Struct("<3h")


class PartRegisters:
    """The writable registers of a part.

    - `part`: its name, for messages.
    - `model`: the file of its model.
    - `reset_and_bits`: by address, the value after reset and the bits that have a model. Writing a one to another bit
      fails the run, because it would switch on a function that is not simulated.
    - `digits`: the hexadecimal digits of a value.
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
        """Set every register to its value after reset."""
        self.values = {address: initial for address, (initial, _bits) in self._reset_and_bits.items()}

    def check(self, address: int, value: int) -> None:
        """Raise Violation if the part has no such register, or `value` sets a bit without a model."""
        if address not in self._reset_and_bits:
            raise self.describe_unmodelled("write to", address)
        _initial, bits = self._reset_and_bits[address]
        if value & ~bits:
            raise Violation(
                "unmodelled_bits",
                f"{self._part} register 0x{address:02X} = 0x{value:0{self._digits}X} sets bits that are not modelled",
                f"Clear them in the firmware, or model them in {self._model}",
            )

    def describe_unmodelled(self, access: str, address: int) -> Violation:
        """Return the refusal of an access, "read of" or "write to", to a register without a model."""
        return Violation(
            "unmodelled_register", f"{access} {self._part} register 0x{address:02X}", f"Model it in {self._model}"
        )


class Conversions:
    """The times of a part's conversions, evenly spaced by an oscillator that is `oscillator_ppm` fast."""

    def __init__(self, oscillator_ppm: float) -> None:
        self._speed = 1 + oscillator_ppm * 1e-6
        self._started_s = 0.0
        self._period_s = math.inf
        self.count = 0  # since the start
        self.next_s = math.inf

    def start(self, time_s: float, rate_hz: float) -> None:
        """Restart, with the first conversion one period after `time_s`; the oscillator's error changes `rate_hz`."""
        self._started_s = time_s
        self._period_s = 1 / (rate_hz * self._speed)
        self.count = 0
        self.next_s = time_s + self._period_s

    def stop(self) -> None:
        """Stop converting."""
        self.next_s = math.inf

    def take(self) -> float:
        """Count the conversion that is due, and return its instant."""
        now_s = self.next_s
        self.count += 1
        self.next_s = self._started_s + (self.count + 1) * self._period_s
        return now_s


class OutputRegisters:
    """The output registers of one triad of the LSM9DS1: two bytes an axis, low byte first, x, y, z."""

    def __init__(self) -> None:
        self._latest = bytes(6)
        self._output = bytearray(6)
        self._is_locked = [False, False, False]  # block update: low byte read, high byte not yet

    def show(self, vector: Sequence[float], per_count: float) -> None:
        """Output `vector`, in the part's own axes, in counts of `per_count` each."""
        self._latest = data = _COUNTS.pack(*[saturate(round(component / per_count)) for component in vector])
        for axis, is_locked in enumerate(self._is_locked):
            if not is_locked:
                self._output[2 * axis : 2 * axis + 2] = data[2 * axis : 2 * axis + 2]

    def read(self, index: int, *, block_update: bool) -> int:
        """Return one byte of the outputs."""
        axis, high = divmod(index, 2)
        value = self._output[index]
        if block_update:
            self._is_locked[axis] = not high
            if high:
                self._output[index - 1 : index + 1] = self._latest[index - 1 : index + 1]
        return value
