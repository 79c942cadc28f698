"""Columns of numbers from a CSV file that somebody else wrote: within bounds, or refused by name."""

import csv
from array import array
from collections.abc import Iterator, Sequence
from io import TextIOWrapper
from itertools import chain
from pathlib import Path

import numpy as np

from rig.config.regular_file import UnfitFile, open_regular_file
from rig.data.motion_file import LARGEST_NUMBER, Header
from rig.errors import Refused
from rig.errors.quoting import quote, shorten
from rig.estimation.arrays import Array

LONGEST_LINE = 10_000  # characters: of a hundred columns, where there are at most twenty


def read_columns(path: Path, header: Header, largest_mb: int) -> dict[str, Array]:
    """The columns of a file by name, those of its header; of each group of optional ones all, or none.

    The first row holds the names. If it divides them by semicolons, as spreadsheets do where decimals have a comma, all
    rows do. Raises Refused `no_file`, `wrong_columns`, `wrong_unit`, `not_a_number`.
    """
    rows = _rows(path, largest_mb)
    names = [name.strip() for name in next(rows, [])]
    _check_columns(path, names, header.needed, header.one_of, header.optional)
    values = array("d")
    for line, row in enumerate(rows, start=2):
        numbers = _numbers(row)
        if len(numbers) != len(names):
            raise Refused(
                "not_a_number",
                f"{path}, line {line}: {quote(','.join(row))} is not {len(names)} numbers below {LARGEST_NUMBER:g}",
                "Write plain decimal numbers with a point, no NaN, one for each column",
            )
        values.extend(numbers)
    table = np.array(values, dtype=np.float64).reshape(-1, len(names))
    return {name: table[:, i] for i, name in enumerate(names)}


def _rows(path: Path, largest_mb: int) -> Iterator[list[str]]:
    """The rows of a regular file that is not too large."""
    try:
        with (
            open_regular_file(path, largest_mb * 1_000_000) as file,
            TextIOWrapper(file, encoding="utf-8-sig", newline="") as text,
        ):
            lines = _lines(text)
            first = next(lines, "")
            if ";" in first and "," not in first:
                for row in csv.reader(chain([first], lines), delimiter=";"):
                    yield [cell.replace(",", ".") for cell in row]
            else:
                yield from csv.reader(chain([first], lines))
    except (UnfitFile, OSError, ValueError, csv.Error) as error:
        raise _unreadable(path, str(error)) from error


def _lines(text: TextIOWrapper) -> Iterator[str]:
    """The lines, none of which is endless."""
    while line := text.readline(LONGEST_LINE):
        if len(line) == LONGEST_LINE:
            raise UnfitFile(f"a line is longer than {LONGEST_LINE} characters")
        yield line


def _unreadable(path: Path, why: str) -> Refused:
    return Refused("no_file", f"{path} cannot be read: {why}", "Give a CSV file")


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
                f"Convert it to the unit in the name {' or '.join(meant)}",
            )
    needed = [*columns, *(name for group in optional if set(group) & set(names) for name in group)]
    problems = [f"lacks {name}" for name in needed if name not in names]
    problems += [f"names {name} twice" for name in known if names.count(name) > 1]
    given = [name for name in names if name in alternatives]
    if alternatives and len(set(given)) != 1:
        problems.append(f"has {' and '.join(given) or 'none'} of {', '.join(alternatives)}")
    unknown = ", ".join(name for name in names if name not in known)
    if unknown:
        problems.append(f"has the unknown {shorten(unknown)}")
    if problems:
        wanted = ", ".join(columns) + (f" and one of {', '.join(alternatives)}" if alternatives else "")
        more = "".join(f"; {', '.join(group)} may stand there too" for group in optional)
        raise Refused("wrong_columns", f"{path} {', '.join(problems)}", f"Its first row must name {wanted}{more}")


def _quantity(name: str) -> str:
    """What a column is of: `rate_x` of `rate_x_rad_s`, `x` of `x_rad_s`."""
    words = name.split("_")
    return "_".join(words[:2]) if words[0] == "rate" else words[0]
