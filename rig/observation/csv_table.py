"""Columns of numbers from a CSV file that somebody else wrote: within bounds, or refused by name."""

import csv
from array import array
from collections.abc import Iterator, Sequence
from io import TextIOWrapper
from pathlib import Path

import numpy as np

from rig.config.regular_file import UnfitFile, open_regular_file
from rig.errors import Refused
from rig.errors.quoting import quote, shorten
from rig.estimation.arrays import Array

LARGEST_NUMBER = 1e12  # either sign, in any SI unit: what is beyond is a mistake, and its square might overflow


def read_columns(path: Path, columns: Sequence[str], alternatives: Sequence[str], largest_mb: int) -> dict[str, Array]:
    """The columns of a file by name: all of `columns`, and exactly one of `alternatives` if there are any.

    The first row holds the names. Raises Refused `no_file`, `wrong_columns`, `wrong_unit`, `not_a_number`.
    """
    rows = _rows(path, largest_mb)
    names = [name.strip() for name in next(rows, [])]
    _check_columns(path, names, columns, alternatives)
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
            yield from csv.reader(text)
    except (UnfitFile, OSError, ValueError, csv.Error) as error:
        raise _unreadable(path, str(error)) from error


def _unreadable(path: Path, why: str) -> Refused:
    return Refused("no_file", f"{path} cannot be read: {why}", "Give a CSV file")


def _numbers(row: Sequence[str]) -> list[float]:
    """A row's numbers; empty if any of its cells is none, or is too large to be one."""
    try:
        numbers = [float(cell) for cell in row]
    except ValueError:
        return []
    return numbers if all(abs(number) < LARGEST_NUMBER for number in numbers) else []


def _check_columns(path: Path, names: Sequence[str], columns: Sequence[str], alternatives: Sequence[str]) -> None:
    known = (*columns, *alternatives)
    by_quantity = {name.split("_")[0]: name for name in known if not name.startswith("axis")}
    for name in names:
        meant = by_quantity.get(name.split("_")[0], name)
        if name not in known and meant not in (name, *names):
            raise Refused(
                "wrong_unit",
                f"{path} has a column {shorten(name)} where {meant} belongs",
                f"Convert it to the unit that the name {meant} carries",
            )
    problems = [f"lacks {name}" for name in columns if name not in names]
    problems += [f"names {name} twice" for name in known if names.count(name) > 1]
    given = [name for name in names if name in alternatives]
    if alternatives and len(set(given)) != 1:
        problems.append(f"has {' and '.join(given) or 'none'} of {', '.join(alternatives)}")
    unknown = ", ".join(name for name in names if name not in known)
    if unknown:
        problems.append(f"has the unknown {shorten(unknown)}")
    if problems:
        wanted = ", ".join(columns) + (f" and one of {', '.join(alternatives)}" if alternatives else "")
        raise Refused("wrong_columns", f"{path} {', '.join(problems)}", f"Its first row must name {wanted}")
