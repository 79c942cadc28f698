"""MATLAB's files (`.mat`) as tables: each column of a variable, or of a struct's field, is a column of the table.

Columns have the names that they have in MATLAB: `t` of a vector, `gyro(:,2)` of a matrix, `imu.gyro(:,2)` of a struct.
SciPy reads versions 4 to 7, h5py version 7.3. They run in a separate process, and read numbers only: no object, no
function, no link to another file.
"""

import math
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np

from rig.data.recording.motion_file import Header
from rig.errors import Refused
from rig.errors.quoting import list_first, quote, shorten
from rig.estimation.arrays import Array
from rig.observation.formats.column_selection import MappedColumns

SUFFIX = ".mat"
HDF5_HEADER = b"MATLAB 7.3"
HEAD_BYTES = 128  # of a binary file: they contain zeros, unless they say which version of MATLAB wrote them
MAX_DEPTH = 4  # of structs inside structs
MAX_COLUMNS = 1000
NAN = "NaN"  # as MATLAB spells it
BLOCK_ROWS = 8192  # rows whose cells are in memory at a time
OBJECT_FIELDS = ("s0", "s1", "s2", "arr")  # fields by which SciPy represents a MATLAB object


def is_mat(path: Path) -> bool:
    """Return whether a path has the suffix of MATLAB files, unless it is the text that `save -ascii` writes."""
    if path.suffix.lower() != SUFFIX:
        return False
    if not path.is_file():
        return True  # whoever reads it says why it cannot be read
    with path.open("rb") as file:
        head = file.read(HEAD_BYTES)
    return head.startswith(b"MATLAB") or b"\0" in head or not head.isascii()


def read_mat_rows(path: Path, header: Header, mapped: MappedColumns | None) -> Iterator[list[str]]:
    """Yield the names of all columns of a file, then its rows, in which cells of unneeded columns are blank.

    The needed columns are those in the map or with the rig's names. NaN is written as the map spells missing values.
    Raise Refused `wrong_columns` if the columns differ in length, and any error of the parser for a damaged file.
    """
    columns = read_mat_columns(path)
    names = [*columns]
    yield names
    usual = {*header.names}
    if mapped is not None:
        in_map = [column for column, _ in mapped.columns.values()]
        usual |= {*in_map, *(names[int(column) - 1] for column in in_map if _is_number_of(column, names))}
    wanted = [name for name in names if name in usual]
    for first, second in pairwise(wanted):
        if len(columns[first]) != len(columns[second]):
            raise Refused(
                "wrong_columns",
                f"{path}: {quote(first)} has {len(columns[first])} rows, and {quote(second)} {len(columns[second])}",
                "Name columns of one table, with one time",
            )
    missing = () if mapped is None else mapped.missing
    nan = next((text for text in missing if text.upper() == NAN.upper()), NAN)
    count = len(columns[wanted[0]]) if wanted else 0
    for start in range(0, count, BLOCK_ROWS):
        block = slice(start, start + BLOCK_ROWS)
        blank = [""] * (min(count, start + BLOCK_ROWS) - start)
        cells = [spell_numbers(columns[name][block], nan) if name in wanted else blank for name in names]
        yield from map(list, zip(*cells, strict=True))


def spell_numbers(numbers: Array, nan: str = NAN) -> list[str]:
    """Return the cells of a column of numbers, with `nan` for NaN."""
    return [nan if math.isnan(number) else repr(number) for number in numbers.tolist()]


def _is_number_of(column: str, names: list[str]) -> bool:
    return column.isdecimal() and column not in names and 1 <= int(column) <= len(names)


def read_mat_columns(path: Path) -> dict[str, Array]:
    """Return all columns of numbers in a file, by name. Raise Refused `wrong_columns` if there are no numbers."""
    with path.open("rb") as file:
        is_hdf5 = file.read(len(HDF5_HEADER)) == HDF5_HEADER
    objects: list[str] = []
    columns: dict[str, Array] = {}
    for name, values in _read_hdf5(path, objects) if is_hdf5 else _read_classic(path, objects):
        for column, numbers in _split(name, values):
            columns[column] = numbers
            if len(columns) > MAX_COLUMNS:
                raise ValueError(f"it holds more than {MAX_COLUMNS} columns")
    if not columns:
        what = (
            f"holds numbers only in objects, which only MATLAB can read: {list_first(map(shorten, objects))}"
            if objects
            else "holds no numbers"
        )
        raise Refused(
            "wrong_columns",
            f"{path} {what}",
            "Save plain matrices, or write tables from MATLAB: writetimetable(T, 'log.csv'), writetable(T, 'log.csv')",
        )
    return columns


def _split(name: str, values: Array) -> Iterator[tuple[str, Array]]:
    """Yield the columns of a matrix, or its rows if it is wider than high, by MATLAB's names."""
    if min(values.shape) == 1:
        yield name, values.ravel()
    elif values.shape[0] >= values.shape[1]:
        yield from ((f"{name}(:,{index + 1})", values[:, index]) for index in range(values.shape[1]))
    else:
        yield from ((f"{name}({index + 1},:)", values[index]) for index in range(values.shape[0]))


def _read_classic(path: Path, objects: list[str]) -> Iterator[tuple[str, Array]]:
    """Yield the matrices (r, c) of a file of version 4 to 7. Append the names of all objects to a list."""
    from scipy.io import loadmat

    contents: dict[str, Any] = loadmat(str(path), appendmat=False)
    for name, value in contents.items():
        if not name.startswith("__"):
            yield from _find_matrices(name, value, objects)


def _find_matrices(name: str, value: Any, objects: list[str], depth: int = 0) -> Iterator[tuple[str, Array]]:
    """Yield the numeric matrices in a variable by name; add the names of unreadable objects to `objects`."""
    fields = value.dtype.names if isinstance(value, np.ndarray) else None
    if fields is None:
        if isinstance(value, np.ndarray) and value.dtype.kind in "fiub" and value.ndim == 2 and value.size > 1:
            yield name, value.astype(np.float64)
    elif fields == OBJECT_FIELDS:
        objects.append(str(value["s0"].flat[0].decode()) if name == "None" else name)
    elif value.size == 1 and depth < MAX_DEPTH:
        for field in fields:
            yield from _find_matrices(f"{name}.{field}", value[field].flat[0], objects, depth + 1)


def _read_hdf5(path: Path, objects: list[str]) -> Iterator[tuple[str, Array]]:
    """Yield the matrices (r, c) of a file of version 7.3. Append the names of all objects to a list."""
    import h5py

    with h5py.File(path, "r") as file:
        yield from _walk_group(file, "", objects)


def _walk_group(group: Any, prefix: str, objects: list[str], depth: int = 0) -> Iterator[tuple[str, Array]]:
    """Yield the numeric matrices in an HDF5 group by name; add the names of unreadable objects to `objects`."""
    import h5py

    for name in group:
        if name.startswith("#") or not isinstance(group.get(name, getlink=True), h5py.HardLink):
            continue
        member, full_name = group[name], f"{prefix}{name}"
        if "MATLAB_object_decode" in member.attrs:
            objects.append(full_name)
        elif isinstance(member, h5py.Group):
            if depth < MAX_DEPTH:
                yield from _walk_group(member, f"{full_name}.", objects, depth + 1)
        elif (
            isinstance(member, h5py.Dataset)
            and member.dtype.kind in "fiub"
            and member.ndim == 2
            and (member.size or 0) > 1
            and not member.external
            and not member.is_virtual
            and member.attrs.get("MATLAB_class", b"double") not in (b"char", b"cell")
        ):
            yield full_name, np.asarray(member[()], dtype=np.float64).T
