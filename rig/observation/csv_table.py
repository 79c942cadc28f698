"""Columns of numbers from a CSV file that somebody else wrote: within bounds, or refused by name."""

import codecs
import csv
import zlib
from array import array
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from gzip import GzipFile
from io import TextIOWrapper
from itertools import chain, islice
from pathlib import Path
from typing import BinaryIO

import numpy as np

from rig.config.regular_file import UnfitFile, open_regular_file
from rig.data.motion_file import LARGEST_NUMBER, Header
from rig.errors import Refused
from rig.errors.quoting import quote, shorten
from rig.estimation.arrays import Array

LONGEST_LINE = 10_000  # characters: of a hundred columns, where there are at most twenty
GZIP, UTF_16 = b"\x1f\x8b", (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)
MARKS = ";\t"


@dataclass(frozen=True, slots=True)
class Mapped:
    """Where a file of somebody else's has what: by the name of a column here, its name there and the factor to SI.

    `skip_lines` stand before the heading.
    """

    columns: Mapping[str, tuple[str, float]]
    skip_lines: int = 0


def read_columns(path: Path, header: Header, largest_mb: int, mapped: Mapped | None = None) -> dict[str, Array]:
    """The columns of a file by name, those of its header; of each group of optional ones all, or none.

    The first row holds the names. If it divides them by semicolons, as spreadsheets do where decimals have a comma, or
    by tabs, all rows do; empty rows are none. Of a `mapped` file the columns that are named so or as here, whatever
    others it has. A file that gzip has packed is read as what it holds.
    Raises Refused `no_file`, `wrong_columns`, `wrong_unit`, `not_a_number`.
    """
    skipped = 0 if mapped is None else mapped.skip_lines
    rows = _rows(path, largest_mb, skipped)
    headings = [name.strip() for name in next(rows, [])]
    _check_headings(path, headings)
    named = dict(enumerate(headings)) if mapped is None else _picked(path, headings, header, mapped)
    names, places = [*named.values()], [*named]
    _check_columns(path, names, header.needed, header.one_of, header.optional)
    values = array("d")
    for line, row in enumerate(rows, start=skipped + 2):
        if not row:
            continue
        cells = row if mapped is None else [row[place] for place in places if place < len(row)]
        numbers = _numbers(cells)
        if len(numbers) != len(names):
            raise Refused(
                "not_a_number",
                f"{path}, line {line}: {quote(','.join(cells))} is not {len(names)} numbers below {LARGEST_NUMBER:g}",
                "Write plain decimal numbers with a point, no NaN, one for each column",
            )
        values.extend(numbers)
    table = np.array(values, dtype=np.float64).reshape(-1, len(names))
    factors = {} if mapped is None else {name: factor for name, (_, factor) in mapped.columns.items()}
    return {name: factors.get(name, 1.0) * table[:, i] for i, name in enumerate(names)}


def _picked(path: Path, headings: Sequence[str], header: Header, mapped: Mapped) -> dict[int, str]:
    """Which columns are read, by their places, and their names here. Raises Refused `wrong_columns`."""
    found: dict[int, str] = {}
    for name, (there, _) in mapped.columns.items():
        if headings.count(there) != 1:
            how = "twice" if there in headings else "nowhere"
            raise Refused(
                "wrong_columns",
                f"{path} has the column {quote(there)} {how}, which is to be {name}",
                f"Name one of its columns: {shorten(', '.join(headings))}; or say how many lines stand before them",
            )
        found[headings.index(there)] = name
    known = (*header.needed, *header.one_of, *(name for group in header.optional for name in group))
    as_here = {place: name for place, name in enumerate(headings) if name in known and name not in mapped.columns}
    return {**as_here, **found}


def _rows(path: Path, largest_mb: int, skipped: int = 0) -> Iterator[list[str]]:
    """The rows of a regular file that is not too large, after so many lines of it."""
    try:
        with open_regular_file(path, largest_mb * 1_000_000) as file, _text(file) as text:
            lines = _lines(text, largest_mb * 1_000_000)
            first = next(islice(lines, skipped, None), "")
            second = next(lines, "")
            delimiter = next((mark for mark in MARKS if mark in first and (mark in second or "," not in first)), None)
            rows = csv.reader(chain([first, second], lines), delimiter=delimiter or ",")
            yield from islice(rows, 1)
            for row in rows:
                yield row if delimiter is None else [cell.replace(",", ".") for cell in row]
    except (UnfitFile, OSError, EOFError, zlib.error, ValueError, csv.Error) as error:
        raise Refused("no_file", f"{path} cannot be read: {error}", "Give a CSV file") from error


