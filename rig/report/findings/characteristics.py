"""All characteristics of the rig's own kinds of results. A new characteristic is a row here, for all outputs.

A row has a name, units, a reader of the numbers, names in a history, and the outputs that do not show it, with reasons.
All other outputs show the characteristic: terminal, page, notebook, both certificates and exports.
"""

from collections.abc import Callable, Mapping
from math import pi
from typing import Any, Final

import numpy as np

from rig.data.entries.earth_rate import EarthRateEntry
from rig.data.entries.result_types import ErrorEntry
from rig.data.installed_kinds import installed_kinds
from rig.data.quantity import DisplayUnit, Quantity
from rig.report.findings.characteristic import (
    Characteristic,
    Outlet,
    Series,
    UncertainNumbers,
    Units,
    read_fields,
    same_units,
)

AXES, ANGLES = ("x", "y", "z"), ("yz", "zx", "xy")
SCALE_SLOPE, BIAS_SLOPE = slice(3, 6), slice(15, 18)  # elements in the covariance of polynomials over temperature


def _bias_units(quantity: Quantity) -> Units:
    return Units(quantity.unit, quantity.d_si, quantity.drift)


def _slope_units(quantity: Quantity) -> Units:
    shown = DisplayUnit(f"{quantity.drift.name}/K", quantity.drift.size)
    return Units(f"{quantity.unit}/K", quantity.d_si + r"\kelvin\tothe{-1}", shown)


def _largest_change(entry: Any) -> UncertainNumbers:
    from rig.estimation.temperature.bias_by_repeat import largest_change_std

    bias, std = (np.array([getattr(repeat.scale_fixed, name) for repeat in entry.repeats]) for name in ("bias", "std"))
    return UncertainNumbers(entry.largest_change, largest_change_std(bias, std).tolist(), entry.degrees_of_freedom)


def _drift_slope(entry: Any) -> UncertainNumbers | None:
    slope = entry.temperature_slope
    return None if isinstance(slope, ErrorEntry) else UncertainNumbers(slope.slope, slope.std, slope.degrees_of_freedom)


def _drift_range(entry: Any) -> str:
    low, high = entry.temperature_slope.range_c
    return f"Holds from {low!r} to {high!r} °C only."


def _slope_of(polynomial: str, part: slice) -> Callable[[Any], UncertainNumbers]:
    """Return a function that reads a polynomial's slope at the reference temperature from an entry.

    `part` selects the slope's elements in the entry's covariance.
    """

    def read(entry: Any) -> UncertainNumbers:
        stds = np.sqrt(np.diag(np.array(entry.covariance)).clip(min=0.0))
        return UncertainNumbers(getattr(entry, polynomial)[1], stds[part].tolist())

    return read


def _earths_rate(entry: Any) -> UncertainNumbers | None:
    rate = entry.earth_rate
    if not isinstance(rate, EarthRateEntry):
        return None
    return UncertainNumbers(rate.rate_rad_s, np.sqrt(np.diag(rate.covariance_rad2_s2)).tolist(), rate.dofs(3))


def _size_of_earths_rate(entry: Any) -> UncertainNumbers | None:
    rate = entry.earth_rate
    if not isinstance(rate, EarthRateEntry):
        return None
    return UncertainNumbers([rate.norm_rad_s], [rate.norm_std_rad_s], rate.dofs(1))


OWN_LINE: Final = "its kind prints it in a line of its own"
BLOCK: Final = "the block of its kind has a place for it"
OWN_ROW: Final = "it is the row of its kind"
NO_ROW: Final = "page and notebook show no row for it; the notebook has its numbers"
OWN_RESULT: Final = "its kind states it in a result of its own"
SLOPES: Final = Series("s", "the slope over temperature of the bias of {}", drawn=True)

