"""Cells of a text file as numbers in SI units: exact times from any origin, and units in their usual spellings.

A time may be a number, a date with the time of day (ISO 8601; UTC if no zone is stated), or the time of day alone.
"""

import re
from collections.abc import Iterable, Sequence
from datetime import UTC, datetime
from decimal import Decimal

from rig.config.units import UNITS, Unit

DAY_S = 86_400
TIME_OF_DAY = re.compile(
    r"(?:(?P<date>\d{4}[-/]\d\d[-/]\d\d)[T ])?\s*(?:(?P<h>\d{1,2}):)?(?P<m>\d{1,2}):(?P<s>\d{1,2}(?:[.,]\d+)?)"
    r"\s*(?P<half>[AaPp][Mm])?\s*(?P<zone>Z|[+-]\d\d:?\d\d)?"
)
MAX_FLOAT_TIME_S = 1e6  # a clock with a larger time started long before the recording: a float may lose microseconds
SPELLINGS = (("^", ""), ("sec", "s"), ("²", "2"))  # spellings of units, in addition to those of the table
HEADING_MARKS = "#%"  # characters before the heading of a table by NumPy or MATLAB
COMMENT_MARKS = (*HEADING_MARKS, "//")


def is_number(cell: str) -> bool:
    """Return whether a cell holds a number; "nan" and "inf" are numbers."""
    try:
        float(cell)
    except ValueError:
        return False
    return True


def is_value(cell: str) -> bool:
    """Return whether a cell holds a number or a time."""
    return is_number(cell) or TIME_OF_DAY.fullmatch(cell.strip()) is not None


def is_time_of_day(cell: str) -> bool:
    """Return whether a cell holds a time of day without a date, which restarts at midnight."""
    match = TIME_OF_DAY.fullmatch(cell.strip())
    return match is not None and match["date"] is None


def seconds_of(cell: str, factor: float) -> Decimal:
    """Return the time, s, in a cell: a number in units of `factor` s, or a date or time of day as text.

    A date counts from 1970, a time of day from midnight. Raise ValueError or ArithmeticError for any other text.
    """
    match = TIME_OF_DAY.fullmatch(cell.strip())
    if match is None:
        return Decimal(cell) * Decimal(repr(factor))
    if factor != 1.0:
        raise ValueError("a time in text has no unit")
    hour = int(match["h"] or 0)
    if match["half"] is not None:
        hour = hour % 12 + (12 if match["half"].lower() == "pm" else 0)
    time_s = 3600 * hour + 60 * int(match["m"]) + Decimal(match["s"].replace(",", "."))
    if match["date"] is None:
        return time_s
    zone = datetime.strptime(match["zone"], "%z").tzinfo if match["zone"] else UTC
    midnight = datetime.fromisoformat(match["date"].replace("/", "-")).replace(tzinfo=zone)
    return int(midnight.timestamp()) + time_s


def origin_of(times_s: Iterable[float]) -> int:
    """Return the origin of times, in whole seconds, from the first time; 0 for a clock that starts near 0."""
    first_s = next(iter(times_s), 0.0)
    return int(first_s) if abs(first_s) >= MAX_FLOAT_TIME_S else 0


def since(cell: str, factor: float, origin_s: int) -> float:
    """Return the seconds from `origin_s` to a cell's time, whose unit is `factor` s. Raise as `seconds_of` does."""
    return float(seconds_of(cell, factor) - origin_s)  # subtracted before it is rounded


def unit_of(cell: str) -> Unit | None:
    """Return the unit that a cell names, with or without brackets; None for a unit that is not in `UNITS`."""
    name = cell.strip().strip("[](){} ")
    if name in UNITS:
        return UNITS[name]
    for spelling, name_in_table in SPELLINGS:
        name = name.replace(spelling, name_in_table)
    return UNITS.get(name)


def strip_blank_end(headings: Sequence[str]) -> list[str]:
    """Return headings without blank ones at the end, because some loggers end every line by a separator."""
    count = max((index for index, name in enumerate(headings, start=1) if name), default=0)
    return [*headings[:count]]


def is_comment(row: Sequence[str]) -> bool:
    """Return whether a row is a comment, which some programs write below their readings."""
    return row[0].lstrip().startswith(COMMENT_MARKS)


def repeats(row: Sequence[str], headings: Sequence[str]) -> bool:
    """Return whether a row repeats the heading, as loggers write it when they restart or at regular intervals."""
    return strip_blank_end([cell.strip().lstrip(f"{HEADING_MARKS} ") for cell in row]) == strip_blank_end(headings)


def find_wrong_unit(cells: Sequence[str], factors: Sequence[float]) -> int | None:
    """Return the index of the first cell, in a row of units, that names another unit than its column's, or None.

    `factors` are the sizes of the columns' units. A cell without a known unit contradicts nothing.
    """
    for index, (cell, factor) in enumerate(zip(cells, factors, strict=True)):
        unit = unit_of(cell)
        if unit is not None and (unit.zero or abs(unit.size - factor) > 1e-9 * factor):
            return index
    return None
