"""The step of a device's time, from its digits or from the resolution of a single-precision number. Pure."""

import numpy as np

from rig.config.units import UNITS
from rig.estimation.arrays import Array

STEP_GROWTH = 2.0  # by which the step of a single-precision number grows if the number doubles


def find_time_step_s(printed: Array, decimals: int, unit: str) -> float:
    """Return the step, s, of a device's times (n,) in `unit`, printed with `decimals` digits.

    A time in single precision, with 24 bits, has the step of its last bit, regardless of the number of printed digits.
    This step grows with time, so twice the present one is returned, which holds until the time has doubled.
    """
    last_digit = 10.0**-decimals
    single = np.float32(printed)
    last_bit = float(np.spacing(np.abs(single).max())) if len(printed) else 0.0
    is_single = bool((np.abs(single.astype(np.float64) - printed) <= 0.51 * last_digit).all())
    step = STEP_GROWTH * last_bit if is_single and last_bit > last_digit else last_digit
    return step * UNITS[unit].size
