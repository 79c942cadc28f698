"""Extraction of a run file, in a process of its own (`rig.data.processes.reading_process`).

It yields a header (schema, texts, descriptions of the sensors), then the arrays: each sensor's samples, the turner's
states, events, and the tables of external readings. Rows hold plain numbers; the caller checks whether they agree with
the texts, because few modules are loaded here.
"""

import re
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rig.data.processes.reading_process import MAX_UNPACKED_RATIO, size_without_holes
from rig.data.recording.layout_keys import EXTERNAL_SCHEMA, SCHEMA, TABLES, TEXTS
from rig.data.recording.run_reading import MAX_UNWRITTEN_BYTES

WRITING_FLAG = 0x01  # a consistency flag of the superblock
MAX_SENSORS = 64
MAX_COLUMNS = 40  # columns of states: times, joints, and 32 fields
MAX_TEXT_CHARACTERS, MAX_ATTRIBUTE_ELEMENTS = 1_000_000, 1000  # configurations have 65,536 at most
MAX_UNWRITTEN_ROWS = 100_000  # rows that are announced but missing: more than a kill can lose of one flush


def contents(path: Path) -> Iterator[dict[str, Any] | NDArray[Any]]:
    """Yield the contents of a run file, header first. Raise ValueError with the reason, for any error of h5py."""
    try:
        yield from extract(path)
    except Exception as error:  # of any kind: a damaged file may raise anything
        raise ValueError(reason(error)) from error


def extract(path: Path) -> Iterator[dict[str, Any] | NDArray[Any]]:
    """Yield the contents of a run file, header first. Raise OSError, ValueError and any other error of h5py."""
    import h5py

    # A plain open refuses a file whose writer was killed; an SWMR reader trusts one that is cut short, and waits for
    # torn metadata to be completed. So each mode is used for its own kind of file.
    mode = {"libver": "latest", "swmr": True} if _is_left_open(path) else {}
    with h5py.File(path, "r", **mode) as file:
        schema = _text(file, "schema")
        if schema not in TEXTS:
            raise ValueError(f"its schema is {schema!r:.60}; this version of the rig reads {SCHEMA!r}")
        texts = {name: _text(file, name) for name in TEXTS[schema]}
        is_external = schema == EXTERNAL_SCHEMA
        group = dict[str, Any]() if is_external else _member(file, "samples", h5py.Group)
        if len(group) > MAX_SENSORS:
            raise ValueError(f"it announces {len(group)} sensors")
        samples = {name: _member(group, name, h5py.Dataset) for name in group}
        described = {
            name: {key: _convert(value) for key, value in dataset.attrs.items()} for name, dataset in samples.items()
        }
        named = ("states", "events", *(TABLES if is_external else ()))
        rows = {f"samples/{name}": dataset for name, dataset in samples.items()}
        rows |= {name: _member(file, name, h5py.Dataset) for name in named}
        for name, dataset in rows.items():
            _check(dataset, name)
        _refuse_endless(path, sum(int(dataset.nbytes) for dataset in rows.values()))
        yield {"schema": schema, "texts": texts, "described": described}
        for dataset in rows.values():
            yield dataset[:]


def reason(error: Exception) -> str:
    """Return the reason why a file cannot be read, in one line, without HDF5's words around the system's message."""
    if isinstance(error, OSError) and error.filename is not None:
        error = OSError(error.strerror)  # the caller names the file
    text = " ".join(str(error).split())
    if cut := re.search(r"truncated file: eof = (\d+),.* stored_eof = (\d+)", text):
        return f"it is cut short: {cut[1]} of its {cut[2]} bytes are there"
    if "file signature not found" in text:
        return "it is not an HDF5 file"
    if "checksum" in text:
        return f"it is damaged: {text}"
    if isinstance(error, MemoryError) or "filter returned failure" in text or "memory allocation failed" in text:
        return "its rows cannot be unpacked: they are damaged, or more than is stated"
    if "required filter" in text or "filter plugins disabled" in text:
        return "its rows are packed by a filter that is not one of the HDF5 library's own"
    system = re.search(r"error message = '([^']*)'", text)
    return system[1] if system else text or type(error).__name__


def _is_left_open(path: Path) -> bool:
    """Return whether a file is being written, or its writer was killed."""
    with path.open("rb") as file:
        start = file.read(12)
    return len(start) == 12 and start[8] >= 3 and bool(start[11] & WRITING_FLAG)


def _member(group: Any, name: str, kind: type) -> Any:
    """Return a group or dataset of this file. Raise ValueError if it is in another file."""
    import h5py

    if (link := group.get(name, getlink=True)) is None:
        raise ValueError(f"it has no {name}")
    if not isinstance(link, h5py.HardLink):
        raise ValueError(f"{name} is a link to somewhere else")
    member = group[name]
    if not isinstance(member, kind):
        raise ValueError(f"{name} is not a {kind.__name__.lower()}")
    return member


def _check(dataset: Any, name: str) -> None:
    """Raise ValueError unless the dataset holds rows of numbers that the file has space for."""
    # First, because the library opens external files to determine a dataset's shape.
    if dataset.is_virtual or dataset.external:
        raise ValueError(f"the rows of {name} lie somewhere else")
    columns = [dataset.dtype[column] for column in dataset.dtype.names or ()] or [dataset.dtype]
    if dataset.ndim != 1 or len(columns) > MAX_COLUMNS or any(column.base.kind not in "iuf" for column in columns):
        raise ValueError(f"{name} holds {dataset.dtype!s:.200} in {dataset.ndim} dimensions, not rows of numbers")
    stored = _count_stored_rows(dataset)
    if len(dataset) > stored + MAX_UNWRITTEN_ROWS:
        raise ValueError(f"{name} announces {len(dataset)} rows but holds {stored}")


def _refuse_endless(path: Path, unpacked: int) -> None:
    """Raise ValueError if compression or holes let a small file expand beyond the memory."""
    with path.open("rb") as file:
        stored = size_without_holes(file)
    for what, size in (("its rows unpack", unpacked), ("it swells", path.stat().st_size)):
        if size > MAX_UNPACKED_RATIO * stored + MAX_UNWRITTEN_BYTES:
            raise ValueError(f"{what} {stored} bytes to {size}")


def _count_stored_rows(dataset: Any) -> int:
    """Return the largest number of rows for which the file has space."""
    if dataset.chunks is None:
        return int(dataset.id.get_storage_size() // dataset.dtype.itemsize)
    return int(dataset.id.get_num_chunks() * dataset.chunks[0])


def _text(file: Any, name: str) -> str:
    value = _convert(file.attrs.get(name))
    if not isinstance(value, str):
        raise ValueError(f"its {name} is not a text")
    if not value.isascii() and any("\ud800" <= character <= "\udfff" for character in value):
        raise ValueError(f"its {name} is not UTF-8")
    return value


def _convert(value: Any) -> Any:
    """Return an attribute in Python's own types.

    Raise ValueError for an attribute that is longer than any that a run file has.
    """
    size = getattr(value, "size", 1) or 0  # an empty attribute has None
    if size > MAX_ATTRIBUTE_ELEMENTS or (isinstance(value, str | bytes) and len(value) > MAX_TEXT_CHARACTERS):
        raise ValueError("an attribute of it is longer than any a run has")
    return value.tolist() if isinstance(value, np.ndarray | np.generic) else value
