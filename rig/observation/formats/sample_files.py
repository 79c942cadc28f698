"""Files of readings and attitudes that are no CSV: what reads each, by what it looks like. One entry a format.

A path may name what inside is meant, behind two colons: `session::/imu/data` is a topic of a bag, `flight.ulg::1` an
instance in PX4's log.
"""

import hashlib
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from rig.data.recording.motion_file import TIME, Columns
from rig.data.result_file import FileEntry
from rig.errors import Refused
from rig.errors.quoting import printable
from rig.estimation.arrays import Array
from rig.observation.formats.bag_samples import bag_of, is_bag
from rig.observation.formats.table_parts import columns_of, left_out_of, parts_read_apart
from rig.observation.formats.ulog_samples import is_ulog

INSIDE = "::"


@dataclass(frozen=True, slots=True)
class Format:
    """A kind of file that is `called` so, and what reads it in a process of its own.

    `readings` and `attitudes` are readers ("module:function", as `rig.data.processes.reading_process` has them), None
    where it can hold none. They get the path that `reads` makes of the given one, and what inside is meant, and yield
    columns `in_blocks` (`rig.observation.formats.table_parts`), named as those of a CSV file; of attitudes times and
    quaternions. `remedy` is for what cannot be read.
    """

    called: str
    is_one: Callable[[Path], bool]
    remedy: str
    readings: str
    attitudes: str | None = None
    reads: Callable[[Path], Path] = Path


FORMATS = (
    Format(
        "bag",
        is_bag,
        "Name the folder of the bag, with its metadata.yaml; `ros2 bag reindex FOLDER` writes one",
        "rig.observation.formats.bag_samples:bag_readings",
        "rig.observation.formats.bag_samples:bag_attitudes",
        bag_of,
    ),
    Format("log", is_ulog, "Copy it anew from the card", "rig.observation.formats.ulog_samples:ulog_readings"),
)


def whole(path: Path) -> Path:
    """The file or folder itself."""
    return Path(str(path).partition(INSIDE)[0])


def readings_in(path: Path) -> tuple[Columns, int] | None:
    """The readings of a file that is no CSV, in the order of time, how many rows hold none; None of one that may be.

    Raises Refused as its reader does, `no_file`, `file_too_costly`, `temporary_folder_full`.
    """
    found = _format(path)
    return None if found is None else _read(found, found.readings, path)


def attitudes_in(path: Path) -> Columns | None:
    """The attitudes in a file that is no CSV; None of one that may be.

    An attitude holds from half-way to the one before until half-way to the next. Raises Refused as `readings_in`, and
    `no_attitudes` where there are none in it.
    """
    found = _format(path)
    if found is None:
        return None
    columns = {} if found.attitudes is None else _read(found, found.attitudes, path)[0]
    if not columns:
        raise Refused(
            "no_attitudes",
            f"{path} tells what sensors read, and nothing of the attitudes they were in",
            "Give the attitudes as CSV, or as poses in a ROS 2 bag",
        )
    time_s = columns.pop(TIME)
    if len(time_s) < 2:
        raise Refused("no_attitudes", f"{path} holds one pose", "Record the poses while the sensor is turned")
    between = (time_s[1:] + time_s[:-1]) / 2
    first, last = time_s[0] - (between[0] - time_s[0]), time_s[-1] + (time_s[-1] - between[-1])
    return {"start_s": np.append(first, between), "end_s": np.append(between, last), **columns}


def entry_of(path: Path) -> FileEntry:
    """A file by its name and its sum; of a folder, the sum of the files in it in the order of their names."""
    there = whole(path)
    files = sorted(each for each in there.iterdir() if each.is_file()) if there.is_dir() else [there]
    found = hashlib.sha256()
    for each in files:
        with each.open("rb") as file:
            while piece := file.read(1 << 20):
                found.update(piece)
    name = path.name if INSIDE not in str(path) else there.name
    return FileEntry(name=printable(name), sha256=found.hexdigest())  # a name may be no UTF-8, which no document takes


def _read(form: Format, reader: str, path: Path) -> tuple[dict[str, Array], int]:
    """Return the columns, in the order of time, and how many rows hold none. Raise Refused as `readings_in`."""
    source = form.reads(whole(path))
    parts = parts_read_apart(
        reader, source, {"inside": _inside(path)}, else_=f"is no {form.called} that can be read", remedy=form.remedy
    )
    columns = columns_of(parts)
    time_s = columns[TIME]
    if (np.diff(time_s) < 0).any():
        order = np.argsort(time_s, kind="stable")
        columns = {name: column[order] for name, column in columns.items()}
    return columns, left_out_of(parts)


def _format(path: Path) -> Format | None:
    return next((each for each in FORMATS if each.is_one(whole(path))), None)


def _inside(path: Path) -> str | None:
    return str(path).partition(INSIDE)[2] or None
