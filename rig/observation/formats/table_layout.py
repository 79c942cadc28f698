"""The layout of a text table of unknown origin: its heading, its columns of numbers, and its column of time."""

import re
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import islice
from pathlib import Path
from typing import Any, cast

import numpy as np

from rig.config.column_map import ALLOWED_UNITS
from rig.config.units import TIME, UNITS, find_unit
from rig.data.processes.reading_parts import Part
from rig.data.recording.motion_file import MAX_NUMBER
from rig.errors import Refused
from rig.estimation.arrays import Array
from rig.observation.formats.csv_cells import (
    is_comment,
    is_number,
    is_value,
    repeats,
    seconds_of,
    strip_blank_end,
    unit_of,
)
from rig.observation.formats.csv_text import is_harmless, read_rows
from rig.observation.formats.mat_table import NAN, is_mat, read_mat_columns, spell_numbers
from rig.observation.formats.table_parts import parts_read_apart

MAX_SKIPPED_LINES = 100  # before the heading
SAMPLED_ROWS = 400
FEWEST_ROWS = 20  # of a table: matrices and vectors of parameters are shorter
MISSING_WORDS = frozenset({"NaN", "nan", "NAN", "NA", "N/A", "null", "None", "-", "--"})
TIME_NAME = re.compile(
    r"(sys|sample|sensor|elapsed|header|gps)?_?(time|timestamp|t|ts|stamp|millis|micros|sec|seconds)_?\w{0,3}"
)
SENSOR_WORD = re.compile("gyr|acc|mag|quat", re.IGNORECASE)
BRACKETED_UNIT = re.compile(r"[\[(]\s*([^\])]+?)\s*[\])]\s*$")
UNDERSCORED_UNIT = re.compile(r"_(deg_s|dps|mdps|rad_s|m_s2|mg|g|ms|us|ns|s|deg|rad|t|ut|c)$", re.IGNORECASE)
SPELLED_UNITS = {"deg_s": "deg/s", "rad_s": "rad/s", "m_s2": "m/s2", "t": "T", "ut": "uT", "c": "C"}
ASSUMED_RATE_HZ = 100.0  # the sample rate by which a unit of time is chosen
EPOCH_RANGE_S = (9e8, 4.2e9)  # seconds since 1970: from 1998 to 2103
MAX_STEP_S = 2.0  # from reading to reading: numbers with longer steps are no seconds since 1970
USUAL_FRACTION = 0.98  # of the steps: the others may be gaps, or stamps with a lost digit
MAX_LATE_FRACTION = 0.05  # of rows that are written a little later than the next one
COUNT_NAME = re.compile("packet|count|number|index|seq|frame", re.IGNORECASE)
UNIT_WORDS = {"ms": "ms", "us": "us", "µs": "us", "ns": "ns", "sec": "s"}


@dataclass(frozen=True, slots=True)
class TableLayout:
    """The layout of a table.

    - skip_lines: lines before the heading.
    - headings: the names of the columns, "" without one; units: as stated by the heading or the row below it, or "".
    - numbers: the indices of the columns of numbers; texts: the indices of the others that are not blank.
    - time: the index of the column of time, None without one; time_unit: the unit of its numbers, None if its cells are
      texts.
    - missing: the texts that stand for missing values.
    - rows: the number of rows.
    """

    skip_lines: int
    headings: tuple[str, ...]
    units: tuple[str, ...]
    numbers: tuple[int, ...]
    texts: tuple[int, ...]
    time: int | None
    time_unit: str | None
    missing: tuple[str, ...]
    rows: int
    is_shifted: bool = False  # rows have one cell more than the heading has names
    has_groups: bool = False  # two lines of headings: of groups of columns, and of the columns of each group

    @property
    def has_heading(self) -> bool:
        """Whether the file names its columns."""
        return any(self.headings)

    def name(self, index: int) -> str | int:
        """Return the name of a column in a column map: its heading, or its number from 1."""
        heading = self.headings[index]
        is_name = heading and self.headings.count(heading) == 1 and not (self.is_shifted or self.has_groups)
        return heading if is_name else index + 1


