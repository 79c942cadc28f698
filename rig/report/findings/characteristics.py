"""Every characteristic of the rig's own kinds of results: a new one is a row here, and every outlet walks it.

A row says what it is called, in what unit, where its numbers are in the entry, how a history follows it, and which
outlets do not take it from here, and why. Terminal, page, notebook, both certificates and exports take all others.
"""

from collections.abc import Callable, Mapping
from math import pi
from typing import Any, Final

import numpy as np

from rig.data.entries.earth_rate import EarthRateEntry
from rig.data.entries.result_types import ErrorEntry
from rig.data.installed_kinds import installed_kinds
from rig.data.quantity import Quantity, Unit
from rig.report.findings.characteristic import Characteristic, Known, Outlet, Series, Units, always, named

AXES, ANGLES = ("x", "y", "z"), ("yz", "zx", "xy")
SCALE_SLOPE, BIAS_SLOPE = slice(3, 6), slice(15, 18)  # of the covariance of polynomials over temperature


def _of_bias(quantity: Quantity) -> Units:
    return Units(quantity.unit, quantity.d_si, quantity.drift)


def _per_kelvin(quantity: Quantity) -> Units:
    shown = Unit(f"{quantity.drift.name}/K", quantity.drift.size)
    return Units(f"{quantity.unit}/K", quantity.d_si + r"\kelvin\tothe{-1}", shown)


def _largest_change(entry: Any) -> Known:
    from rig.estimation.temperature.bias_by_repeat import largest_change_std

    bias, std = (np.array([getattr(each.scale_fixed, name) for each in entry.repeats]) for name in ("bias", "std"))
    return Known(entry.largest_change, largest_change_std(bias, std).tolist(), entry.degrees_of_freedom)


def _drift_slope(entry: Any) -> Known | None:
    slope = entry.temperature_slope
    return None if isinstance(slope, ErrorEntry) else Known(slope.slope, slope.std, slope.degrees_of_freedom)


def _drift_range(entry: Any) -> str:
    low, high = entry.temperature_slope.range_c
    return f"Holds from {low!r} to {high!r} °C only."


def _slope_of(polynomial: str, part: slice) -> Callable[[Any], Known]:
    """The slope at the reference of one of the polynomials over temperature."""

    def known(entry: Any) -> Known:
        stds = np.sqrt(np.diag(np.array(entry.covariance)).clip(min=0.0))
        return Known(getattr(entry, polynomial)[1], stds[part].tolist())

    return known


def _earths_rate(entry: Any) -> Known | None:
    rate = entry.earth_rate
    if not isinstance(rate, EarthRateEntry):
        return None
    return Known(rate.rate_rad_s, np.sqrt(np.diag(rate.covariance_rad2_s2)).tolist(), rate.freedoms(3))


def _size_of_earths_rate(entry: Any) -> Known | None:
    rate = entry.earth_rate
    if not isinstance(rate, EarthRateEntry):
        return None
    return Known([rate.norm_rad_s], [rate.norm_std_rad_s], rate.freedoms(1))


LINES: Final = "it stands among the lines of its kind, in words of its own"
BLOCK: Final = "it stands in the block of its kind, in a place of its own"
OWN_ROW: Final = "it is the row of its kind"
NO_ROW: Final = "page and notebook have had no row of it; the notebook has its numbers"
OWN_RESULT: Final = "its kind states it there in a result of its own"
SLOPES: Final = Series("s", "the slope over temperature of the bias of {}", drawn=True)

