"""An external file of samples: a column for each axis of each quantity, in SI units.

The columns are `time_s`, and any of `x_rad_s y_rad_s z_rad_s` (rate), `x_m_s2 y_m_s2 z_m_s2` (specific force, which at
rest is the opposite of gravity) and `x_t y_t z_t` (magnetic field, tesla). `temperature_c` serves a calibration over
temperature. Columns may have any order; the first row holds their names. Each command uses the quantities that it
needs.

Loggers of several sensors leave cells blank in rows of another sensor. Such rows are left out, and counted.
"""

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from rig.data.installed_kinds import quantities
from rig.data.quantity import RATE, TEMPERATURE, Quantity
from rig.data.recording.motion_file import TIME, Columns, samples_header
from rig.errors import Refused
from rig.errors.quoting import quote
from rig.estimation.arrays import Array
from rig.observation.external.csv_windows import check_times
from rig.observation.external.omission import Omitted
from rig.observation.false_readings import check_possible, check_temperatures, check_unwrapped
from rig.observation.formats.column_selection import MappedColumns
from rig.observation.formats.csv_table import CsvTable, blank_cell, read_table
from rig.observation.formats.sample_files import readings_in
from rig.observation.statistics.spikes import bridge_spikes, find_markers, find_spikes
from rig.observation.time_stamps.sampling import Sampling
from rig.observation.time_stamps.stamp_order import OrderedStamps, order_stamps

SAMPLES_MB = 256  # enough for an hour at 1 kHz
MARKERS = "markers of a missing value: one number again and again, which the readings around it do not approach"
SPIKES = "spikes: each is far from the readings before and after it, which no rotation explains"


@dataclass(frozen=True, slots=True)
class SampleTable:
    """The columns (n,) of a file of readings by name, without blanks; times are relative to `origin_s`.

    `others`: number of rows without the wanted readings. `note`: what the readings lack, "" if nothing.
    """

    columns: Columns
    origin_s: int = 0
    others: int = 0
    note: str = ""


@dataclass(frozen=True, slots=True)
class Samples:
    """A file's readings in the order of time, in SI units.

    - `time_s` (n,): smoothed if the time stamps are too inexact; `sampling` describes the stamps.
    - `readings` (n, 3) by quantity; `temperature_c` (n,), None without such a column.
    - `omitted`: rows that are left out, such as repetitions; also spikes, although these are interpolated.
    - `notes`: how stamps were interpreted, in words.
    """

    time_s: Array
    readings: Mapping[Quantity, Array]
    temperature_c: Array | None = None
    sampling: Sampling | None = None
    omitted: tuple[Omitted, ...] = ()
    notes: tuple[str, ...] = ()


def read_samples(path: Path, needed: Sequence[Quantity] = (), mapped: MappedColumns | None = None) -> Samples:
    """Return the readings of a file, as `samples_in` does. Raise Refused as `samples_in` and `read_sample_table` do."""
    only = [quantity.sensor for quantity in needed]
    return samples_in(read_sample_table(path, needed, mapped, only).columns, str(path))


def read_sample_table(
    path: Path, needed: Sequence[Quantity] = (), mapped: MappedColumns | None = None, only: Collection[str] = ()
) -> SampleTable:
    """Return the columns of a file in any format, which must hold the quantities `needed`.

    `mapped` describes a table whose columns have other names. Rows of a table with a blank cell are left out; if `only`
    names sensors, blank cells of other sensors do not matter. Raise Refused `no_file`, `wrong_columns`, `wrong_unit`,
    `not_a_number`, `blank_cells`, and what `readings_in` raises.
    """
    readings = readings_in(path)
    if readings is not None:
        columns = _convert(path, readings.columns, mapped)
        for quantity in needed:
            if quantity.columns[0] not in columns:
                raise Refused(
                    "wrong_columns",
                    f"{path} holds no {' '.join(quantity.columns)}; it holds {', '.join(columns)}"
                    + (f": {readings.note}" if readings.note else ""),
                    "Name a recording that holds them, or the part of it after ::",
                )
        return SampleTable(columns, others=readings.others, note=readings.note)
    table = read_table(path, samples_header(needed), SAMPLES_MB, mapped)
    present = [quantity for quantity in quantities().values() if quantity.columns[0] in table.columns]
    read = {quantity: _read(path, table, quantity) for quantity in present}
    wanted = [quantity for quantity in present if quantity.sensor in only] or present
    return _drop_blanks(path, table, read, wanted)


