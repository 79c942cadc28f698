"""The output of a reading process for columns of numbers: rows in blocks, then the names of the columns."""

from array import array
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, cast

import numpy as np

from rig.config.files.regular_file import UnfitFile
from rig.data.processes.reading_parts import Part
from rig.data.processes.reading_process import CostlyFile, UnreadableFile, limits_for, read_apart, stored_bytes
from rig.errors import Refused
from rig.estimation.arrays import Array

BLOCK_ROWS = 16_384


LEFT_OUT = "left_out"  # number of rows of the file that contain none of the columns
NOTE = "note"  # what the readings lack, in words


def read_blocks(
    rows: Iterable[Sequence[float]], columns: Sequence[str | None], counts: Mapping[str, Any] | None = None
) -> Iterator[Part]:
    """Yield rows, with a number for each column, in blocks (n, columns), then the names of the columns.

    The names are read after the last row, because until then the reader may replace a name by None to omit the column.
    `counts` is added to the names in the last part: the number of `LEFT_OUT` rows, and a `NOTE`.
    """
    values, width = array("d"), len(columns)
    for row in rows:
        values.extend(row)
        if len(values) >= BLOCK_ROWS * width:
            yield np.array(values).reshape(-1, width)
            del values[:]
    yield np.array(values).reshape(-1, width)
    yield {"columns": list(columns), **(counts or {})}


def columns_of(parts: Iterable[Part]) -> dict[str, Array]:
    """Join the parts of a table; return its columns (n,) by name."""
    *blocks, last = parts
    arrays, names = cast("list[Array]", blocks), cast("dict[str, Any]", last)["columns"]
    return {
        name: np.concatenate([block[:, index] for block in arrays])
        for index, name in enumerate(names)
        if name is not None
    }


def count_omitted_rows(parts: Sequence[Part]) -> int:
    """Return the number of rows of the file that `parts` leave out."""
    return int(cast("dict[str, Any]", parts[-1]).get(LEFT_OUT, 0))


def note_of(parts: Sequence[Part]) -> str:
    """Return a note on what the readings in `parts` lack; "" if nothing is missing."""
    return str(cast("dict[str, Any]", parts[-1]).get(NOTE, ""))


def parts_read_apart(reader: str, path: Path, arguments: Mapping[str, Any], *, else_: str, remedy: str) -> list[Part]:
    """Return the parts of a file that a `reader` ("module:function") yields in a process of its own.

    Raise Refused: any that the reader raises; `temporary_folder_full`; `file_too_costly` if the process exceeds its
    limits; `no_file` for any other failure. Messages of the last two are the path, `else_` and the cause.
    """
    try:
        return read_apart(reader, path, arguments, limits_for(stored_bytes(path)))
    except CostlyFile as error:
        raise Refused("file_too_costly", f"{path} {else_}: {error}", remedy) from error
    except (UnreadableFile, UnfitFile) as error:
        raise Refused("no_file", f"{path} {else_}: {error}", remedy) from error
    except OSError as error:
        raise Refused("no_file", f"{path} {else_}: {error.strerror or error}", remedy) from error
