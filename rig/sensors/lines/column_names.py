"""The headings of an unknown log, in the form of a device's column names."""

import re
from collections.abc import Sequence

from rig.config.units import UNITS
from rig.observation.formats.table_layout import TableLayout
from rig.sensors.lines.guessing import match_names

REPEATED = "repeated"
AXES = ("x", "y", "z")
TEMPERATURE_WORDS = {"temp", "temperature"}
BRACKETED_CELSIUS = re.compile(r"[\[(]\s*(°|deg ?)?C\s*[\])]")
LABEL = r"[a-z]?|(c|col|column|v|var|ch|channel|d|data|value|field|unnamed|x)_?\d+"
UNIT_WORDS = {"rad", "s", "deg", "dps", "mdps", "m", "s2", "g", "mg", "t", "ut"}
SHORT_NAMES = {"g", "gyr", "gyro", "w", "r", "a", "acc", "accel", "f", "m", "mag", "b", "h"}
OTHER_WORDS = re.compile(r"angle|angular_?acc|accuracy|magnitude|bias|offset|std|sigma|covar|error|jerk")
KIND_BY_WORD = re.compile(
    r"(?<![^_])(?:(?P<gyro>g|w|omega|(?:gyr|ang|rot)[^_]*)|(?P<acc>a|(?:acc|lin)[^_]*)|(?P<mag>mag[^_]*))(?![^_])"
)
KIND_BY_PART = re.compile(r"(?P<gyro>gyr)|(?P<acc>acc)|(?P<mag>mag)")  # SENSgyro
KIND_OF = {UNITS["rad/s"].quantity: "gyro", UNITS["m/s2"].quantity: "acc", UNITS["T"].quantity: "mag"}


def state_unit(layout: TableLayout, index: int) -> str:
    """Return the unit that a column's heading states, as `UNITS` spells it, or "".

    The unit G after an accelerometer's name means gravity, not gauss.
    """
    unit = layout.units[index]
    return unit.lower() if unit in {"G", "mG"} and "acc" in layout.headings[index].lower() else unit


def simplify_heading(layout: TableLayout, index: int) -> str:
    """Return a heading in the form of a device's column names: `gyro_x [deg/s]`."""
    # A column of a matrix, as MATLAB and its users write it: imu.gyro(:,1) becomes gyro_x.
    name = layout.headings[index].rpartition(".")[2] if "(:" in layout.headings[index] else layout.headings[index]
    if (match := re.fullmatch(r"(.*)\((?::,)?([1-3])(?:,:)?\)", name)) is not None:
        name = f"{match[1]}_{'xyz'[int(match[2]) - 1]}"
    name = re.sub(r"\s*[\[(].*?[\])]", "", name).strip()  # without a unit in brackets
    # gyroX becomes gyro, x
    words = [word for word in re.split(r"[\W_]+", re.sub(r"([a-z])([XYZ])\b", r"\1_\2", name).lower()) if word]
    unit = state_unit(layout, index)
    if TEMPERATURE_WORDS.intersection(words) or BRACKETED_CELSIUS.search(layout.headings[index]):
        return "temp"
    words = _strip_units(_divide_axis(words))
    if words and words[-1] not in AXES and words[0] in AXES:  # X Gyro
        words = [*words[1:], words[0]]
    axes = [word for word in words if word in AXES]
    before = [word for word in words if word not in AXES]
    if len(axes) == 1 and (kind := _find_kind(before, unit)):  # acc_x_raw becomes acc_x
        words = [kind, axes[0]]
    return "_".join(words) + (f" [{unit}]" if unit else "")


def _find_kind(words: Sequence[str], unit: str) -> str:
    """Return the kind of sensor of a heading from its `unit` or, if that shows nothing, its `words`; "" if unknown.

    The unit decides first, because fx_uT is a field, not a force.
    """
    text = "_".join(words)
    if OTHER_WORDS.search(text):
        return ""
    if unit in UNITS and UNITS[unit].quantity in KIND_OF:  # x [°/s]
        return KIND_OF[UNITS[unit].quantity]
    match = (KIND_BY_WORD.search(text) if len(words) > 1 else None) or KIND_BY_PART.search(text)
    return "" if match is None else str(match.lastgroup)


def _divide_axis(words: list[str]) -> list[str]:
    """Return a heading's words with the axis split off a sensor's short name: fx_uT becomes f, x, uT."""
    match = re.fullmatch(r"(.+)([xyz])", words[0]) if words else None
    is_short = match is not None and match[1] in SHORT_NAMES and UNIT_WORDS.issuperset(words[1:])
    return [match[1], match[2], *words[1:]] if match is not None and is_short else words


def _strip_units(words: list[str]) -> list[str]:
    """Return a heading's words without the words of its unit, which follow the axis.

    If only the axis is left, the kind of sensor that has this unit is put before it.
    """
    axes = [position for position, word in enumerate(words) if word in AXES]
    if axes and axes[-1] < len(words) - 1 and all(word in UNIT_WORDS for word in words[axes[-1] + 1 :]):
        kind = {"rad": "gyro", "deg": "gyro", "dps": "gyro", "m": "acc", "t": "mag", "ut": "mag"}.get(
            words[axes[-1] + 1]
        )
        before = words[: axes[-1]] or ([kind] if kind else [])
        return [*before, words[axes[-1]]]
    return words


def order_axes(indices: Sequence[int], names: Sequence[str]) -> list[int]:
    """Return the columns; those that are named x, y, z are put in this order, because some loggers write z first."""
    axes = iter(sorted((index for index in indices if is_axis(names[index])), key=lambda index: names[index]))
    return [next(axes) if is_axis(names[index]) else index for index in indices]


def is_axis(name: str) -> bool:
    return name.partition(" ")[0] in AXES


def is_nameless(name: str) -> bool:
    """Return whether a simplified heading says nothing about a quantity: it is empty, a bare axis, or a mere label."""
    return re.fullmatch(LABEL, name.partition(" ")[0]) is not None


def find_axis(name: str) -> tuple[str, str] | None:
    """Return the sensor ("g", "a" or "m") and the axis that a simplified heading names; None if it names no axis."""
    column = match_names((name,)).get(0, "")
    return (column[0], column[1]) if len(column) == 2 else None


def mark_repeated(names: Sequence[str]) -> list[str]:
    """Return the names, with a mark before repeated ones, so that of two sensors of one kind the first is read."""
    keys = [find_axis(name) or name for name in names]
    return [f"{REPEATED} {name}" if name and keys[index] in keys[:index] else name for index, name in enumerate(names)]