def _convert(path: Path, columns: Columns, mapped: MappedColumns | None) -> Columns:
    """Return columns renamed as in the rig's files, and multiplied by the factors of a map.

    A factor serves for a mirrored axis (−1), or for a column in another unit. Raise Refused `wrong_columns`.
    """
    if mapped is None:
        return columns
    converted = dict(columns)
    for name, (column, factor) in mapped.columns.items():
        if column not in columns:
            raise Refused(
                "wrong_columns",
                f"{path} has no column {quote(column)}, which is to be {name}",
                f"Name one of its columns: {', '.join(columns)}",
            )
        converted[name] = factor * columns[column]
    return converted


def _read(path: Path, table: CsvTable, quantity: Quantity) -> NDArray[np.bool_]:
    """Return a mask (n,) of the rows with the `quantity`. Raise Refused `not_a_number` if only some axes are blank."""
    blank = np.isnan([table.columns[name] for name in quantity.columns])
    if len(partly := np.flatnonzero(blank.any(axis=0) & ~blank.all(axis=0))):
        row = int(partly[0])
        axis = int(np.argmax(blank[:, row]))
        raise blank_cell(path, quantity.columns[axis], int(table.lines[row]))
    read: NDArray[np.bool_] = ~blank[0]
    return read


def _drop_blanks(
    path: Path, table: CsvTable, read: Mapping[Quantity, NDArray[np.bool_]], wanted: Sequence[Quantity]
) -> SampleTable:
    """Return the rows that hold all `wanted` quantities. Raise Refused `blank_cells` if rows hold only a part of these.

    `read`: for each quantity, a mask of the rows that hold it."""
    columns, time_s = dict(table.columns), table.columns[TIME]
    if not wanted or all(read[quantity].all() for quantity in read):
        kept = np.ones(len(time_s), dtype=np.bool_)
    else:
        kept = read[wanted[0]]
    for quantity in wanted:
        if (read[quantity] != kept).any():
            raise _refuse_separate_rows(path, quantity, wanted, read)
    for quantity in read:
        if not read[quantity][kept].all():  # an unrequested quantity that stands in other rows
            for name in quantity.columns:
                del columns[name]
    if len(blank := np.flatnonzero(np.isnan(time_s) & kept)):
        raise blank_cell(path, TIME, int(table.lines[blank[0]]))
    temperature = TEMPERATURE.columns[0]
    if temperature in columns:
        valid = ~np.isnan(columns[temperature]) & ~np.isnan(time_s)
        if not valid.any():
            del columns[temperature]
        elif not valid[kept].all():  # a temperature changes slowly, so missing ones are interpolated
            columns[temperature] = np.interp(time_s, time_s[valid], columns[temperature][valid])
    return SampleTable({name: column[kept] for name, column in columns.items()}, table.origin_s, int((~kept).sum()))


def _refuse_separate_rows(
    path: Path, quantity: Quantity, wanted: Sequence[Quantity], read: Mapping[Quantity, NDArray[np.bool_]]
) -> Refused:
    """Return the refusal of a log in which the wanted sensors have values in different rows."""
    other = wanted[0]
    alone, both = int((read[other] & ~read[quantity]).sum()), int((read[other] & read[quantity]).sum())
    return Refused(
        "blank_cells",
        f"{path}: of {alone + both} rows that hold {other.columns[0]}, {alone} have a blank in {quantity.columns[0]}: "
        f"the {other.sensor} and the {quantity.sensor} were read at different times",
        f"Solve one sensor at a time: --only {other.sensor}, then --only {quantity.sensor}",
    )