def _text(file: BinaryIO) -> TextIOWrapper:
    """What stands in a file, packed or not, in the encoding its beginning shows. Raises UnfitFile where it is no text.

    Windows' own encoding is that of most loggers' headings that are not in UTF-8: "°/s", "µT".
    """
    if _beginning(file).startswith(GZIP):
        file = GzipFile(fileobj=file)  # type: ignore[assignment]
    begin = _beginning(file)
    if begin.startswith(UTF_16):
        return TextIOWrapper(file, encoding="utf-16", newline="")
    if b"\0" in begin:
        raise UnfitFile("it is no text, but a spreadsheet, an archive or another program's own file")
    try:
        codecs.getincrementaldecoder("utf-8")().decode(begin)
    except UnicodeDecodeError:
        return TextIOWrapper(file, encoding="cp1252", errors="replace", newline="")
    return TextIOWrapper(file, encoding="utf-8-sig", newline="")


def _beginning(file: BinaryIO) -> bytes:
    begin = file.read(LONGEST_LINE)
    file.seek(0)
    return begin


def _lines(text: TextIOWrapper, most: int) -> Iterator[str]:
    """The lines, none of which is endless, nor all of them: a packed file may hold a thousand times its size."""
    while line := text.readline(LONGEST_LINE):
        most -= len(line)
        if len(line) == LONGEST_LINE:
            raise UnfitFile(f"a line is longer than {LONGEST_LINE} characters")
        if most < 0:
            raise UnfitFile("what is packed in it is too long")
        yield line


def _check_headings(path: Path, headings: Sequence[str]) -> None:
    """Raises Refused `wrong_columns` for a first row that cannot be one of names."""
    what = None
    if len(headings) == 1 and len(headings[0].split()) > 1:
        what = f"divides its columns neither by commas nor by semicolons nor by tabs: {shorten(headings[0])}"
    elif headings and _numbers(headings):
        what = f"has numbers in its first row and no names of columns: {shorten(', '.join(headings))}"
    if what is not None:
        raise Refused(
            "wrong_columns",
            f"{path} {what}",
            "Write the columns' names into the first row, divided as all rows are, by commas, semicolons or tabs; "
            "or say with --columns how many lines stand before it",
        )


def _numbers(row: Sequence[str]) -> list[float]:
    """A row's numbers; empty if any of its cells is none, or is too large to be one."""
    try:
        numbers = [float(cell) for cell in row]
    except ValueError:
        return []
    return numbers if all(abs(number) < LARGEST_NUMBER for number in numbers) else []


def _check_columns(
    path: Path,
    names: Sequence[str],
    columns: Sequence[str],
    alternatives: Sequence[str],
    optional: Sequence[Sequence[str]],
) -> None:
    known = (*columns, *alternatives, *(name for group in optional for name in group))
    for name in names:
        alike = [each for each in known if _quantity(each) == _quantity(name) and each not in names]
        meant = [each for each in alike if each in columns] or alike
        if name not in known and "_" in name and meant and not name.startswith("axis"):
            raise Refused(
                "wrong_unit",
                f"{path} has a column {shorten(name)} where {' or '.join(meant)} belongs",
                f"Convert it to the unit in the name {' or '.join(meant)}, or say its unit with --columns",
            )
    needed = [*columns, *(name for group in optional if set(group) & set(names) for name in group)]
    problems = [f"lacks {name}" for name in needed if name not in names]
    problems += [f"names {name} twice" for name in known if names.count(name) > 1]
    given = [name for name in names if name in alternatives]
    if alternatives and len(set(given)) != 1:
        problems.append(f"has {' and '.join(given) or 'none'} of {', '.join(alternatives)}")
    if "" in names:
        problems.append("has a column without a name")
    unknown = ", ".join(name for name in names if name and name not in known)
    if unknown:
        problems.append(f"has the unknown {shorten(unknown)}")
    if problems:
        wanted = ", ".join(columns) + (f" and one of {', '.join(alternatives)}" if alternatives else "")
        more = "".join(f"; {', '.join(group)} may stand there too" for group in optional)
        remedy = f"Its first row must name {wanted}{more}; or say with --columns which of its columns is what"
        raise Refused("wrong_columns", f"{path} {', '.join(problems)}", remedy)


def _quantity(name: str) -> str:
    """What a column is of: `rate_x` of `rate_x_rad_s`, `x` of `x_rad_s`."""
    words = name.split("_")
    return "_".join(words[:2]) if words[0] == "rate" else words[0]
