"""A list of parts that are run without questions."""

import csv
from collections.abc import Sequence
from pathlib import Path

from rig.config.files.regular_file import UnfitFile, read_regular_file
from rig.errors import Refused

MAX_BYTES = 1_000_000
HEADING = "serial_number"


def numbers_in(path: Path) -> tuple[str, ...]:
    """Return a CSV file's column `serial_number`, or else its first column. Raise Refused `parts_file`."""
    try:
        text = read_regular_file(path, MAX_BYTES).decode("utf-8-sig")
        rows = [row for row in csv.reader(text.splitlines()) if any(cell.strip() for cell in row)]
    except (OSError, UnfitFile, UnicodeDecodeError, csv.Error) as error:
        raise _unfit(path, str(error)) from error
    column = 0
    if rows and HEADING in (titles := [cell.strip() for cell in rows[0]]):
        column, rows = titles.index(HEADING), rows[1:]
    numbers = tuple(row[column].strip() for row in rows if len(row) > column)
    if not numbers or not all(numbers) or len(numbers) < len(rows):
        raise _unfit(path, "a line has no serial number" if rows else "it has no line")
    return numbers


def _unfit(path: Path, why: str) -> Refused:
    return Refused(
        "parts_file",
        f"the parts cannot be read from {path}: {why}",
        f"Write a CSV file with one serial number a line, or with a column {HEADING}",
    )


def next_serial_number(numbers: Sequence[str], done: Sequence[str]) -> str | None:
    """Return the first serial number that is not done yet; None if all are done. Raise Refused `another_series`."""
    if tuple(done) != tuple(numbers[: len(done)]):
        raise Refused(
            "another_series",
            f"the batch has run {', '.join(done)}, but the list begins differently",
            "Give the list that the batch began with, or another folder with --out",
        )
    return numbers[len(done)] if len(done) < len(numbers) else None
