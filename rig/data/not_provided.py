"""Values by which a source marks a field that it does not provide. Pure.

Each source declares a table of `Absent` for its fields, by its protocol. A temperature that is not provided is unknown,
and a sample without a rate does not count as a sample.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

# °C: no inertial sensor works outside. Drivers of thermometers report a fault by such values: -127, -273.15, 327.67.
RANGE_C = (-100.0, 200.0)


@dataclass(frozen=True, slots=True)
class Absent:
    """The markers of a missing value: a number that is not finite, is one of `numbers`, or lies outside `within`.

    If the message has flags, the field also lacks a value unless all `bits` are set.
    """

    numbers: tuple[float, ...] = ()
    within: tuple[float, float] = (-np.inf, np.inf)
    bits: int = 0

    def mask_provided(self, values: ArrayLike, flags: ArrayLike = -1) -> NDArray[np.bool_]:
        """Return a mask of the values (n,) or (n, 3) that the source provided; `flags` (n,) are those of the messages.

        The default, −1, flags all fields as provided.
        """
        numbers = np.asarray(values, dtype=np.float64)
        low, high = self.within
        valid = np.isfinite(numbers) & ~np.isin(numbers, self.numbers) & (numbers >= low) & (numbers <= high)
        flagged = (np.asarray(flags, dtype=np.int64) & self.bits) == self.bits
        mask: NDArray[np.bool_] = valid.all(axis=tuple(range(1, valid.ndim))) & flagged
        return mask