NON_ORTHOGONALITY: Final = Characteristic(
    "angles between the axes less a right one",
    ANGLES,
    same_units("rad", r"\radian", DisplayUnit("°", pi / 180)),
    read_fields("non_orthogonality", "rad"),
    Series("nonorth_", "the angle between {} and {}"),  # nonorth_yz, nonorth_zx, nonorth_xy
    {"terminal": OWN_LINE, "certificate": BLOCK, "page": NO_ROW, "exports": "it is in the matrix of the readings"},
)
G_SENSITIVITY: Final = Characteristic(
    "g-sensitivity",
    [axis + other for axis in AXES for other in AXES],
    same_units("rad/s per m/s²", r"\radian\second\metre\tothe{-1}"),
    read_fields("g_sensitivity", "rad_s_per_m_s2", sign=-1),  # gravity points down, force at rest up
    Series("g", "g-sensitivity {0}/{1}", opposite=True),
    {"terminal": "nine numbers with U need a table, which the certificate has", "certificate": BLOCK, "page": NO_ROW,
     "exports": "formats that support it take its matrix, others state that they omit it"},
    lambda _: "Change of the reading of an axis (first letter) by a specific force along an axis of the flange "
    "(second letter).",
)  # fmt: skip
SECOND_ORDER: Final = Characteristic(
    "second order",
    AXES,
    same_units("s²/m", r"\second\tothe{2}\metre\tothe{-1}"),
    read_fields("second_order", "s2_m"),
    None,
    {"terminal": OWN_LINE, "certificate": BLOCK, "page": NO_ROW, "history": "results with it are entered without it",
     "exports": "every format states that it omits it"},
)  # fmt: skip
LARGEST_CHANGE: Final = Characteristic(
    "largest change of the bias",
    AXES,
    _bias_units,
    _largest_change,
    Series("d", "the change between repeats of the bias of {}", drawn=True),
    {"terminal": OWN_LINE, "certificate": BLOCK, "page": OWN_ROW, "digital certificate": "it has the bias by repeat",
     "exports": "no program corrects by a change"},
)  # fmt: skip
DRIFT_SLOPE: Final = Characteristic(
    "bias over temperature",
    AXES,
    _slope_units,
    _drift_slope,
    SLOPES,
    {"terminal": OWN_LINE, "certificate": BLOCK, "page": NO_ROW, "exports": "`rig export --at-temperature` takes it"},
    _drift_range,
)
BIAS_SLOPE_AT_REFERENCE: Final = Characteristic(
    "change of the bias per kelvin",
    AXES,
    _slope_units,
    _slope_of("bias", BIAS_SLOPE),
    SLOPES,
    {"terminal": OWN_LINE, "certificate": BLOCK, "page": OWN_ROW, "digital certificate": OWN_RESULT,
     "exports": "formats that support polynomials take them unchanged"},
)  # fmt: skip
SCALE_SLOPE_AT_REFERENCE: Final = Characteristic(
    "change of the scale factor per kelvin",
    AXES,
    same_units("1/K", r"\kelvin\tothe{-1}"),
    _slope_of("scale", SCALE_SLOPE),
    Series("t", "the slope over temperature of the scale factor of {}", drawn=True),
    {"terminal": OWN_LINE, "certificate": BLOCK, "page": NO_ROW, "digital certificate": OWN_RESULT,
     "exports": "formats that support polynomials take them unchanged"},
)  # fmt: skip
EARTH_OUTLETS: Final[Mapping[Outlet, str]] = {
    "terminal": OWN_LINE, "certificate": BLOCK, "page": OWN_ROW, "digital certificate": OWN_RESULT,
    "exports": "it is a property of the site, not of the sensor",
}  # fmt: skip
EARTH_RATE_SIZE: Final = Characteristic(
    "size of the Earth's rate", [""], _bias_units, _size_of_earths_rate, Series("e", "the Earth's rate"), EARTH_OUTLETS
)
EARTH_RATE: Final = Characteristic(
    "the Earth's rate in the arm's base",
    AXES,
    _bias_units,
    _earths_rate,
    Series("e", "the Earth's rate along {}", drawn=True),
    EARTH_OUTLETS,
)

GYROSCOPES: Final = (NON_ORTHOGONALITY, G_SENSITIVITY)
ACCELEROMETERS: Final = (NON_ORTHOGONALITY, SECOND_ORDER)
MAGNETOMETERS: Final = (NON_ORTHOGONALITY,)
DRIFTS: Final = (LARGEST_CHANGE, DRIFT_SLOPE)
POLYNOMIALS: Final = (BIAS_SLOPE_AT_REFERENCE, SCALE_SLOPE_AT_REFERENCE)
EARTH_RATES: Final = (EARTH_RATE_SIZE, EARTH_RATE)
RIG_CHARACTERISTICS: Final = (
    *GYROSCOPES, *ACCELEROMETERS, *MAGNETOMETERS, *DRIFTS, *POLYNOMIALS, *EARTH_RATES,
)  # fmt: skip


def every_characteristic() -> tuple[Characteristic, ...]:
    """Return all characteristics in the order in which a history shows them; those of installed packages are last."""
    return (*RIG_CHARACTERISTICS, *(row for kind in installed_kinds() for row in kind.result.characteristics))
