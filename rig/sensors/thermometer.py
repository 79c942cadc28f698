"""The temperatures of one stream, with gaps if the source does not provide them."""

from dataclasses import dataclass

import numpy as np

from rig.estimation.arrays import Array
from rig.sensors.errors import SensorError

MAX_WITHOUT_READING_S = 10.0  # use of the last temperature in place of missing ones


@dataclass(slots=True)
class Thermometer:
    """The thermometer of a sensor with `rate_hz` samples a second; `where` names it in messages.

    `last_c` is the last temperature that the source provided, NaN before the first.
    """

    where: str
    rate_hz: float
    last_c: float = float("nan")
    _missing: int = 0

    @property
    def provides(self) -> bool:
        """Whether the source has ever provided a temperature."""
        return bool(np.isfinite(self.last_c))

    def read(self, temperatures_c: Array) -> Array:
        """Return temperatures (n,) with each NaN replaced by the last value before it; NaN remain before the first.

        Raise SensorError `temperature_lost` if the source has provided none for `MAX_WITHOUT_READING_S`.
        """
        valid = np.flatnonzero(np.isfinite(temperatures_c))
        self._missing = len(temperatures_c) - 1 - int(valid[-1]) if len(valid) else self._missing + len(temperatures_c)
        if self._missing > MAX_WITHOUT_READING_S * self.rate_hz:
            raise SensorError(
                "temperature_lost",
                f"{self.where} has provided no temperature for {MAX_WITHOUT_READING_S:g} s",
                "Check its thermometer; if it has none, state the temperature in the configuration",
            )
        newest = np.maximum.accumulate(np.where(np.isfinite(temperatures_c), np.arange(len(temperatures_c)), -1))
        read: Array = np.where(newest >= 0, temperatures_c[newest], self.last_c)
        self.last_c = float(read[-1]) if len(read) else self.last_c
        return read