def find_layout(path: Path, largest_mb: int) -> TableLayout:
    """Return the layout of a text table or a `.mat` file. Raise Refused as `read_table` does."""
    arguments = {"largest_mb": largest_mb}
    if not is_mat(path) and is_harmless(path, largest_mb):
        (part,) = layout_parts(path, **arguments)
    else:
        reader = "rig.observation.formats.table_layout:layout_parts"
        (part,) = parts_read_apart(reader, path, arguments, else_="cannot be read", remedy="Give a table of readings")
    layout: Any = {
        name: tuple(value) if isinstance(value, list) else value for name, value in cast("dict[str, Any]", part).items()
    }
    return TableLayout(**layout)


def layout_parts(path: Path, largest_mb: int) -> Iterator[Part]:
    """Yield the layout of a file as one part. Raise Refused `wrong_columns` if the file has no rows of numbers."""
    if is_mat(path):
        yield _layout_of_mat(path)
        return
    skip, groups, heading = _find_beginning(path, largest_mb)
    data = read_rows(path, largest_mb, skip)
    if heading:
        next(data)
    heading = [name.strip() for name in (_join_headings(groups, heading) if groups else heading)]
    table = _sample_rows(data, heading)
    # A blank cell at the end of each row is none: some loggers end every line by a separator.
    width = max([len(heading), *(len(strip_blank_end([*map(str.strip, row)])) for row in table.sampled[:2])])
    # R writes no heading for the column of row numbers.
    shift = 1 if heading and len(heading) == width - 1 else 0
    headings, units, *cells = (
        (row + [""] * width)[:width] for row in ([""] * shift + heading, [""] * shift + table.units, *table.sampled)
    )
    named = {"is_shifted": bool(shift), "has_groups": bool(groups)}
    yield {**_describe(skip, headings, units, cells, sorted(table.missing), table.count), **named}


def _layout_of_mat(path: Path) -> dict[str, Any]:
    columns = read_mat_columns(path)
    rows = _find_table_rows(columns)
    columns = {name: column for name, column in columns.items() if len(column) == rows}
    count = min(rows, SAMPLED_ROWS)
    cells = [list(row) for row in zip(*(spell_numbers(column[:count]) for column in columns.values()), strict=True)]
    return _describe(0, [*columns], [""] * len(columns), cells, [NAN] if _have_nan(columns) else [], rows)


@dataclass(slots=True)
class _SampledTable:
    """The first rows of a table, its row of units, if any, the texts for missing values, and the number of all rows."""

    sampled: list[list[str]] = field(default_factory=list)
    units: list[str] = field(default_factory=list)
    missing: set[str] = field(default_factory=set)
    count: int = 0


def _sample_rows(rows: Iterator[list[str]], heading: Sequence[str]) -> _SampledTable:
    """Return a sample of the rows below the heading, without blank rows, comments and repeated headings."""
    table = _SampledTable()
    for row in rows:
        if not any(map(str.strip, row)) or (heading and repeats(row, heading)) or (table.count and is_comment(row)):
            continue
        if not table.count and not any(map(is_value, row)) and any(map(unit_of, row)):
            table.units = [cell.strip() for cell in row]
            continue
        table.count += 1
        table.missing |= MISSING_WORDS.intersection(map(str.strip, row))
        if len(table.sampled) < SAMPLED_ROWS:
            table.sampled.append(row)
    return table


def _names_columns(heading: Sequence[str], below: Sequence[Sequence[str]]) -> bool:
    """Return whether a heading names groups of columns, and the first row below it names the columns.

    The heading of a group is above its first column, so some of its cells are blank.
    """
    if all(heading):
        return False
    names = [name for name in below[0] if name]
    units = sum(unit_of(name) is not None for name in names)
    return len(names) >= 2 and 2 * units < len(names) and not any(map(is_value, names)) and any(map(is_value, below[1]))


