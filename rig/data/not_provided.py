"""What a source says in the place of a value that it does not provide. Pure.

Each source declares a table of `Absent` for its fields, as its protocol defines them. What means "none" is no value: a
temperature that is not provided is not known, and a sample without a rate is no sample.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

# °C: no inertial sensor works outside. What a thermometer's driver says of a fault lies there: -127, -273.15, 327.67.
POSSIBLE_C = (-100.0, 200.0)


@dataclass(frozen=True, slots=True)
class Absent:
    """What means that a field holds no value: what is not finite, one of `numbers`, what is not `within` both ends.

    If the message has flags, the field holds a value where all `bits` of them are set.
    """

    numbers: tuple[float, ...] = ()
    within: tuple[float, float] = (-np.inf, np.inf)
    bits: int = 0

    def provided(self, values: ArrayLike, flags: ArrayLike = -1) -> NDArray[np.bool_]:
        """Return which of values (n,) or (n, 3) the source provided, (n,), by the messages' `flags` (n,) if any."""
        numbers = np.asarray(values, dtype=np.float64)
        low, high = self.within
        held = np.isfinite(numbers) & ~np.isin(numbers, self.numbers) & (numbers >= low) & (numbers <= high)
        flagged = (np.asarray(flags, dtype=np.int64) & self.bits) == self.bits
        found: NDArray[np.bool_] = held.all(axis=tuple(range(1, held.ndim))) & flagged
        return found