def samples_in(table: Columns, where: str) -> Samples:
    """Return the readings in columns (n,), in the order of time; error messages call their source `where`.

    Raise Refused `wrong_columns`, `wrong_unit`, `not_a_number`, and as `check_times` does.
    """
    present = [quantity for quantity in quantities().values() if quantity.columns[0] in table]
    if not present:
        names = ", or ".join(" ".join(quantity.columns) for quantity in quantities().values())
        raise Refused("wrong_columns", f"{where} holds no readings", f"Its first row must name time_s and {names}")
    columns = np.column_stack([table[name] for quantity in present for name in quantity.columns])
    ordered = order_stamps(table[TIME], columns, where)
    rows = ordered.rows
    for name, column in table.items():
        if len(wrong := np.flatnonzero(~np.isfinite(column[rows]))):
            raise Refused(
                "not_a_number",
                f"{where} has {len(wrong)} samples whose {name} is not a number; the first is sample "
                f"{rows[wrong[0]] + 1}",
                "Leave out what was not measured, or record again",
            )
    check_times(ordered.time_s, where)
    readings = {quantity: np.column_stack([table[name][rows] for name in quantity.columns]) for quantity in present}
    for quantity, values in readings.items():
        check_possible(values, rows, quantity, where)
        check_unwrapped(ordered.time_s, values, rows, quantity, where)
    temperature_c = table.get(TEMPERATURE.columns[0])
    if temperature_c is not None:
        check_temperatures(temperature_c[rows], rows, where)
    total = len(table[TIME])
    omitted = [
        Omitted("samples", finding.count, total, finding.reason, str(finding))
        for finding in ordered.findings
        if finding.left_out
    ]
    for find, reason in ((find_markers, MARKERS), (partial(find_spikes, ordered.time_s), SPIKES)):
        if RATE in readings and len(wrong := find(readings[RATE])):
            first = f"sample {rows[wrong[0]] + 1}, at {ordered.time_s[wrong[0]]:.10g} s"
            omitted.append(Omitted("gyroscope readings", len(wrong), len(rows), reason, first))
            readings[RATE] = bridge_spikes(ordered.time_s, readings[RATE], wrong)
    return Samples(
        ordered.time_s,
        readings,
        None if temperature_c is None else temperature_c[rows],
        ordered.sampling,
        tuple(omitted),
        tuple(_describe_stamps(ordered, total)),
    )


def _describe_stamps(ordered: OrderedStamps, total: int) -> Iterator[str]:
    """Yield sentences on how the time stamps of `total` samples were interpreted; nothing for good stamps."""
    for finding in ordered.findings:
        if not finding.left_out:
            yield f"{finding.count} of {total} samples, the first {finding}: {finding.reason}"
    sampling = ordered.sampling
    gaps = np.flatnonzero(sampling.missing)
    if len(gaps):
        longest = int(gaps[np.argmax(sampling.missing[gaps])])
        lasts_s = ordered.time_s[longest + 1] - ordered.time_s[longest]
        yield (
            f"{sampling.missing.sum()} samples are missing in {len(gaps)} gaps, the longest {lasts_s:.3g} s, after "
            f"sample {ordered.rows[longest] + 1}, at {ordered.time_s[longest]:.10g} s"
        )
    even_words = f"they count as taken every {1e3 * sampling.interval_s:.4g} ms"
    if sampling.late is not None:
        yield "the stamps are too uneven to show which readings are missing: the times are used as they are"
        return
    if sampling.on_arrival:
        yield f"the readings are stamped on arrival, several at once: {even_words}"
    elif sampling.width > 1:
        yield f"the stamps are coarse: {even_words}"
