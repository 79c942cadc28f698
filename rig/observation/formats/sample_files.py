"""Files of readings and attitudes that are not text tables, and their readers, chosen by the file's name or content.

A path may select a part of the file after two colons: `session::/imu/data` is a topic of a bag, `flight.ulg::1` an
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
from rig.observation.formats.table_parts import columns_of, count_omitted_rows, note_of, parts_read_apart
from rig.observation.formats.ulog_samples import is_ulog

MEMBER_SEPARATOR = "::"
MAX_MOMENT_S = 0.4  # a row of attitudes with a longer duration declares a rest


@dataclass(frozen=True, slots=True)
class Format:
    """A kind of file, and its readers ("module:function"), which run in a process of their own.

    A reader gets two arguments: the path that `reads` returns, and the part of the file that the user selected, or
    None. It yields columns as described in `rig.observation.formats.table_parts`, named as in a CSV file.

    - name: the kind of file in messages; remedy: advice if a file cannot be read.
    - is_one: a function that tells whether a path names such a file.
    - readings: the reader of readings; attitudes: that of times and quaternions, None if such a file has none.
    - reads: a function that returns the path to read for the path that the user names.
    """

    name: str
    is_one: Callable[[Path], bool]
    remedy: str
    readings: str
    attitudes: str | None = None
    reads: Callable[[Path], Path] = Path


FORMATS = (
    Format(
        "bag",
        is_bag,
        "Name the folder of the bag, with its metadata.yaml, which `ros2 bag reindex FOLDER` writes; for ROS 1 name "
        "the file",
        "rig.observation.formats.bag_samples:bag_readings",
        "rig.observation.formats.bag_samples:bag_attitudes",
        bag_of,
    ),
    Format("log", is_ulog, "Copy it again from the card", "rig.observation.formats.ulog_samples:ulog_readings"),
)


def is_in_format(path: Path) -> bool:
    """Return whether a path names a file in a format of `FORMATS`, or a part of such a file."""
    return _format(path) is not None


def whole(path: Path) -> Path:
    """Return `path` up to the file or folder itself, without the name of a part inside that may follow."""
    return Path(str(path).partition(MEMBER_SEPARATOR)[0])


@dataclass(frozen=True, slots=True)
class FormatColumns:
    """The `columns` (n,) of a file, in its order; `others`: the number of rows without readings.

    `note`: what the readings lack, in words; "" if nothing is missing.
    """

    columns: Columns
    others: int = 0
    note: str = ""


def readings_in(path: Path) -> FormatColumns | None:
    """Return the readings of a file in a format of `FORMATS`; None for a table.

    Raise Refused `no_file`, `file_too_costly`, `temporary_folder_full`, and as its reader does.
    """
    form = _format(path)
    return None if form is None else _read(form, form.readings, path)


def attitudes_in(path: Path) -> Columns | None:
    """Return the attitudes in a file, each with a short interval about its time; None for a text table.

    The file has a format of `FORMATS`; the intervals are those of `rows_around`. Raise Refused `no_attitudes` if the
    file holds none, and what `readings_in` raises.
    """
    form = _format(path)
    if form is None:
        return None
    columns = {} if form.attitudes is None else dict(_read(form, form.attitudes, path).columns)
    if not columns:
        raise Refused(
            "no_attitudes",
            f"{path} contains readings of sensors, but not their attitudes",
            "Give the attitudes as CSV, or as poses in a ROS 2 bag",
        )
    order = np.argsort(columns[TIME], kind="stable")
    columns = {name: column[order] for name, column in columns.items()}
    time_s = columns.pop(TIME)
    return {**rows_around(time_s, path), **columns}


def rows_around(time_s: Array, path: Path) -> dict[str, Array]:
    """Return intervals, `start_s` and `end_s` (n,), about the times of attitudes.

    The times may be in any order. An interval reaches at most half-way to its neighbours, is too short for a rest, and
    is empty if an earlier row has the same time. Raise Refused `no_attitudes` for a single attitude.
    """
    rising_s, first = np.unique(time_s, return_index=True)
    if len(rising_s) < 2:
        raise Refused("no_attitudes", f"{path} holds one pose", "Record the poses while the sensor is turned")
    steps_s = np.diff(rising_s)
    most_s = min(MAX_MOMENT_S, float(np.median(steps_s))) / 2
    before_s = np.minimum(np.append(steps_s[:1], steps_s) / 2, most_s)
    after_s = np.minimum(np.append(steps_s, steps_s[-1:]) / 2, most_s)
    half_s = np.zeros(len(time_s))
    half_s[first] = np.minimum(before_s, after_s)
    return {"start_s": time_s - half_s, "end_s": time_s + half_s}


def entry_of(path: Path) -> FileEntry:
    """Return a file's name and checksum; for a folder, the checksum of its files in the order of their names."""
    source = whole(path)
    files = sorted(file for file in source.iterdir() if file.is_file()) if source.is_dir() else [source]
    digest = hashlib.sha256()
    for file in files:
        with file.open("rb") as stream:
            while block := stream.read(1 << 20):
                digest.update(block)
    name = path.name if MEMBER_SEPARATOR not in str(path) else source.name
    return FileEntry(name=printable(name), sha256=digest.hexdigest())  # a name that is not UTF-8 fits into no document


def _read(form: Format, reader: str, path: Path) -> FormatColumns:
    """Return the columns. Raise Refused as `readings_in` does."""
    source = form.reads(whole(path))
    parts = parts_read_apart(
        reader,
        source,
        {"inside": _part_inside(path)},
        else_=f"is not a {form.name} that can be read",
        remedy=form.remedy,
    )
    return FormatColumns(columns_of(parts), count_omitted_rows(parts), note_of(parts))


def _format(path: Path) -> Format | None:
    return next((form for form in FORMATS if form.is_one(whole(path))), None)


def _part_inside(path: Path) -> str | None:
    return str(path).partition(MEMBER_SEPARATOR)[2] or None
