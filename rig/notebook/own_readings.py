"""Readings that somebody brings along: whether they are what a calibration corrects. Pure."""

import numpy as np
from numpy.typing import ArrayLike

from rig.data.quantity import ACCELERATION, Quantity
from rig.errors import Refused
from rig.estimation.arrays import Array

BEYOND = 2.0  # times the nominal range: a part reads further than its range says, but not twice as far


def own_readings(readings: ArrayLike, quantity: Quantity, limit: float | None, whose: str) -> Array:
    """Readings as an array (n, 3), float64. `limit` is the sensor's nominal range in SI, None where nobody said it.

    Raises Refused `not_readings` for whole numbers, which are counts, and for another shape; `wrong_unit` for numbers
    beyond what the sensor can read, and for accelerations of about 1 all the time, which are in g.
    """
    given = np.asarray(readings)
    axes = len(quantity.axes)
    if given.dtype.kind in "iub":
        raise Refused(
            "not_readings",
            f"the readings for {whose} are whole numbers ({given.dtype}), which are counts and not {quantity.unit}",
            f"Multiply them by the sensor's {quantity.unit} for each count; whole numbers that are already in "
            f"{quantity.unit} become readings by .astype(float)",
        )
    if given.dtype.kind != "f" or given.ndim != 2 or given.shape[1] != axes:
        raise Refused(
            "not_readings",
            f"the readings for {whose} are an array of shape {given.shape} and type {given.dtype}",
            f"Give decimal numbers of shape (n, {axes}): a row for each reading, {', '.join(quantity.axes)} in columns",
        )
    found = given.astype(np.float64, copy=False)
    _refuse_other_units(found, quantity, limit, whose)
    return found


def _refuse_other_units(values: Array, quantity: Quantity, limit: float | None, whose: str) -> None:
    known = quantity.mistaken
    most = BEYOND * limit if limit is not None else np.inf if known is None else known.most
    largest = float(np.abs(values[~np.isnan(values)]).max(initial=0.0))
    instead = "another unit" if known is None else known.unit
    mend = f"Give them in {quantity.unit}" + ("" if known is None else f": {known.mend}")
    if largest > most:
        reaches = f"its range is ±{limit:.4g}" if limit is not None else f"no such sensor reads more than {most:g}"
        raise Refused(
            "wrong_unit",
            f"the readings for {whose} reach {largest:.4g}, and {reaches} {quantity.unit}: they look like {instead}, "
            "or like counts",
            mend,
        )
    sizes = np.linalg.norm(values[~np.isnan(values).any(axis=1)], axis=1)
    if quantity == ACCELERATION and len(sizes) and 0.9 < float(np.median(sizes)) < 1.1:
        raise Refused(
            "wrong_unit",
            f"the readings for {whose} are about 1 {quantity.unit} all the time: they look like g",
            mend,
        )
