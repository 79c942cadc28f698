"""The log of a rate table as attitudes: a row for each of its looks, from the angles of its axes."""

from pathlib import Path

import numpy as np

from rig.config.column_map import AxisSection, TableSection
from rig.data.recording.motion_file import TIME, Columns, Header
from rig.errors import Refused
from rig.estimation.arrays import Array
from rig.observation.external.attitude_import import ATTITUDES_MB, RATE_COLUMNS, STD_COLUMN
from rig.observation.formats.csv_table import Mapped, read_columns


def read_table_log(path: Path, table: TableSection, skip_lines: int = 0, origin_s: int = 0) -> dict[str, Array]:
    """The columns of attitudes (`motion_file.MOTIONS`) that the log of a table tells, from `origin_s` on.

    Raises Refused `no_file`, `wrong_columns`, `not_a_number`, `time_not_increasing`.
    """
    columns = {TIME: (table.time.column, table.time.factor)}
    for place, axis in enumerate(table.axes):
        columns[f"angle_{place}"] = axis.angle.column, axis.angle.factor
        if axis.rate is not None:
            columns[f"rate_{place}"] = axis.rate.column, axis.rate.factor
    log = read_columns(path, Header(tuple(columns)), ATTITUDES_MB, Mapped(columns, skip_lines), origin_s)
    if len(log[TIME]) < 2 or not (np.diff(log[TIME]) > 0).all():
        raise Refused(
            "time_not_increasing",
            f"{path} has fewer than two looks at the table, or their time does not increase from row to row",
            "Give every look once, in the order of time",
        )
    return _attitudes(log, table)


def _attitudes(log: Columns, table: TableSection) -> dict[str, Array]:
    """Rows (N,) that touch each other, each with its look in the middle; the outermost axis carries the others."""
    from scipy.spatial.transform import Rotation

    time_s = log[TIME]
    between = (time_s[1:] + time_s[:-1]) / 2
    first, last = (2 * time_s[0] - between[:1], 2 * time_s[-1] - between[-1:])
    edges = np.concatenate([first, between, last])
    carried, rates = Rotation.identity(len(time_s)), np.zeros((len(time_s), 3))
    for place, axis in reversed(list(enumerate(table.axes))):  # from the item outwards
        if axis.rate is not None:
            rates += carried.inv().apply(log[f"rate_{place}"][:, None] * _along(axis))
        carried = Rotation.from_rotvec(log[f"angle_{place}"][:, None] * _along(axis)) * carried
    x, y, z, w = carried.as_quat().T
    found = {"start_s": edges[:-1], "end_s": edges[1:], "qw": w, "qx": x, "qy": y, "qz": z}
    if table.axes[0].rate is not None:
        found |= dict(zip(RATE_COLUMNS, rates.T, strict=True))
    if table.attitude_std_deg is not None:
        found[STD_COLUMN] = np.full(len(time_s), np.radians(table.attitude_std_deg))
    return found


def _along(axis: AxisSection) -> Array:
    """(3,) the unit vector of an axis in the item's frame, where all angles are zero."""
    unit: Array = (1.0 if axis.along[0] == "+" else -1.0) * np.eye(3)["xyz".index(axis.along[1])]
    return unit
