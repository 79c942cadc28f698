"""Columns of numbers from another program's CSV file: within bounds, or refused by name."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from rig.data.processes.reading_process import Part
from rig.data.recording.motion_file import LARGEST_NUMBER, Header
from rig.errors import Refused
from rig.errors.quoting import quote, shorten
from rig.estimation.arrays import Array
from rig.observation.formats.csv_cells import TIMES, find_wrong_unit, is_number, origin_of, since, unit_of
from rig.observation.formats.csv_text import is_harmless, read_rows
from rig.observation.formats.table_parts import columns_of, in_blocks, parts_read_apart

BLANK = float("nan")
LINE = "line"  # an additional column: the line of each row


@dataclass(frozen=True, slots=True)
class Mapped:
    """The columns of another program's file: by the rig's name of a column, its name in the file and the factor to SI.

    `skip_lines` precede the heading.
    """

    columns: Mapping[str, tuple[str, float]]
    skip_lines: int = 0


@dataclass(frozen=True, slots=True)
class CsvTable:
    """A file's `columns` (n,) by name, NaN for a blank cell, and the `lines` (n,) of its rows.

    Times count from `origin_s`, whole seconds: 0, except in files whose clock counts from 1970 or so.
    """

    columns: dict[str, Array]
    lines: NDArray[np.int64]
    origin_s: int = 0


def read_columns(
    path: Path, header: Header, largest_mb: int, mapped: Mapped | None = None, origin_s: int = 0
) -> dict[str, Array]:
    """Return the columns of a file as `read_table`, none of whose cells is blank; times count from `origin_s`.

    Raise Refused as `read_table`, and `not_a_number` for a blank cell.
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
    path: Path, header: Header, largest_mb: int, mapped: Mapped | None = None, origin_s: int | None = None
) -> CsvTable:
    """Return the columns of a file by name, those of its header; of each group of optional columns all, or none.

    The first row holds the names. If it is divided by semicolons, as in spreadsheets with a decimal comma, or by tabs,
    all rows are. Empty rows and rows of units below the heading are skipped. From a `mapped` file come the columns
    named in the map or as in the rig, whatever others it has. A file packed by gzip is unpacked. Times count from
    `origin_s`; None chooses it by the first of them. A packed or long file is read by a process of its own; a short one
    can do no harm. Raise Refused `no_file`, `file_too_costly`, `temporary_folder_full`, `wrong_columns`, `wrong_unit`,
    `not_a_number`.
    """
    if is_harmless(path, largest_mb):
        parts = [*_parts(path, header, largest_mb, mapped, origin_s)]
    else:
        arguments = {
            "names": [header.needed, header.one_of, header.optional],
            "largest_mb": largest_mb,
            "mapped": None if mapped is None else [dict(mapped.columns), mapped.skip_lines],
            "origin_s": origin_s,
        }
        reader = "rig.observation.formats.csv_table:csv_parts"
        parts = parts_read_apart(reader, path, arguments, else_="cannot be read", remedy="Give a CSV file")
    *rows, last = parts
    columns = columns_of(rows)
    lines = columns.pop(LINE).astype(np.int64)
    return CsvTable(columns, lines, cast("dict[str, int]", last)["origin_s"])


def csv_parts(
    path: Path, names: Sequence[Any], largest_mb: int, mapped: tuple[dict[str, Any], int] | None, origin_s: int | None
) -> Iterator[Part]:
    """Yield the parts that `read_table` reads; `names` are fields of a header, `mapped` those of a map.

    The rows come in blocks, with the line of each as an additional column; `origin_s` comes last.
    """
    return _parts(path, Header(*names), largest_mb, None if mapped is None else Mapped(*mapped), origin_s)