def _join_headings(groups: Sequence[str], names: Sequence[str]) -> list[str]:
    """Return the heading of each column: its group, stated above the first column, and the column's name or unit."""
    joined: list[str] = []
    group = ""
    for index, name in enumerate(names):
        group = (groups[index] if index < len(groups) else "") or group
        joined.append(f"{group} [{name}]" if unit_of(name) else f"{group} {name}".strip())
    return joined


def _find_table_rows(columns: Mapping[str, Array]) -> int:
    """Return the number of rows of the table in a `.mat` file: the length of the columns that mention most sensors.

    Sensors are mentioned in the columns' names. If columns of several lengths mention equally many, the most common
    length is taken. Short columns are parameters.
    """
    lengths = Counter(map(len, columns.values()))
    longest = max(lengths)
    sensors: dict[int, set[str]] = {length: set() for length in lengths}
    for name, column in columns.items():
        sensors[len(column)] |= {word.lower() for word in SENSOR_WORD.findall(name)}
    return max(
        lengths,
        key=lambda length: (length >= min(longest, FEWEST_ROWS), len(sensors[length]), lengths[length], length),
    )


def _have_nan(columns: Any) -> bool:
    return any(np.isnan(column).any() for column in columns.values())


def _find_beginning(path: Path, largest_mb: int) -> tuple[int, list[str], list[str]]:
    """Return the number of lines to skip, the heading of groups of columns, and the heading of columns.

    Either heading may be empty. Raise Refused `wrong_columns`.
    """
    for skip in range(MAX_SKIPPED_LINES):
        rows = [*islice(read_rows(path, largest_mb, skip), 6)]
        if len(rows) < 3:
            break
        head, *below = ([cell.strip() for cell in row] for row in rows)
        data = [row for row in below if sum(map(is_value, row)) >= 2]
        if len(data) < 2 or not len(data[0]) - 1 <= len([*head]) <= len(data[0]) + 1:
            continue
        values = sum(map(is_value, head))
        if values >= 2:
            return skip, [], []
        if sum(map(bool, head)) >= 2:
            return (skip + 1, head, below[0]) if _names_columns(head, below) else (skip, [], head)
    raise Refused(
        "wrong_columns",
        f"{path} has no rows of numbers below a heading in its first {MAX_SKIPPED_LINES} lines",
        "Give a table: a row for each reading, numbers in columns",
    )


def _describe(  # noqa: PLR0917
    skip: int, headings: list[str], units: list[str], cells: list[list[str]], missing: list[str], rows: int
) -> dict[str, Any]:
    """Return the fields of a `TableLayout`: which columns hold numbers, texts and the time."""
    columns = _strip_columns(cells, missing)
    stated = [
        _spell_unit(unit) if unit else find_unit_in(heading) for heading, unit in zip(headings, units, strict=True)
    ]
    numbers = _select_indices(columns, is_number)
    time = _find_time(headings, stated, columns, _select_indices(columns, is_value))
    time_unit = None if time is None or time not in numbers else _time_unit(headings[time], stated[time], columns[time])
    return {
        "skip_lines": skip,
        "headings": headings,
        "units": stated,
        "numbers": [index for index in numbers if index == time or _largest_number(columns[index]) < MAX_NUMBER],
        "texts": [index for index, column in enumerate(columns) if column and index not in {*numbers, time}],
        "time": time,
        "time_unit": time_unit,
        "missing": missing,
        "rows": rows,
    }


def _strip_columns(cells: Sequence[Sequence[str]], missing: Sequence[str]) -> list[list[str]]:
    """Return the columns of a table whose rows are `cells`, without blank cells and the marks of `missing` values."""
    return [
        [cell.strip() for cell in column if cell.strip() not in {"", *missing}] for column in zip(*cells, strict=True)
    ]


def _select_indices(columns: Sequence[Sequence[str]], accept: Callable[[str], bool]) -> list[int]:
    """Return the indices of the columns that have cells, all of which `accept` accepts."""
    return [index for index, column in enumerate(columns) if column and all(map(accept, column))]


