"""Units as external files and devices spell them, with their quantity and their size in SI."""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from math import pi, radians
from types import MappingProxyType
from typing import Final

from rig.estimation.earth import STANDARD_GRAVITY_M_S2

# Named as the rows of `rig.data.quantity`, if there is one.
TIME, ANGLE, RATE, ACCELERATION, FIELD, TEMPERATURE, PRESSURE, NUMBER = (
    "time", "angle", "rate", "acceleration", "field", "temperature", "pressure", "plain number",
)  # fmt: skip


@dataclass(frozen=True, slots=True)
class Unit:
    """A unit of `quantity`: number × `size` + `zero` is the value in SI units, or in °C if it is a temperature."""

    quantity: str
    size: float
    zero: float = 0.0


def _spelt(quantity: str, size: float, *spellings: str, zero: float = 0.0) -> dict[str, Unit]:
    return dict.fromkeys(spellings, Unit(quantity, size, zero))


UNITS: Final[Mapping[str, Unit]] = MappingProxyType(
    _spelt(TIME, 1.0, "s", "sec")
    | _spelt(TIME, 1e-3, "ms")
    | _spelt(TIME, 1e-6, "us", "µs")
    | _spelt(TIME, 1e-9, "ns")
    | _spelt(TIME, 60.0, "min")
    | _spelt(TIME, 3600.0, "h")
    | _spelt(ANGLE, 1.0, "rad")
    | _spelt(ANGLE, 1e-3, "mrad")
    | _spelt(ANGLE, radians(1), "deg", "°")
    | _spelt(ANGLE, radians(1 / 3600), "arcsec")
    | _spelt(ANGLE, 2 * pi, "turn", "rev")
    | _spelt(RATE, 1.0, "rad/s")
    | _spelt(RATE, 1e-3, "mrad/s")
    | _spelt(RATE, radians(1), "deg/s", "°/s", "dps")
    | _spelt(RATE, radians(1e-3), "mdeg/s", "mdps")
    | _spelt(RATE, radians(1 / 3600), "deg/h", "°/h")
    | _spelt(RATE, 2 * pi / 60, "rpm")
    | _spelt(ACCELERATION, 1.0, "m/s2", "m/s²")
    | _spelt(ACCELERATION, STANDARD_GRAVITY_M_S2, "g")
    | _spelt(ACCELERATION, 1e-3 * STANDARD_GRAVITY_M_S2, "mg")
    | _spelt(FIELD, 1.0, "T")
    | _spelt(FIELD, 1e-6, "uT", "µT")
    | _spelt(FIELD, 1e-9, "nT")
    | _spelt(FIELD, 1e-4, "G", "gauss")
    | _spelt(FIELD, 1e-7, "mG", "mgauss")
    | _spelt(TEMPERATURE, 1.0, "C", "°C", "degC")
    | _spelt(TEMPERATURE, 1.0, "K", zero=-273.15)
    | _spelt(PRESSURE, 1.0, "Pa")
    | _spelt(PRESSURE, 100.0, "hPa")
    | _spelt(PRESSURE, 1e3, "kPa")
    | _spelt(NUMBER, 1.0, "1")
)

# Words in headings, as `UNITS` spells them.
_WORDS = {
    r"^in\s+": "", r"[μµ]|micro ?": "u", r"milli ?": "m", r"nano ?": "n", "²": "2", r"\^": "", r"radians?": "rad",
    r"degrees?": "deg", r"teslas?": "t", r"gravit(y|ies)|g'?s$": "g", r"\s*(/|per)\s*s(ec(ond)?)?": "/s",
    r"celsius": "degc",
}  # fmt: skip
_SMALL = {name.casefold(): name for name in reversed([*UNITS]) if len(name) > 1} | {"g": "g"}


def find_unit(spelling: str) -> str:
    """Return the key of `UNITS` for a unit spelled in words or with other capitals; "" for an unknown unit."""
    if spelling.strip() in UNITS:
        return spelling.strip()
    text = spelling.strip().casefold()
    for pattern, word in _WORDS.items():
        text = re.sub(pattern, word, text)
    return _SMALL.get(text, "")