def _parts(path: Path, header: Header, largest_mb: int, mapped: Mapped | None, origin_s: int | None) -> Iterator[Part]:
    skipped = 0 if mapped is None else mapped.skip_lines
    rows = read_rows(path, largest_mb, skipped)
    headings = [name.strip() for name in next(rows, [])]
    _check_headings(path, headings)
    named = dict(enumerate(headings)) if mapped is None else _select_columns(path, headings, header, mapped)
    _check_columns(path, [*named.values()], header.needed, header.one_of, header.optional)
    factors = {} if mapped is None else {name: factor for name, (_, factor) in mapped.columns.items()}
    wanted = _Wanted(path, len(headings), named, tuple(factors.get(name, 1.0) for name in named.values()))

    def number_rows() -> Iterator[Sequence[float]]:
        nonlocal origin_s
        has_rows = False
        for line, row in enumerate(rows, start=skipped + 2):
            numbers = () if origin_s != 0 else wanted.plain_numbers(row)
            if not numbers:
                if not any(map(str.strip, row)) or (not has_rows and wanted.names_units(line, row)):
                    continue
                cells = wanted.cells(line, row)
                if origin_s is None:
                    origin_s = wanted.origin_s(cells)
                numbers = wanted.numbers(line, cells, origin_s)
            has_rows = True
            yield line, *numbers

    yield from in_blocks(number_rows(), [LINE, *named.values()])
    yield {"origin_s": origin_s or 0}


@dataclass(frozen=True, slots=True)
class _Wanted:
    """The columns to read from a file: their `names` by index, out of `width`, and their `factors` to SI."""

    path: Path
    width: int
    names: Mapping[int, str]
    factors: tuple[float, ...]

    def plain_numbers(self, row: Sequence[str]) -> Sequence[float]:
        """Return a row's numbers in SI units, quickly; none for a row that needs a closer look."""
        if len(row) != self.width:
            return ()
        try:
            numbers = [float(row[index]) * factor for index, factor in zip(self.names, self.factors, strict=True)]
        except ValueError:
            return ()
        return numbers if all(abs(number) < LARGEST_NUMBER for number in numbers) else ()

    def names_units(self, line: int, row: Sequence[str]) -> bool:
        """Return whether a row below the heading holds units, and no number. Raise Refused `wrong_unit`."""
        if any(map(is_number, row)):
            return False
        cells = [row[index] if index < len(row) else "" for index in self.names]
        if not any(map(unit_of, cells)):
            return False
        if (wrong := find_wrong_unit(cells, self.factors)) is not None:
            name = [*self.names.values()][wrong]
            raise Refused(
                "wrong_unit",
                f"{self.path}, line {line} says that {name} is in {quote(cells[wrong])}, which it is not read as",
                "Say its unit with --columns, or convert it to the one in the name",
            )
        return True

    def cells(self, line: int, row: Sequence[str]) -> list[str]:
        """Return the cells to read, blank if the row ends too early. Raise Refused `wrong_columns`."""
        if any(map(str.strip, row[self.width :])):
            raise Refused(
                "wrong_columns",
                f"{self.path}, line {line} has {len(row)} cells, and the heading names {self.width} columns: "
                "nobody can say which cell is what",
                "Write a name for every column into the heading (col.names=NA in R's write.table), or a decimal point "
                "where a comma divides the columns",
            )
        return [row[index] if index < len(row) else "" for index in self.names]

    def origin_s(self, cells: Sequence[str]) -> int:
        """Return the seconds from which times are to count, by the first row; 0 if it holds no time."""
        timed = [index for index, name in enumerate(self.names.values()) if name in TIMES and is_number(cells[index])]
        return origin_of(float(cells[index]) * self.factors[index] for index in timed)

    def numbers(self, line: int, cells: Sequence[str], origin_s: int) -> list[float]:
        """Return a row's numbers in SI units, NaN for a blank cell. Raise Refused `not_a_number`."""
        try:
            numbers = [
                since(cell, factor, origin_s)
                if origin_s and name in TIMES and cell.strip()
                else float(cell) * factor
                if cell.strip()
                else BLANK
                for cell, factor, name in zip(cells, self.factors, self.names.values(), strict=True)
            ]
        except (ValueError, ArithmeticError):
            numbers = []
        right = [abs(number) < LARGEST_NUMBER or not cell.strip() for number, cell in zip(numbers, cells, strict=False)]
        if len(right) < len(cells) or not all(right):
            raise Refused(
                "not_a_number",
                f"{self.path}, line {line}: {quote(','.join(cells))} is not {len(cells)} numbers below "
                f"{LARGEST_NUMBER:g}",
                "Write plain decimal numbers with a point, no NaN, one for each column",
            )
        return numbers


