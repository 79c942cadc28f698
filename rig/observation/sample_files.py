"""Files of readings and attitudes that are no CSV: what reads each, by what it looks like. One entry a format.

A path may name what inside is meant, behind two colons: `session::/imu/data` is a topic of a bag, `flight.ulg::1` an
instance in PX4's log.
"""

import hashlib
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from rig.data.motion_file import Columns
from rig.data.result_file import FileEntry
from rig.errors import Refused
from rig.errors.quoting import printable
from rig.observation.bag_samples import bag_attitudes, bag_readings, is_bag
from rig.observation.ulog_samples import is_ulog, ulog_readings

INSIDE = "::"
Reads = Callable[[Path, str | None], Columns]


@dataclass(frozen=True, slots=True)
class Format:
    """Whether a path `is_one`, and what reads its readings and its attitudes, None where it can hold none.

    They get the path and what inside is meant, and give columns (n,) as a CSV file has them.
    """

    is_one: Callable[[Path], bool]
    readings: Reads
    attitudes: Reads | None = None


FORMATS = (Format(is_bag, bag_readings, bag_attitudes), Format(is_ulog, ulog_readings))


def whole(path: Path) -> Path:
    """The file or folder itself."""
    return Path(str(path).partition(INSIDE)[0])


def readings_in(path: Path) -> Columns | None:
    """The readings of a file that is no CSV; None of one that may be. Raises Refused as its format does."""
    found = _format(path)
    return None if found is None else found.readings(whole(path), _inside(path))


def attitudes_in(path: Path) -> Columns | None:
    """The attitudes in a file that is no CSV; None of one that may be.

    Raises Refused as its format does, and `no_attitudes` where there can be none in it.
    """
    found = _format(path)
    if found is None:
        return None
    if found.attitudes is None:
        raise Refused(
            "no_attitudes",
            f"{path} tells what sensors read, and nothing of the attitudes they were in",
            "Give the attitudes as CSV, or as poses in a ROS 2 bag",
        )
    return found.attitudes(whole(path), _inside(path))


def entry_of(path: Path) -> FileEntry:
    """A file by its name and its sum; of a folder, the sum of all its files in the order of their names."""
    there = whole(path)
    files = sorted(each for each in there.rglob("*") if each.is_file()) if there.is_dir() else [there]
    found = hashlib.sha256()
    for each in files:
        with each.open("rb") as file:
            while piece := file.read(1 << 20):
                found.update(piece)
    name = path.name if INSIDE not in str(path) else there.name
    return FileEntry(name=printable(name), sha256=found.hexdigest())  # a name may be no UTF-8, which no document takes


def _format(path: Path) -> Format | None:
    return next((each for each in FORMATS if each.is_one(whole(path))), None)


def _inside(path: Path) -> str | None:
    return str(path).partition(INSIDE)[2] or None
