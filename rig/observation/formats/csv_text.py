"""The rows of cells in another program's text file, packed or not, in any encoding, of limited size."""

import codecs
import csv
import os
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from gzip import GzipFile
from io import TextIOWrapper
from itertools import chain, islice
from pathlib import Path
from typing import BinaryIO

from rig.config.files.regular_file import UnfitFile, open_regular_file
from rig.errors import Refused
from rig.observation.formats.csv_cells import HEADING_MARKS, is_value

MAX_HARMLESS_BYTES = 1_000_000  # some ten thousand rows, which take four times as much memory
MAX_LINE = 10_000  # characters: enough for a hundred columns, of which there are at most twenty
ARDUPILOT = b"\xa3\x95"  # the beginning of each message of a DataFlash log
GZIP, UTF_16 = b"\x1f\x8b", (codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE)
SEPARATORS = ";\t"


def read_rows(path: Path, largest_mb: int, skipped: int = 0) -> Iterator[list[str]]:
    """Yield the rows of a regular file of limited size, after `skipped` lines. Raise Refused `no_file`."""
    with _raise_no_file(path), open_regular_file(path, largest_mb * 1_000_000) as file, _text(file) as text:
        lines = _lines(text, largest_mb * 1_000_000)
        first = next(islice(lines, skipped, None), "")
        second = next(lines, "")
        first = first.lstrip(f"{HEADING_MARKS} ") or first
        other = next((mark for mark in SEPARATORS if mark in first and (mark in second or "," not in first)), None)
        if other is None and is_divided_by_spaces(second):
            yield from (split_at_spaces(line) for line in chain([first, second], lines))
            return
        for number, row in enumerate(csv.reader(chain([first, second], lines), delimiter=other or ",")):
            values = [cell.replace(",", ".") for cell in row] if other else row  # decimal commas
            is_heading = number == 0 and not all(map(is_value, values))
            yield row if is_heading else values


def is_divided_by_spaces(line: str) -> bool:
    """Return whether a line of readings holds values separated by spaces alone."""
    cells = split_at_spaces(line)
    return len(cells) > 1 and not any(mark in line for mark in f"{SEPARATORS},") and all(map(is_value, cells))


def split_at_spaces(line: str) -> list[str]:
    """Return the cells of a line that is divided by spaces, without the quotes that R writes around names."""
    return [cell.strip('"') for cell in line.split()]


def is_harmless(path: Path, largest_mb: int) -> bool:
    """Return whether a file is short and not packed. Raise Refused `no_file`, also if it is too large."""
    with _raise_no_file(path), open_regular_file(path, largest_mb * 1_000_000) as file:
        return os.fstat(file.fileno()).st_size <= MAX_HARMLESS_BYTES and not _read_beginning(file).startswith(GZIP)


@contextmanager
def _raise_no_file(path: Path) -> Iterator[None]:
    """Raise Refused `no_file` instead of any error in the `with` block, which reads a file."""
    try:
        yield
    except (UnfitFile, OSError, EOFError, zlib.error, ValueError, csv.Error) as error:
        why = getattr(error, "strerror", None) or error
        raise Refused("no_file", f"{path} cannot be read: {why}", "Give a CSV file") from error


def _text(file: BinaryIO | GzipFile) -> TextIOWrapper:
    """Return a file's text, unpacked, in the encoding that its beginning shows.

    Raise UnfitFile if it is not text. A text that does not begin in UTF-8 is read in the Windows encoding. Damaged
    characters after the beginning are replaced; the row that contains them is refused, with its line number.
    """
    if _read_beginning(file).startswith(GZIP):
        file = GzipFile(fileobj=file)
    begin = _read_beginning(file)
    if begin.startswith(UTF_16):
        return TextIOWrapper(file, encoding="utf-16", errors="replace", newline="")
    if begin.startswith(ARDUPILOT):
        raise UnfitFile(
            "it is a log of ArduPilot, whose IMU messages `mavlogdump.py --types IMU --format csv` writes as CSV"
        )
    if b"\0" in begin:
        raise UnfitFile("it is not text but a spreadsheet, an archive or another program's own file")
    try:
        codecs.getincrementaldecoder("utf-8")().decode(begin)
    except UnicodeDecodeError:
        return TextIOWrapper(file, encoding="cp1252", errors="replace", newline="")
    return TextIOWrapper(file, encoding="utf-8-sig", errors="replace", newline="")


def _read_beginning(file: BinaryIO | GzipFile) -> bytes:
    begin = file.read(MAX_LINE)
    file.seek(0)
    return begin


def _lines(text: TextIOWrapper, most: int) -> Iterator[str]:
    """Yield the lines, at most `most` characters in all, because a packed file may hold a thousand times its size."""
    while line := text.readline(MAX_LINE):
        most -= len(line)
        if len(line) == MAX_LINE:
            raise UnfitFile(f"a line is longer than {MAX_LINE} characters")
        if most < 0:
            raise UnfitFile("its unpacked content is too long")
        yield line
