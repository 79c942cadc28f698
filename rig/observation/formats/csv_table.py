"""Columns of numbers from another program's CSV file, of limited size."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from itertools import chain
from pathlib import Path
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from rig.config.column_map import TIMES
from rig.data.processes.reading_parts import Part
from rig.data.recording.motion_file import MAX_NUMBER, TIME, Header
from rig.errors import Refused
from rig.errors.quoting import quote
from rig.estimation.arrays import Array
from rig.observation.formats.column_selection import MappedColumns, check_headings, select_columns, unwrap_times
from rig.observation.formats.csv_cells import (
    find_wrong_unit,
    is_comment,
    is_number,
    is_time_of_day,
    is_value,
    origin_of,
    repeats,
    seconds_of,
    since,
    strip_blank_end,
    unit_of,
)
from rig.observation.formats.csv_text import is_harmless, read_rows
from rig.observation.formats.mat_table import is_mat, read_mat_rows
from rig.observation.formats.table_parts import columns_of, parts_read_apart, read_blocks

BLANK = float("nan")
LINE = "line"  # an additional column: the number of each row's line


@dataclass(frozen=True, slots=True)
class CsvTable:
    """A file's `columns` (n,) by name, NaN for a blank cell, and the line number (n,) of each row in the file.

    Times are relative to `origin_s`, a whole number of seconds: 0, unless times are large, as those since 1970 are.
    """

    columns: dict[str, Array]
    lines: NDArray[np.int64]
    origin_s: int = 0


def read_columns(
    path: Path, header: Header, largest_mb: int, mapped: MappedColumns | None = None, origin_s: int = 0
) -> dict[str, Array]:
    """Return the columns of a file as `read_table` does; no cell may be blank.

    Times are relative to `origin_s`. Raise Refused as `read_table` does, and `not_a_number` for a blank cell.
    """
    table = read_table(path, header, largest_mb, mapped, origin_s)
    for name, column in table.columns.items():
        if len(blank := np.flatnonzero(np.isnan(column))):
            raise blank_cell(path, name, int(table.lines[blank[0]]))
    return table.columns


def blank_cell(path: Path, name: str, line: int) -> Refused:
    """Return the refusal of a blank cell in a column."""
    what = f"{path}, line {line}: {name} is blank"
    return Refused("not_a_number", what, "Write a number into every cell, or leave the row out")


def read_table(
    path: Path, header: Header, largest_mb: int, mapped: MappedColumns | None = None, origin_s: int | None = None
) -> CsvTable:
    """Return the columns of a file that `header` names; each group of optional columns is complete or absent.

    The first row holds the names. All rows have this row's separators: commas, tabs, or semicolons as in spreadsheets
    with a decimal comma. Empty rows, rows of units below the heading, and repetitions of the heading are skipped. If
    the file is `mapped`, only columns in the map, or with the rig's names, are returned. A file packed by gzip is
    unpacked. Times count from `origin_s`, by default determined by the first time. A packed or long file is read in a
    process of its own, because it might exhaust the memory. Raise Refused `no_file`, `file_too_costly`,
    `temporary_folder_full`, `wrong_columns`, `wrong_unit`, `not_a_number`.
    """
    rate_hz = None if mapped is None else mapped.rate_hz
    if rate_hz is not None:
        needed = tuple(name for name in header.needed if name != TIME)
        header = replace(header, needed=needed, one_of=() if TIME in header.one_of else header.one_of)
    if not is_mat(path) and is_harmless(path, largest_mb):
        parts = [*_parts(path, header, largest_mb, mapped, origin_s)]
    else:
        arguments = {
            "names": [header.needed, header.one_of, header.optional],
            "largest_mb": largest_mb,
            "mapped": None if mapped is None else asdict(mapped),
            "origin_s": origin_s,
        }
        reader = "rig.observation.formats.csv_table:csv_parts"
        remedy = "Save it again from MATLAB" if is_mat(path) else "Give a CSV file"
        parts = parts_read_apart(reader, path, arguments, else_="cannot be read", remedy=remedy)
    *rows, last = parts
    columns = columns_of(rows)
    lines = columns.pop(LINE).astype(np.int64)
    notes = cast("dict[str, int]", last)
    columns = unwrap_times(columns, mapped, by_day=bool(notes["by_day"]))
    if rate_hz is not None:
        columns = {TIME: np.arange(len(lines)) / rate_hz, **columns}
    return CsvTable(columns, lines, notes["origin_s"])


def csv_parts(
    path: Path, names: Sequence[Any], largest_mb: int, mapped: dict[str, Any] | None, origin_s: int | None
) -> Iterator[Part]:
    """Yield what `_parts` yields, in a reading process, which receives its arguments as JSON and not as objects.

    `names` are the fields of a `Header`, `mapped` those of a `MappedColumns`. A part is a message of the process: a
    block of rows (n, columns), or a dictionary.
    """
    return _parts(path, Header(*names), largest_mb, None if mapped is None else MappedColumns(**mapped), origin_s)


def _parts(
    path: Path, header: Header, largest_mb: int, mapped: MappedColumns | None, origin_s: int | None
) -> Iterator[Part]:
    """Yield a file's rows in blocks, with the line number as an additional column, then the names of the columns.

    The last part states `origin_s`, and whether times are times of day (`by_day`).
    """
    skipped = 0 if mapped is None else mapped.skip_lines
    rows = read_mat_rows(path, header, mapped) if is_mat(path) else read_rows(path, largest_mb, skipped)
    headings, first = [name.strip() for name in next(rows, list[str]())], next(rows, list[str]())
    first_line = skipped + 2
    if mapped is not None and mapped.is_by_number and all(is_value(cell) for cell in headings if cell):
        rows, headings, first_line = chain([headings, first], rows), [""] * len(headings), skipped + 1
    else:
        headings = strip_blank_end(headings)
        check_headings(path, headings)
        rows = chain([first], rows)
    by_number = mapped is not None and mapped.is_by_number
    width = max(len(headings), len(first)) if by_number else len(headings)
    selected = select_columns(path, headings, width, header, mapped)
    factors = {} if mapped is None else {name: factor for name, (_, factor) in mapped.columns.items()}
    wanted = _WantedColumns(
        path,
        width,
        selected,
        tuple(factors.get(name, 1.0) for name in selected.values()),
        frozenset() if mapped is None else frozenset(mapped.missing),
        in_any_unit=mapped is not None and mapped.in_any_unit,
    )
    by_day = False

    def number_rows() -> Iterator[Sequence[float]]:
        nonlocal origin_s, by_day
        has_rows, repeated = False, False
        for line, row in enumerate(rows, start=first_line):
            numbers = () if origin_s != 0 else wanted.plain_numbers(row)
            if not numbers:
                if not any(map(str.strip, row)) or (has_rows and is_comment(row) and not repeats(row, headings)):
                    continue
                is_repeated = any(headings) and repeats(row, headings)
                if is_repeated or ((repeated or not has_rows) and wanted.names_units(line, row)):
                    repeated = is_repeated
                    continue
                cells = wanted.cells(line, row)
                if not has_rows:
                    by_day = wanted.is_by_day(cells)
                if origin_s is None:
                    origin_s = wanted.origin_s(cells)
                numbers = wanted.numbers(line, cells, origin_s)
            has_rows, repeated = True, False
            yield line, *numbers

    yield from read_blocks(number_rows(), [LINE, *selected.values()])
    yield {"origin_s": origin_s or 0, "by_day": by_day}


@dataclass(frozen=True, slots=True)
class _WantedColumns:
    """The columns to read from a file with `width` columns: their `names` by index, and their `factors` to SI.

    A cell with a text of `missing` is blank. `in_any_unit`: units that a row states are ignored.
    """

    path: Path
    width: int
    names: Mapping[int, str]
    factors: tuple[float, ...]
    missing: frozenset[str] = frozenset()
    in_any_unit: bool = False

    def plain_numbers(self, row: Sequence[str]) -> Sequence[float]:
        """Return a row's numbers in SI units by a fast method; empty for a row that needs the careful method."""
        if len(row) != self.width or not self.missing.isdisjoint(map(str.strip, row)):
            return ()
        try:
            numbers = [float(row[index]) * factor for index, factor in zip(self.names, self.factors, strict=True)]
        except ValueError:
            return ()
        return numbers if all(abs(number) < MAX_NUMBER for number in numbers) else ()

    def names_units(self, line: int, row: Sequence[str]) -> bool:
        """Return whether a row below the heading holds units and no numbers. Raise Refused `wrong_unit`."""
        if any(map(is_value, row)):
            return False
        cells = [row[index] if index < len(row) else "" for index in self.names]
        if not any(map(unit_of, cells)):
            return False
        if not self.in_any_unit and (wrong := find_wrong_unit(cells, self.factors)) is not None:
            name = [*self.names.values()][wrong]
            raise Refused(
                "wrong_unit",
                f"{self.path}, line {line} states that {name} is in {quote(cells[wrong])}, but it is read in another "
                "unit",
                "State its unit with --columns, or convert it to the one in the name",
            )
        return True

    def cells(self, line: int, row: Sequence[str]) -> list[str]:
        """Return the cells to read, blank if the row ends too early. Raise Refused `wrong_columns` for a longer row."""
        if any(map(str.strip, row[self.width :])):
            raise Refused(
                "wrong_columns",
                f"{self.path}, line {line} has {len(row)} cells, but the heading names {self.width} columns, so the "
                "cells cannot be assigned to columns",
                "Write a name for every column into the heading (col.names=NA in R's write.table), or a decimal point "
                "where a comma divides the columns",
            )
        cells = [row[index] if index < len(row) else "" for index in self.names]
        return ["" if cell.strip() in self.missing else cell for cell in cells]

    def is_by_day(self, cells: Sequence[str]) -> bool:
        """Return whether the first row holds a time of day."""
        return any(
            name in TIMES and is_time_of_day(cell) for cell, name in zip(cells, self.names.values(), strict=True)
        )

    def origin_s(self, cells: Sequence[str]) -> int:
        """Return the origin of times, s, from the first row; 0 if the row holds no time."""
        timed = [index for index, name in enumerate(self.names.values()) if name in TIMES and is_value(cells[index])]
        try:
            return origin_of(float(seconds_of(cells[index], self.factors[index])) for index in timed)
        except (ValueError, ArithmeticError):  # the row is refused as a whole
            return 0

    def numbers(self, line: int, cells: Sequence[str], origin_s: int) -> list[float]:
        """Return a row's numbers in SI units, with NaN for a blank cell. Raise Refused `not_a_number`."""
        try:
            numbers = [
                since(cell, factor, origin_s)
                if name in TIMES and cell.strip() and (origin_s or not is_number(cell))
                else float(cell) * factor
                if cell.strip()
                else BLANK
                for cell, factor, name in zip(cells, self.factors, self.names.values(), strict=True)
            ]
        except (ValueError, ArithmeticError):
            numbers = list[float]()
        right = [abs(number) < MAX_NUMBER or not cell.strip() for number, cell in zip(numbers, cells, strict=False)]
        if len(right) < len(cells) or not all(right):
            raise Refused(
                "not_a_number",
                f"{self.path}, line {line}: {quote(','.join(cells))} is not {len(cells)} numbers below {MAX_NUMBER:g}",
                "Write plain decimal numbers with a point, no NaN, one for each column; state the text of a missing "
                "value with --columns; or leave out what is not a reading",
            )
        return numbers
