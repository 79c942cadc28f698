"""Readings of one sensor or several as a CSV file: the columns that every command takes.

`time_s`, which must increase, and any of `x_rad_s y_rad_s z_rad_s` (rate), `x_m_s2 y_m_s2 z_m_s2` (what an
accelerometer feels: at rest the opposite of gravity) and `x_t y_t z_t` (magnetic field, tesla). `temperature_c` may
stand there too, as `rig export` writes it: a calibration over temperature needs it, nothing else does. Columns may
stand in any order; the first row holds their names. One recording serves every command: each uses the quantities it
knows what to do with.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from rig.data.installed_kinds import quantities
from rig.data.motion_file import TIME, Columns, samples_header
from rig.data.quantity import TEMPERATURE, Quantity
from rig.errors import Refused
from rig.estimation.arrays import Array
from rig.observation.csv_table import Mapped, read_columns
from rig.observation.csv_windows import check_times
from rig.observation.sample_files import readings_in

SAMPLES_MB = 256  # an hour at 1 kHz


@dataclass(frozen=True, slots=True)
class Samples:
    """A file's readings: `time_s` (n,), increasing, and (n, 3) of every quantity it holds, in SI units.

    `temperature_c` (n,) is None where there is no such column.
    """

    time_s: Array
    readings: Mapping[Quantity, Array]
    temperature_c: Array | None = None


def read_samples(path: Path, needed: Sequence[Quantity] = (), mapped: Mapped | None = None) -> Samples:
    """The readings of a file, in whichever format it is: those `needed` and whatever others it holds.

    `mapped` is for a table whose columns are others'.

    Raises as `readings_in`; Refused `no_file`, `wrong_columns`, `wrong_unit`, `not_a_number`, `time_not_increasing`.
    """
    table = readings_in(path)
    if table is None:
        table = read_columns(path, samples_header(needed), SAMPLES_MB, mapped)
    return samples_in(table, str(path))


def samples_in(table: Columns, where: str) -> Samples:
    """The readings of columns (n,), said to stand `where`.

    Raises Refused `wrong_columns`, `not_a_number`, `time_not_increasing`.
    """
    given = [each for each in quantities().values() if each.columns[0] in table]
    if not given:
        known = ", or ".join(" ".join(each.columns) for each in quantities().values())
        raise Refused("wrong_columns", f"{where} holds no readings", f"Its first row must name time_s and {known}")
    for name, column in table.items():
        if len(wrong := np.flatnonzero(~np.isfinite(column))):
            raise Refused(
                "not_a_number",
                f"{where} has {len(wrong)} samples whose {name} is not a number, the first is sample {wrong[0] + 1}",
                "Leave out what was not measured, or record again",
            )
    check_times(table[TIME], where)
    readings = {quantity: np.column_stack([table[name] for name in quantity.columns]) for quantity in given}
    return Samples(table[TIME], readings, table.get(TEMPERATURE.columns[0]))