NON_ORTHOGONALITY: Final = Characteristic(
    "angles between the axes less a right one",
    ANGLES,
    always("rad", r"\radian", Unit("°", pi / 180)),
    named("non_orthogonality", "rad"),
    Series("nonorth_", "the angle between {} and {}"),  # nonorth_yz, nonorth_zx, nonorth_xy
    {"terminal": LINES, "certificate": BLOCK, "page": NO_ROW, "exports": "it is in the matrix of the readings"},
)
G_SENSITIVITY: Final = Characteristic(
    "g-sensitivity",
    [axis + along for axis in AXES for along in AXES],
    always("rad/s per m/s²", r"\radian\second\metre\tothe{-1}"),
    named("g_sensitivity", "rad_s_per_m_s2", sign=-1),  # of gravity, which points down where force points up
    Series("g", "what an acceleration along {1} adds to the rate of {0}", opposite=True),
    {"terminal": "nine numbers with U want a table, which the certificate has", "certificate": BLOCK, "page": NO_ROW,
     "exports": "formats that know it take its matrix, others say that they have no place for it"},
    lambda _: "What a specific force along the flange's axis (second letter) adds to the reading of an axis (first "
    "letter).",
)  # fmt: skip
SECOND_ORDER: Final = Characteristic(
    "second order",
    AXES,
    always("s²/m", r"\second\tothe{2}\metre\tothe{-1}"),
    named("second_order", "s2_m"),
    None,
    {"terminal": LINES, "certificate": BLOCK, "page": NO_ROW, "history": "results with it were entered without it",
     "exports": "every format says that it leaves it out"},
)  # fmt: skip
LARGEST_CHANGE: Final = Characteristic(
    "largest change of the bias",
    AXES,
    _of_bias,
    _largest_change,
    Series("d", "the change between repeats of the bias of {}", drawn=True),
    {"terminal": LINES, "certificate": BLOCK, "page": OWN_ROW, "digital certificate": "it has the bias by repeat",
     "exports": "no program corrects by a change"},
)  # fmt: skip
DRIFT_SLOPE: Final = Characteristic(
    "bias over temperature",
    AXES,
    _per_kelvin,
    _drift_slope,
    SLOPES,
    {"terminal": LINES, "certificate": BLOCK, "page": NO_ROW, "exports": "`rig export --at-temperature` takes it"},
    _drift_range,
)
BIAS_SLOPE_AT_REFERENCE: Final = Characteristic(
    "change of the bias per kelvin",
    AXES,
    _per_kelvin,
    _slope_of("bias", BIAS_SLOPE),
    SLOPES,
    {"terminal": LINES, "certificate": BLOCK, "page": OWN_ROW, "digital certificate": OWN_RESULT,
     "exports": "formats that know polynomials take them whole"},
)  # fmt: skip
SCALE_SLOPE_AT_REFERENCE: Final = Characteristic(
    "change of the scale factor per kelvin",
    AXES,
    always("1/K", r"\kelvin\tothe{-1}"),
    _slope_of("scale", SCALE_SLOPE),
    Series("t", "the slope over temperature of the scale factor of {}", drawn=True),
    {"terminal": LINES, "certificate": BLOCK, "page": NO_ROW, "digital certificate": OWN_RESULT,
     "exports": "formats that know polynomials take them whole"},
)  # fmt: skip
EARTHS: Final[Mapping[Outlet, str]] = {
    "terminal": LINES, "certificate": BLOCK, "page": OWN_ROW, "digital certificate": OWN_RESULT,
    "exports": "it is the place's, not the sensor's",
}  # fmt: skip
EARTH_RATE_SIZE: Final = Characteristic(
    "size of the Earth's rate",
    [""],
    _of_bias,
    _size_of_earths_rate,
    Series("e", "the Earth's rate"),
    EARTHS,
)
EARTH_RATE: Final = Characteristic(
    "the Earth's rate in the arm's base",
    AXES,
    _of_bias,
    _earths_rate,
    Series("e", "the Earth's rate along {}", drawn=True),
    EARTHS,
)

GYROSCOPES: Final = (NON_ORTHOGONALITY, G_SENSITIVITY)
ACCELEROMETERS: Final = (NON_ORTHOGONALITY, SECOND_ORDER)
MAGNETOMETERS: Final = (NON_ORTHOGONALITY,)
DRIFTS: Final = (LARGEST_CHANGE, DRIFT_SLOPE)
POLYNOMIALS: Final = (BIAS_SLOPE_AT_REFERENCE, SCALE_SLOPE_AT_REFERENCE)
EARTHS_RATES: Final = (EARTH_RATE_SIZE, EARTH_RATE)
OF_THE_RIG: Final = (
    *GYROSCOPES, *ACCELEROMETERS, *MAGNETOMETERS, *DRIFTS, *POLYNOMIALS, *EARTHS_RATES,
)  # fmt: skip


def every_characteristic() -> tuple[Characteristic, ...]:
    """All in the order in which a history shows them, those of installed kinds last."""
    return (*OF_THE_RIG, *(each for kind in installed_kinds() for each in kind.result.characteristics))