def find_unit_in(heading: str) -> str:
    """Return the unit that a heading states in brackets or at its end, as `UNITS` spells it, or ""."""
    if (match := BRACKETED_UNIT.search(heading)) is not None:
        return _spell_unit(match[1])
    if (match := UNDERSCORED_UNIT.search(heading)) is not None:
        return SPELLED_UNITS.get(match[1].lower(), match[1].lower())
    return ""


def _spell_unit(stated: str) -> str:
    """Return a unit as `UNITS` spells it, or "" if it is unknown."""
    text = re.sub(r"\s*(s)\^?-(\d)", lambda power: f"/s{power[2] if power[2] != '1' else ''}", stated)
    return find_unit(f"{text}/s" if text.casefold() == "mdeg" else text)  # some loggers leave out the second


def _largest_number(column: Sequence[str]) -> float:
    return max(abs(float(cell)) for cell in column)


def _find_time(
    headings: Sequence[str], units: Sequence[str], columns: Sequence[Sequence[str]], times: Sequence[int]
) -> int | None:
    """Return the index of the time column: the first that rises and has a time's name or unit, or None.

    If no rising column has such a name or unit, the first rising one that does not count rows is taken.
    """
    rising = [index for index in times if _rises(columns[index])]
    for index in rising:
        name = re.sub(r"\W+", "_", BRACKETED_UNIT.sub("", headings[index]).strip().lower()).strip("_")
        if TIME_NAME.fullmatch(name.rpartition(".")[2]) or (
            units[index] in UNITS and UNITS[units[index]].quantity == TIME
        ):
            return index
    is_count = [bool(COUNT_NAME.search(headings[index])) or _increases_by_one(columns[index]) for index in rising]
    return next((index for index, counts in zip(rising, is_count, strict=True) if not counts), None)


def _rises(column: Sequence[str]) -> bool:
    """Return whether a column mostly increases; it may decrease at restarts of a counter, and in a few late rows."""
    try:
        steps = np.diff([float(seconds_of(cell, 1.0)) for cell in column])
    except (ValueError, ArithmeticError):
        return False
    falls = (steps < 0).sum() <= max(2, MAX_LATE_FRACTION * len(steps))
    # Coarse times are equal in most rows, so a tenth of the steps must rise.
    return len(steps) > 1 and bool(falls and (steps > 0).mean() > 0.1 and np.median(steps) >= 0)


def _increases_by_one(column: Sequence[str]) -> bool:
    """Return whether a column increases by one from row to row, like row numbers."""
    return is_number(column[0]) and bool((np.diff([float(cell) for cell in column]) == 1).all())


def _time_unit(heading: str, unit: str, column: Sequence[str]) -> str:
    """Return the time unit that the heading states, or else the unit in which the numbers are plausible.

    Numbers are plausible if they are dates of recent years, or if they give a likely sample rate.
    """
    if unit in ALLOWED_UNITS and UNITS[unit].quantity == TIME:
        return unit
    name = heading.lower()
    named = [UNIT_WORDS[word] for word in re.split(r"[\W_]+", name) if word in UNIT_WORDS]
    if named:
        return named[-1]
    for word, meant in (
        ("milli", "ms"),
        ("micro", "us"),
        ("nano", "ns"),
        ("nsec", "ns"),
        ("usec", "us"),
        ("msec", "ms"),
    ):
        if word in name:
            return meant
    values = np.array([float(cell) for cell in column])
    sizes = {name: UNITS[name].size for name in ("s", "ms", "us", "ns")}
    steps = np.diff(values)
    rising = steps[steps >= 0]
    step = float(np.mean(rising[rising <= np.quantile(rising, USUAL_FRACTION)]))
    for name, size in sizes.items():
        if EPOCH_RANGE_S[0] < values[0] * size < EPOCH_RANGE_S[1] and step * size < MAX_STEP_S:
            return name
    return min(sizes, key=lambda name: abs(np.log(max(step, 1e-12) * sizes[name] * ASSUMED_RATE_HZ)))
