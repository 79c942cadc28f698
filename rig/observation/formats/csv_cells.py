"""Cells of a text file as numbers in SI units: exact times from any origin, and units in their usual spellings."""

from collections.abc import Iterable, Sequence
from decimal import Decimal

from rig.config.units import UNITS, Unit

TIMES = ("time_s", "start_s", "end_s")
LONG_AGO_S = 1e6  # a clock that shows more began long before the recording: a float may lose microseconds
SPELLINGS = (("^", ""), ("sec", "s"), ("²", "2"))  # of units, in addition to those of the table


def is_number(cell: str) -> bool:
    """Return whether a cell holds a number, "nan" and "inf" among them."""
    try:
        float(cell)
    except ValueError:
        return False
    return True


def origin_of(times_s: Iterable[float]) -> int:
    """Return the whole seconds from which times are to count, by the first of them: 0 for those of a young clock."""
    first_s = next(iter(times_s), 0.0)
    return int(first_s) if abs(first_s) >= LONG_AGO_S else 0


def since(cell: str, factor: float, origin_s: int) -> float:
    """Return the time in a cell, in units of `factor` s, counted from `origin_s`, without loss of a digit."""
    return float(Decimal(cell) * Decimal(repr(factor)) - origin_s)


def unit_of(cell: str) -> Unit | None:
    """Return the unit that a cell names, in brackets or not; None if it names none of the table."""
    name = cell.strip().strip("[](){} ")
    if name in UNITS:
        return UNITS[name]
    for spelling, name_in_table in SPELLINGS:
        name = name.replace(spelling, name_in_table)
    return UNITS.get(name)


def find_wrong_unit(cells: Sequence[str], factors: Sequence[float]) -> int | None:
    """Return the index of the first cell of a row of units whose unit is not the one its column is read in, or None."""
    for index, (cell, factor) in enumerate(zip(cells, factors, strict=True)):
        unit = unit_of(cell)
        if unit is not None and (unit.zero or abs(unit.size - factor) > 1e-9 * factor):
            return index
    return None