def _select_columns(path: Path, headings: Sequence[str], header: Header, mapped: Mapped) -> dict[int, str]:
    """Return the rig's names of the columns to read, by their indices. Raise Refused `wrong_columns`."""
    mapped_names: dict[int, str] = {}
    for name, (column, _) in mapped.columns.items():
        if headings.count(column) != 1:
            how = "twice" if column in headings else "nowhere"
            raise Refused(
                "wrong_columns",
                f"{path} has the column {quote(column)} {how}, which is to be {name}",
                f"Name one of its columns: {shorten(', '.join(headings))}; or say how many lines stand before them",
            )
        mapped_names[headings.index(column)] = name
    own_names = (*header.needed, *header.one_of, *(name for group in header.optional for name in group))
    unmapped_names = {
        index: name for index, name in enumerate(headings) if name in own_names and name not in mapped.columns
    }
    return {**unmapped_names, **mapped_names}


def _check_headings(path: Path, headings: Sequence[str]) -> None:
    """Raise Refused `wrong_columns` for a first row that cannot be one of names."""
    what = None
    if len(headings) == 1 and len(headings[0].split()) > 1:
        what = f"divides its columns neither by commas nor by semicolons nor by tabs: {shorten(headings[0])}"
    elif headings and all(map(is_number, headings)):
        what = f"has numbers in its first row and no names of columns: {shorten(', '.join(headings))}"
    if what is not None:
        raise Refused(
            "wrong_columns",
            f"{path} {what}",
            "Write the columns' names into the first row, divided as all rows are, by commas, semicolons or tabs; "
            "or say with --columns how many lines stand before it",
        )


def _check_columns(
    path: Path,
    names: Sequence[str],
    columns: Sequence[str],
    alternatives: Sequence[str],
    optional: Sequence[Sequence[str]],
) -> None:
    own_names = (*columns, *alternatives, *(name for group in optional for name in group))
    for name in names:
        alike = [column for column in own_names if _quantity(column) == _quantity(name) and column not in names]
        meant = [column for column in alike if column in columns] or alike
        if name not in own_names and "_" in name and meant and not name.startswith("axis"):
            raise Refused(
                "wrong_unit",
                f"{path} has a column {shorten(name)} where {' or '.join(meant)} belongs",
                f"Convert it to the unit in the name {' or '.join(meant)}, or say its unit with --columns",
            )
    needed = [*columns, *(name for group in optional if set(group) & set(names) for name in group)]
    problems = [f"lacks {name}" for name in needed if name not in names]
    problems += [f"names {name} twice" for name in own_names if names.count(name) > 1]
    present = [name for name in names if name in alternatives]
    if alternatives and len(set(present)) != 1:
        problems.append(f"has {' and '.join(present) or 'none'} of {', '.join(alternatives)}")
    if "" in names:
        problems.append("has a column without a name")
    unknown = ", ".join(name for name in names if name and name not in own_names)
    if unknown:
        problems.append(f"has the unknown {shorten(unknown)}")
    if problems:
        wanted = ", ".join(columns) + (f" and one of {', '.join(alternatives)}" if alternatives else "")
        more = "".join(f"; {', '.join(group)} may stand there too" for group in optional)
        remedy = f"Its first row must name {wanted}{more}; or say with --columns which of its columns is what"
        raise Refused("wrong_columns", f"{path} {', '.join(problems)}", remedy)


def _quantity(name: str) -> str:
    """Return the quantity in a column's name: `rate_x` of `rate_x_rad_s`, `x` of `x_rad_s`."""
    words = name.split("_")
    return "_".join(words[:2]) if words[0] == "rate" else words[0]
