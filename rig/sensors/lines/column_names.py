"""The headings of an unknown log, in the form of a device's column names."""

import re
from collections.abc import Sequence

from rig.config.units import UNITS, find_unit
from rig.observation.formats.table_layout import TableLayout

AXES = ("x", "y", "z")
TEMPERATURE_WORDS = {"temp", "temperature"}
BRACKETED_CELSIUS = re.compile(r"[\[(]\s*(°|deg ?)?C\s*[\])]")
KIND_OF = {UNITS["rad/s"].quantity: ("gyro",), UNITS["m/s2"].quantity: ("acc",), UNITS["T"].quantity: ("mag",)}


def state_unit(layout: TableLayout, index: int) -> str:
    """Return the unit that a column's heading states, as `UNITS` spells it, or "".

    G after an accelerometer's name is that of gravity, not gauss.
    """
    unit, heading = layout.units[index], layout.headings[index]
    if unit in UNITS:
        return unit.lower() if unit in ("G", "mG") and "acc" in heading.lower() else unit
    bracketed = re.search(r"[\[(]([^\])]+)[\])]\s*$", heading)
    return find_unit(bracketed[1] if bracketed else unit)


def simplify_heading(layout: TableLayout, index: int) -> str:
    """Return a heading in the form of a device's column names: `gyro_x [deg/s]`."""
    name = layout.headings[index].rpartition(".")[2] if "(:" in layout.headings[index] else layout.headings[index]
    if (match := re.fullmatch(r"(.*)\((?::,)?([1-3])(?:,:)?\)", name)) is not None:
        name = f"{match[1]}_{'xyz'[int(match[2]) - 1]}"
    name = re.sub(r"\s*[\[(].*?[\])]", "", name).strip()
    words = [word for word in re.split(r"[\W_]+", re.sub(r"([a-z])([XYZ])\b", r"\1_\2", name).lower()) if word]
    words = _strip_units(words)
    if words and words[-1] not in AXES and words[0] in AXES:
        words = [*words[1:], words[0]]
    if len(words) > 2 and words[-1] in AXES:  # imu_angular_velocity_x, w_RS_S_x
        kind = next((word for word in words[:-1] if word[:3] in KINDS or word in KINDS), None)
        words = [KINDS.get(kind, KINDS.get(kind[:3], "")), words[-1]] if kind is not None else words
    unit = state_unit(layout, index)
    if TEMPERATURE_WORDS.intersection(words) or BRACKETED_CELSIUS.search(layout.headings[index]):
        return "temp"
    if len(words) == 1 and words[0] in AXES and unit in UNITS:  # x [°/s]
        words = [*KIND_OF.get(UNITS[unit].quantity, ()), *words]
    return "_".join(words) + (f" [{unit}]" if unit else "")


KINDS = {
    "gyr": "gyro",
    "ang": "gyro",
    "omega": "gyro",
    "w": "gyro",
    "rot": "gyro",
    "acc": "acc",
    "lin": "acc",
    "a": "acc",
    "mag": "mag",
}


def _strip_units(words: list[str]) -> list[str]:
    """Return a heading's words up to the axis, without a unit that follows, as in x_rad_s."""
    axes = [position for position, word in enumerate(words) if word in AXES]
    if axes and axes[-1] < len(words) - 1 and all(word in UNIT_WORDS for word in words[axes[-1] + 1 :]):
        kind = {"rad": "gyro", "deg": "gyro", "dps": "gyro", "m": "acc", "t": "mag", "ut": "mag"}.get(
            words[axes[-1] + 1]
        )
        before = words[: axes[-1]] or ([kind] if kind else [])
        return [*before, words[axes[-1]]]
    return words


UNIT_WORDS = {"rad", "s", "deg", "dps", "mdps", "m", "s2", "g", "mg", "t", "ut"}


def order_axes(indices: Sequence[int], names: Sequence[str]) -> list[int]:
    """Return the columns, in the order x, y, z if these are their names, because some loggers write z first."""
    axes = iter(sorted((index for index in indices if is_axis(names[index])), key=lambda index: names[index]))
    return [next(axes) if is_axis(names[index]) else index for index in indices]


def is_axis(name: str) -> bool:
    return name.partition(" ")[0] in AXES
