"""The check for numbers that no sensor reads: a logger's mark of a missing value, or a damaged digit."""

import numpy as np
from numpy.typing import NDArray

from rig.data.quantity import Quantity
from rig.errors import Refused
from rig.estimation.arrays import Array

OF_MOST = 0.1  # of the largest reading that any part has: beyond most parts' range
BEYOND, USUAL = 20.0, 0.99  # times the largest of the usual readings, which are this fraction
COLDEST_C, HOTTEST_C = -273.15, 1000.0


def check_possible(readings: Array, rows: NDArray[np.intp], quantity: Quantity, where: str) -> None:
    """Raise Refused `not_a_number` if a few readings (n, 3) are far beyond all others and most parts' range.

    `rows` (n,) are their numbers in the file, from 0, and messages call the file `where`. If more than a few are, the
    unit is wrong.
    """
    if quantity.mistaken is None or not len(readings):
        return
    sizes = np.abs(readings).max(axis=1)
    limit = max(OF_MOST * quantity.mistaken.most, BEYOND * float(np.quantile(sizes, USUAL, method="lower")))
    wrong = np.flatnonzero(sizes > limit)
    if len(wrong):
        axis = int(np.argmax(np.abs(readings[wrong[0]])))
        value = readings[wrong[0], axis]
        raise Refused(
            "not_a_number",
            f"{where} has {len(wrong)} samples that no {quantity.sensor} reads, the first is sample "
            f"{rows[wrong[0]] + 1}, with {value:.6g} {quantity.unit} in {quantity.columns[axis]}",
            "If the logger marks a missing value so, state its text with --columns (samples_missing); otherwise leave "
            "out these rows",
        )


def check_temperatures(temperature_c: Array, rows: NDArray[np.intp], where: str) -> None:
    """Raise Refused `wrong_unit` for a temperature (n,) that nothing in a laboratory has; arguments as above."""
    wrong = np.flatnonzero((temperature_c < COLDEST_C) | (temperature_c > HOTTEST_C))
    if len(wrong):
        raise Refused(
            "wrong_unit",
            f"{where} has {len(wrong)} samples whose temperature_c is no temperature in °C, the first is sample "
            f"{rows[wrong[0]] + 1}, with {temperature_c[wrong[0]]:.6g}",
            "Convert counts to °C, as the data sheet says, or give the column another name, so that it is not read",
        )
