"""The log of a rate table as attitudes, in which each record's axis angles become one row."""

from pathlib import Path

import numpy as np

from rig.config.column_map import STANDARD_NAMES, AxisSection, ColumnMap, TableSection
from rig.data.recording.motion_file import TIME, Columns, Header
from rig.errors import Refused
from rig.estimation.arrays import Array, axis_of
from rig.observation.external.attitude_import import ATTITUDES_MB, RATE_COLUMNS, STD_COLUMN
from rig.observation.formats.column_selection import map_table_log
from rig.observation.formats.csv_table import read_columns


def read_table_log(
    path: Path, table: TableSection, columns: ColumnMap = STANDARD_NAMES, origin_s: int = 0
) -> dict[str, Array]:
    """Return the columns of attitudes (`motion_file.MOTIONS`) from a table's log; times count from `origin_s`.

    Raise Refused `no_file`, `wrong_columns`, `not_a_number`, `time_not_increasing`.
    """
    mapped = map_table_log(table, columns)
    log = read_columns(path, Header(tuple(mapped.columns)), ATTITUDES_MB, mapped, origin_s)
    if len(log[TIME]) < 2 or not (np.diff(log[TIME]) > 0).all():
        raise Refused(
            "time_not_increasing",
            f"{path} has fewer than two rows about the table, or their time does not increase from row to row",
            "Give every row once, in the order of time",
        )
    return _attitudes(log, table)


def _attitudes(log: Columns, table: TableSection) -> dict[str, Array]:
    """Return the columns (N,) of attitudes, with one row for each of the N records of the log.

    A row's window begins half-way from the record before, and ends half-way to the next one. The outermost axis carries
    the others.
    """
    from scipy.spatial.transform import Rotation

    time_s = log[TIME]
    middles_s = (time_s[1:] + time_s[:-1]) / 2
    first, last = (2 * time_s[0] - middles_s[:1], 2 * time_s[-1] - middles_s[-1:])
    edges = np.concatenate([first, middles_s, last])
    carried, rates = Rotation.identity(len(time_s)), np.zeros((len(time_s), 3))
    for index, axis in reversed(list(enumerate(table.axes))):  # from the innermost axis outwards
        if axis.rate is not None:
            rates += carried.inv().apply(log[f"rate_{index}"][:, None] * _unit_vector(axis))
        carried = Rotation.from_rotvec(log[f"angle_{index}"][:, None] * _unit_vector(axis)) * carried
    x, y, z, w = carried.as_quat().T
    columns = {"start_s": edges[:-1], "end_s": edges[1:], "qw": w, "qx": x, "qy": y, "qz": z}
    if table.axes[0].rate is not None:
        columns |= dict(zip(RATE_COLUMNS, rates.T, strict=True))
    if table.attitude_std_deg is not None:
        columns[STD_COLUMN] = np.full(len(time_s), np.radians(table.attitude_std_deg))
    return columns


def _unit_vector(axis: AxisSection) -> Array:
    """Return the unit vector (3,) of an axis in the item's frame, with all angles at zero."""
    return axis_of(axis.direction)
