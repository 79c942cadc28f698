"""A file of samples that somebody else recorded: a column for each axis of what was read, in SI units.

`time_s`, which must increase, and any of `x_rad_s y_rad_s z_rad_s` (rate), `x_m_s2 y_m_s2 z_m_s2` (what an
accelerometer feels: at rest the opposite of gravity) and `x_t y_t z_t` (magnetic field, tesla). `temperature_c` may
stand there too, as `rig export` writes it: a calibration over temperature needs it, nothing else does. Columns may
stand in any order; the first row holds their names. One recording serves every command: each uses the quantities it
knows what to do with.

Loggers of several sensors leave cells blank where a row belongs to another one. Such rows are left out, and counted.
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from rig.data.installed_kinds import quantities
from rig.data.quantity import TEMPERATURE, Quantity
from rig.data.recording.motion_file import TIME, Columns, samples_header
from rig.errors import Refused
from rig.estimation.arrays import Array
from rig.observation.external.csv_windows import check_times
from rig.observation.formats.csv_table import Mapped, Table, blank_cell, read_table
from rig.observation.formats.sample_files import readings_in
from rig.observation.sampling import Sampling, even_times, find_sampling

SAMPLES_MB = 256  # an hour at 1 kHz


@dataclass(frozen=True, slots=True)
class SampleTable:
    """The `columns` (n,) of a file of readings by name, without a blank; times count from `origin_s`.

    `others` more rows of the file held none of the readings that were wanted.
    """

    columns: Columns
    origin_s: int = 0
    others: int = 0


@dataclass(frozen=True, slots=True)
class Samples:
    """A file's readings: `time_s` (n,), increasing, and (n, 3) of every quantity it holds, in SI units.

    `temperature_c` (n,) is None where there is no such column. Times are evened where readings were stamped on arrival;
    `sampling` is that of the stamps.
    """

    time_s: Array
    readings: Mapping[Quantity, Array]
    temperature_c: Array | None = None
    sampling: Sampling | None = None


def read_samples(path: Path, needed: Sequence[Quantity] = (), mapped: Mapped | None = None) -> Samples:
    """Return the readings of a file as `samples_in`. Raises Refused as this, and as `read_sample_table`."""
    only = [each.sensor for each in needed]
    return samples_in(read_sample_table(path, needed, mapped, only).columns, str(path))


def read_sample_table(
    path: Path, needed: Sequence[Quantity] = (), mapped: Mapped | None = None, only: Collection[str] = ()
) -> SampleTable:
    """Return the columns of a file, in whichever format it is: the quantities `needed` and whatever others it holds.

    `mapped` is for a table whose columns are others'. Of rows with blank cells those count that hold all quantities of
    the sensors that are `only` wanted, or all that the file has.
    Raises Refused as `readings_in`, `no_file`, `wrong_columns`, `wrong_unit`, `not_a_number`, `blank_cells`.
    """
    found = readings_in(path)
    if found is not None:
        columns, others = found
        for quantity in needed:
            if quantity.columns[0] not in columns:
                raise Refused(
                    "wrong_columns", f"{path} holds no {' '.join(quantity.columns)}", "Name a recording that holds them"
                )
        return SampleTable(columns, others=others)
    table = read_table(path, samples_header(needed), SAMPLES_MB, mapped)
    there = [each for each in quantities().values() if each.columns[0] in table.columns]
    read = {quantity: _read(path, table, quantity) for quantity in there}
    wanted = [each for each in there if each.sensor in only] or there
    return _without_blanks(path, table, read, wanted)


def _read(path: Path, table: Table, quantity: Quantity) -> NDArray[np.bool_]:
    """(n,) the rows that hold a quantity. Raises Refused `not_a_number` where one of its axes is blank alone."""
    blank = np.isnan([table.columns[name] for name in quantity.columns])
    if len(partly := np.flatnonzero(blank.any(axis=0) & ~blank.all(axis=0))):
        row = int(partly[0])
        axis = int(np.argmax(blank[:, row]))
        raise blank_cell(path, quantity.columns[axis], int(table.lines[row]))
    read: NDArray[np.bool_] = ~blank[0]
    return read


def _without_blanks(
    path: Path, table: Table, read: Mapping[Quantity, NDArray[np.bool_]], wanted: Sequence[Quantity]
) -> SampleTable:
    """The rows that hold all that is wanted. Raises Refused `blank_cells` where no row does, or only some do."""
    columns, time_s = dict(table.columns), table.columns[TIME]
    if not wanted or all(read[each].all() for each in read):
        kept = np.ones(len(time_s), dtype=np.bool_)
    else:
        kept = read[wanted[0]]
    for quantity in wanted:
        if (read[quantity] != kept).any():
            raise _apart(path, quantity, wanted, read)
    for quantity in read:
        if not read[quantity][kept].all():  # it was read in other rows, and nobody asked for it
            for name in quantity.columns:
                del columns[name]
    if len(blank := np.flatnonzero(np.isnan(time_s) & kept)):
        raise blank_cell(path, TIME, int(table.lines[blank[0]]))
    temperature = TEMPERATURE.columns[0]
    if temperature in columns:
        known = ~np.isnan(columns[temperature]) & ~np.isnan(time_s)
        if not known.any():
            del columns[temperature]
        elif not known[kept].all():  # nothing is as slow as a temperature
            columns[temperature] = np.interp(time_s, time_s[known], columns[temperature][known])
    return SampleTable({name: column[kept] for name, column in columns.items()}, table.origin_s, int((~kept).sum()))


def _apart(
    path: Path, quantity: Quantity, wanted: Sequence[Quantity], read: Mapping[Quantity, NDArray[np.bool_]]
) -> Refused:
    other = wanted[0]
    alone, both = int((read[other] & ~read[quantity]).sum()), int((read[other] & read[quantity]).sum())
    return Refused(
        "blank_cells",
        f"{path}: of {alone + both} rows that hold {other.columns[0]}, {alone} have a blank in {quantity.columns[0]}: "
        f"the {other.sensor} and the {quantity.sensor} were read at different times",
        f"Solve one sensor at a time: --only {other.sensor}, then --only {quantity.sensor}",
    )


def samples_in(table: Columns, where: str) -> Samples:
    """Return the readings of columns (n,), said to stand `where`; stamped on arrival, at even times.

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
    sampling = find_sampling(table[TIME])
    time_s = even_times(table[TIME], sampling)
    return Samples(time_s, readings, table.get(TEMPERATURE.columns[0]), sampling)
