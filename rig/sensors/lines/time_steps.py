"""Steps in which a device prints its time: by the digits that it prints, and by a number in single precision. Pure."""

import numpy as np

from rig.config.units import UNITS
from rig.estimation.arrays import Array

GROWS = 2.0  # the steps of a number in single precision, when it has become twice as large


def step_of_time_s(printed: Array, decimals: int, unit: str) -> float:
    """Return the step, s, of printed times (n,) with so many decimals: of a device that may run on for as long again.

    A time that the device holds in single precision, with 24 bits, goes in steps of its last bit, however many digits
    it prints: every printed time lies on that grid.
    """
    last_digit = 10.0**-decimals
    single = np.float32(printed)
    last_bit = float(np.spacing(np.abs(single).max())) if len(printed) else 0.0
    is_single = bool((np.abs(single.astype(np.float64) - printed) <= 0.51 * last_digit).all())
    step = GROWS * last_bit if is_single and last_bit > last_digit else last_digit
    return step * UNITS[unit].size
