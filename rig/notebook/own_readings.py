"""Validation of users' own readings before they are corrected. Pure."""

import numpy as np
from numpy.typing import ArrayLike

from rig.data.quantity import ACCELERATION, Quantity
from rig.errors import Refused
from rig.estimation.arrays import Array

MAX_RANGE_RATIO = 2.0  # a part may exceed its range, but not twice


def convert_own_readings(readings: ArrayLike, quantity: Quantity, limit: float | None, whose: str) -> Array:
    """Return readings as an array (n, 3), float64; `whose` is the sensor in messages.

    `limit` is the sensor's nominal range in SI, None if unknown. Raise Refused `not_readings` for whole numbers, which
    are counts, and for other shapes. Raise `wrong_unit` for numbers beyond the sensor's range, and for accelerations
    whose norm is always about 1, which are in g.
    """
    array = np.asarray(readings)
    axes = len(quantity.axes)
    if array.dtype.kind in "iub":
        raise Refused(
            "not_readings",
            f"the readings for {whose} are whole numbers ({array.dtype}), which are counts and not {quantity.unit}",
            f"Multiply them by the sensor's {quantity.unit} for each count; whole numbers that are already in "
            f"{quantity.unit} become readings by .astype(float)",
        )
    if array.dtype.kind != "f" or array.ndim != 2 or array.shape[1] != axes:
        raise Refused(
            "not_readings",
            f"the readings for {whose} are an array of shape {array.shape} and type {array.dtype}",
            f"Give decimal numbers of shape (n, {axes}): a row for each reading, {', '.join(quantity.axes)} in columns",
        )
    values = array.astype(np.float64, copy=False)
    _refuse_other_units(values, quantity, limit, whose)
    return values


def _refuse_other_units(values: Array, quantity: Quantity, limit: float | None, whose: str) -> None:
    """Raise Refused `wrong_unit` if readings exceed the range `limit`, or look like g; `whose` names the sensor."""
    mistaken = quantity.mistaken
    most = MAX_RANGE_RATIO * limit if limit is not None else np.inf if mistaken is None else mistaken.most
    largest = float(np.abs(values[~np.isnan(values)]).max(initial=0.0))
    other_unit = "another unit" if mistaken is None else mistaken.unit
    remedy = f"Give them in {quantity.unit}" + ("" if mistaken is None else f": {mistaken.remedy}")
    if largest > most:
        reaches = f"its range is ±{limit:.4g}" if limit is not None else f"no such sensor reads more than {most:g}"
        raise Refused(
            "wrong_unit",
            f"the readings for {whose} reach {largest:.4g}, but {reaches} {quantity.unit}: they look like "
            f"{other_unit}, or like counts",
            remedy,
        )
    sizes = np.linalg.norm(values[~np.isnan(values).any(axis=1)], axis=1)
    if quantity == ACCELERATION and len(sizes) and 0.9 < float(np.median(sizes)) < 1.1:
        raise Refused(
            "wrong_unit",
            f"the readings for {whose} are about 1 {quantity.unit} all the time: they look like g",
            remedy,
        )
