"""External data in known attitudes: a CSV file of samples and one of attitudes.

The file of samples is that of `rig.observation.external.csv_samples`.

The file of attitudes has `start_s`, `end_s` on the same clock, or `time_s` alone, and `qw qx qy qz`, the unit
quaternion that takes body to table coordinates. If the table turns, it also has the table's rate in body coordinates,
`rate_x_rad_s rate_y_rad_s rate_z_rad_s`; optionally it has `attitude_std_rad` about each axis. While the table turns, a
row states the attitude at the middle of its window and should be short. The window may contain a single sample; the
noise is then estimated from the scatter of all rows about the model. Accelerometers and magnetometers use only the rows
in which the body is at rest (`rig.observation.external.placements`).

Columns may have any order; the first row holds their names.

If the table has a clock of its own, the rotation that both files show determines its offset, as on the arm
(`rig.observation.clocks`).
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from rig.data.quantity import RATE, Quantity
from rig.data.recording.motion_file import MOTIONS, QUATERNION, TIME, Header
from rig.errors import Fault, Refused, or_fault
from rig.estimation.arrays import Array, unwrap_counter
from rig.observation.clocks.time_base import TimeBase
from rig.observation.external.csv_samples import Samples
from rig.observation.external.csv_windows import (
    MIN_SAMPLES,
    check_complete,
    check_overlap,
    clocks_apart,
    find_overlap,
    is_complete,
    scatter_of,
)
from rig.observation.external.omission import Omitted
from rig.observation.external.placement_account import AttitudeRows
from rig.observation.external.placements import MIN_STILL_FRACTION, Placements, find_placements
from rig.observation.external.reference_clock import check_one_clock, find_reference_clock
from rig.observation.external.reference_rows import Turning
from rig.observation.external.still_attitudes import find_frozen
from rig.observation.external.table_motion import check_rates_agree
from rig.observation.formats.column_selection import MappedColumns
from rig.observation.formats.csv_table import CsvTable, blank_cell, read_table
from rig.observation.formats.sample_files import attitudes_in, rows_around
from rig.observation.motion.interpolated_attitudes import find_interpolated
from rig.observation.time_stamps.sampling import find_sampling
from rig.observation.time_stamps.stamp_order import find_restart_s
from rig.observation.windows import Window, inside

RATE_COLUMNS = ("rate_x_rad_s", "rate_y_rad_s", "rate_z_rad_s")
STD_COLUMN = "attitude_std_rad"
ATTITUDES_MB = 32  # an hour's table at 50 Hz
LACKING = "lost_samples: samples are missing in them"
MOSTLY_LACKING = "lost_samples: half of their samples or more are missing"
FROZEN = "attitude_untrustworthy: they repeat the attitude before them while the gyroscope turns"
NORM_TOLERANCE, MAX_WRONG_FRACTION = 1e-3, 0.01  # of a quaternion's length; of the rows that exceed it
MOMENTS = Header(  # forms of a file: rows with a duration, or with a moment each
    QUATERNION, (TIME, "start_s"), (("start_s", "end_s"), *MOTIONS["attitudes"].optional)
)


@dataclass(frozen=True, slots=True)
class Rows:
    """A gyroscope's averages in N rows of a file of attitudes.

    - `means` (N, 3), their `variances` (N, 3) and the variances' degrees of freedom `dof` (N, 3); `variances` and `dof`
      are None if a row has too few samples to show its noise.
    - `samples` (N,): the number of samples in each row; `attitudes` (N, 3, 3): rotations from body to table.
    - `rates_rad_s` (N, 3), in body coordinates, and `attitude_std_rad` (N,): None unless the file states them.
    """

    means: Array
    variances: Array | None
    dof: Array | None
    samples: Array
    attitudes: Array
    rates_rad_s: Array | None
    attitude_std_rad: Array | None


@dataclass(frozen=True, slots=True)
class PlacedReadings:
    """Averages of the samples in one file in each attitude that another file states; `quantities` were recorded.

    - `rows`: a gyroscope's averages, or the Fault that prevents them; `turning`: its readings and all rows, for a
      solution by rotation angles.
    - `placements`: the placements of the other sensors, or the Fault that prevents them.
    - `clock`: the table's clock, if it had to be found.
    - `omitted`: rows that the recording does not cover, that repeat a time or are interpolated; `incomplete`: rows that
      are not in `rows`, because samples are missing in them.
    """

    quantities: tuple[Quantity, ...]
    rows: Rows | Fault | None
    turning: Turning | None
    placements: Placements | Fault | None
    clock: TimeBase | None = None
    omitted: tuple[Omitted, ...] = ()
    incomplete: tuple[Omitted, ...] = ()


def read_attitudes(
    path: Path, mapped: MappedColumns | None = None, origin_s: int = 0, *, inverse: bool = False
) -> dict[str, Array]:
    """Return the columns (N,) of a file of attitudes in any format; `mapped` describes columns with other names.

    Times of a text table are relative to `origin_s`. A row with `time_s` in place of `start_s` and `end_s` is valid at
    one instant; restarts of a counter of time are removed. If `inverse`, the quaternions in the file take table to body
    coordinates. Raise as `attitudes_in` does; Refused `no_file`, `wrong_columns`, `wrong_unit`, `not_a_number`.
    """
    in_format = attitudes_in(path)
    if in_format is None:
        columns = _drop_other_rows(path, read_table(path, MOMENTS, ATTITUDES_MB, mapped, origin_s))
        if TIME in columns:
            time_s = columns.pop(TIME)
            period_s = find_restart_s(time_s)
            columns |= rows_around(time_s if period_s is None else unwrap_counter(time_s, period_s), path)
    else:
        columns = dict(in_format)
    if inverse:
        columns |= {name: -columns[name] for name in ("qx", "qy", "qz")}
    return columns


def _drop_other_rows(path: Path, table: CsvTable) -> dict[str, Array]:
    """Return the rows that hold a quaternion.

    Loggers with several rates leave the quaternion blank in other rows. Raise Refused `not_a_number` for other blanks.
    """
    kept = ~np.isnan([table.columns[name] for name in QUATERNION]).all(axis=0)
    for name, column in table.columns.items():
        if len(blank := np.flatnonzero(np.isnan(column) & kept)):
            raise blank_cell(path, name, int(table.lines[blank[0]]))
    return {name: column[kept] for name, column in table.columns.items()}


def average_placements(samples: Samples, table: Mapping[str, Array], *, find_clock: bool = False) -> PlacedReadings:
    """Return the averages of the samples in each attitude of `table`, the columns of a file of attitudes.

    With `find_clock` the table's clock is estimated, and rows without samples are left out. Raise Refused
    `bad_quaternion`, `bad_attitude_row`, `overlapping_attitudes`; Fault `clocks_apart`, `lost_samples`,
    `too_few_observations`, `wrong_unit`, and with `find_clock` those of `find_reference_clock`.
    """
    time_s, readings = samples.time_s, samples.readings
    hides_losses = samples.sampling is not None and samples.sampling.hides_losses
    table, numbers, not_reported = select_reports(table)
    rates = np.column_stack([table[name] for name in RATE_COLUMNS]) if RATE_COLUMNS[0] in table else None
    windows = _windows(table)
    rows_found = _ReferenceRows(windows, _rotations(table), rates, _attitude_std(table), numbers)
    clock, rate, frozen = None, readings.get(RATE), tuple[Omitted, ...]()
    if rates is not None:
        check_rates_agree(rows_found.rows_s.mean(axis=1), rows_found.attitudes, rates)
    if find_clock:
        _check_has_rates(readings)
        clock = find_reference_clock(rows_found.join(time_s, readings[RATE]), rates)
        time_s = clock.controller_time_s(time_s)
    if rate is not None:
        rows_found, frozen = _drop_frozen(rows_found, time_s, rate)
    all_rows = rows_found
    if find_clock:
        rows_found = rows_found.select(np.flatnonzero(_is_covered(rows_found.rows_s, time_s)))
    elif rate is not None:
        check_one_clock(rows_found.join(time_s, rate), rows_found.rates_rad_s)
    if not rows_found.windows:
        raise clocks_apart(time_s, windows)
    check_overlap(time_s, rows_found.windows)
    sampling = find_sampling(time_s)
    expected = sampling.count_expected(time_s, rows_found.rows_s)
    counts = np.diff(np.searchsorted(time_s, rows_found.rows_s), axis=1)[:, 0]
    mostly = (counts > 0) & (counts >= MIN_STILL_FRACTION * expected - 1)
    sampled = rows_found.select(np.flatnonzero(mostly))
    covered = rows_found.select(np.flatnonzero(mostly | _is_covered(rows_found.rows_s, time_s)))
    whole = or_fault(lambda: rows_found.select(_find_complete(rows_found, counts, expected)))
    placement_rows = AttitudeRows(sampled.windows, sampled.attitudes, sampled.numbers, sampled.std_rad)
    lacking = tuple(_list_omitted(covered, sampled, MOSTLY_LACKING))

    def find() -> Placements:
        if isinstance(whole, Fault) and not sampled.windows:
            raise whole
        placements = find_placements(time_s, readings, placement_rows)
        return replace(placements, omitted=(*lacking, *placements.omitted))

    return PlacedReadings(
        tuple(readings),
        None if rate is None else whole if isinstance(whole, Fault) else _rows(time_s, rate, whole),
        None if rate is None else replace(rows_found.join(time_s, rate), hides_losses=hides_losses),
        None if set(readings) == {RATE} else or_fault(find),  # a gyroscope needs none
        clock,
        (*not_reported, *frozen, *_list_omitted(all_rows, covered, "not covered by the recording")),
        () if isinstance(whole, Fault) else tuple(_list_omitted(covered, whole, LACKING)),
    )


def _drop_frozen(rows: "_ReferenceRows", time_s: Array, rate: Array) -> tuple["_ReferenceRows", tuple[Omitted, ...]]:
    """Return the rows except those in which the reference had stopped, and an entry for the rows left out."""
    fresh = rows.select(np.flatnonzero(~find_frozen(rows.rows_s, rows.attitudes, time_s, rate)))
    return fresh, tuple(_list_omitted(rows, fresh, FROZEN))


@dataclass(frozen=True, slots=True)
class _ReferenceRows:
    """The N rows of a reference.

    - `windows`: the window of time of each row; `numbers` (N,): the rows' numbers in the file, from 1.
    - `attitudes` (N, 3, 3): rotations from body to table.
    - `rates_rad_s` (N, 3), `std_rad` (N,): the stated rates, and the stated standard deviations of the attitudes; None
      if not stated.
    """

    windows: list[Window]
    attitudes: Array
    rates_rad_s: Array | None
    std_rad: Array | None
    numbers: NDArray[np.intp]

    @property
    def rows_s(self) -> Array:
        return np.array([(window.start_s, window.end_s) for window in self.windows])

    def select(self, rows: NDArray[np.intp]) -> "_ReferenceRows":
        rates, std = (None if values is None else values[rows] for values in (self.rates_rad_s, self.std_rad))
        return _ReferenceRows([self.windows[row] for row in rows], self.attitudes[rows], rates, std, self.numbers[rows])

    def join(self, time_s: Array, readings_rad_s: Array) -> Turning:
        """Return the rows together with a gyroscope's readings (n, 3) at times (n,)."""
        return Turning(time_s, readings_rad_s, self.rows_s, self.attitudes, self.std_rad)


def select_reports(rows: Mapping[str, Array]) -> tuple[dict[str, Array], NDArray[np.intp], tuple[Omitted, ...]]:
    """Return the rows that the reference reported, their numbers in the file, from 1, and the omissions.

    Omitted are rows of zero length whose time a longer row has too, rows of four zeros or without numbers, rows that
    were interpolated between reports, and a few others whose quaternions are no unit quaternions.
    """
    quaternions = np.column_stack([rows[name] for name in QUATERNION])
    with np.errstate(over="ignore"):  # of numbers that are no quaternion's
        lengths = np.linalg.norm(quaternions, axis=1)
    middles_s = (rows["start_s"] + rows["end_s"]) / 2
    lasting = rows["end_s"] != rows["start_s"]
    repeated = ~lasting & np.isin(middles_s, middles_s[lasting])
    absent = ~repeated & ~((lengths > 0) & (lengths < np.inf))
    kept = ~repeated & ~absent
    interpolated = np.zeros(len(kept), dtype=np.bool_)
    interpolated[kept] = find_interpolated(middles_s[kept], quaternions[kept])
    kept &= ~interpolated
    wrong = kept & (np.abs(lengths - 1) > NORM_TOLERANCE)
    wrong &= wrong.sum() <= MAX_WRONG_FRACTION * len(wrong)  # beyond, the file is wrong, not a few of its rows
    kept &= ~wrong
    omitted = tuple(
        Omitted("rows", int(left_out.sum()), len(left_out), reason, f"row {1 + int(np.argmax(left_out))}")
        for left_out, reason in (
            (repeated, "they repeat the time of another attitude"),
            (absent, "their quaternions are zero or no numbers: the reference had no attitude"),
            (interpolated, "they are interpolated between the attitudes that the reference reported"),
            (wrong, "their quaternions are not of unit length"),
        )
        if left_out.any()
    )
    return {name: column[kept] for name, column in rows.items()}, 1 + np.flatnonzero(kept), omitted


def _is_covered(rows_s: Array, time_s: Array) -> NDArray[np.bool_]:
    """Return a mask of the rows (N, 2) that lie within a recording with samples at `time_s` (n,)."""
    within: NDArray[np.bool_] = (rows_s[:, 0] >= time_s[0]) & (rows_s[:, 1] <= time_s[-1])
    return within


def _list_omitted(rows: _ReferenceRows, kept: _ReferenceRows, reason: str) -> Iterator[Omitted]:
    """Yield one entry, with the `reason`, for all rows that are not `kept`; nothing if all are kept."""
    if lost := np.setdiff1d(rows.numbers, kept.numbers).tolist():
        window = rows.windows[rows.numbers.tolist().index(lost[0])]
        yield Omitted("rows", len(lost), len(rows.windows), reason, f"row {lost[0]}, from {window.start_s:.10g} s")


def _rows(time_s: Array, rate: Array, fixes: _ReferenceRows) -> Rows:
    """Return the averages in each row's window, without variances if a row has too few samples to estimate noise."""
    cuts = [rate[inside(time_s, window)] for window in fixes.windows]
    counts = np.array([len(cut) for cut in cuts])
    noise = np.array([scatter_of(cut)[:2] for cut in cuts]) if counts.min() >= MIN_SAMPLES else None
    return Rows(
        np.array([cut.mean(axis=0) for cut in cuts]),
        None if noise is None else noise[:, 0],
        None if noise is None else noise[:, 1],
        counts.astype(np.float64),
        fixes.attitudes,
        fixes.rates_rad_s,
        fixes.std_rad,
    )


def _find_complete(rows: _ReferenceRows, counts: NDArray[np.intp], expected: Array) -> NDArray[np.intp]:
    """Return the indices of the rows whose samples are complete.

    Raise Fault `lost_samples` if no row is complete, or if most long rows lack samples. Short rows are not counted,
    because any gap may cover a whole short row.
    """
    whole = np.array([is_complete(*pair, least=1) for pair in zip(counts.tolist(), expected.tolist(), strict=True)])
    long = expected >= MIN_SAMPLES
    if not whole.any() or 2 * int((long & ~whole).sum()) > int(long.sum()):
        row = int(np.argmin(whole))
        where = f"attitude {rows.numbers[row]}"
        check_complete(int(counts[row]), float(expected[row]), rows.windows[row], where, least=1)
    return np.flatnonzero(whole)


def _check_has_rates(readings: Mapping[Quantity, Array]) -> None:
    if RATE not in readings:
        raise Refused(
            "wrong_columns",
            "the samples contain no turn rate, which is needed to find their clock",
            f"Give {', '.join(RATE.columns)} with them, or write both files by one clock",
        )


def _windows(rows: Mapping[str, Array]) -> list[Window]:
    """Return the window of each row. Raise Fault or Refused for missing, reversed or overlapping rows."""
    if not len(rows["start_s"]):
        raise Fault("too_few_observations", "there is no attitude", "Give a row for every attitude")
    windows = [Window(start_s, end_s) for start_s, end_s in zip(rows["start_s"], rows["end_s"], strict=True)]
    for row, window in enumerate(windows, start=1):
        if window.end_s <= window.start_s:
            raise Refused(
                "bad_attitude_row",
                f"attitude {row} ends before it starts",
                "Give start_s before end_s, on the samples' clock",
            )
    if shared := find_overlap(windows):
        raise Refused(
            "overlapping_attitudes",
            f"attitudes {shared[0]} and {shared[1]} share samples",
            "Give every attitude its own start and end",
        )
    return windows


def _rotations(rows: Mapping[str, Array]) -> Array:
    """Return the rotations (N, 3, 3) of the rows' quaternions. Raise Refused `bad_quaternion`."""
    from scipy.spatial.transform import Rotation

    quaternions = np.column_stack([rows[name] for name in QUATERNION])
    norms = np.linalg.norm(quaternions, axis=1)
    worst = int(np.argmax(np.abs(norms - 1)))
    if abs(norms[worst] - 1) > NORM_TOLERANCE:
        raise Refused(
            "bad_quaternion",
            f"the quaternion of attitude {worst + 1} has the length {norms[worst]:.4g}",
            "Give unit quaternions qw qx qy qz that take body to table coordinates",
        )
    return np.asarray(Rotation.from_quat(quaternions[:, [1, 2, 3, 0]]).as_matrix(), dtype=np.float64)


def _attitude_std(rows: Mapping[str, Array]) -> Array | None:
    """Return the rows' stated standard deviations (N,), rad, or None. Raise Refused for a negative one."""
    std_rad = rows.get(STD_COLUMN)
    if std_rad is not None and (std_rad < 0).any():
        raise Refused(
            "bad_attitude_row",
            f"attitude {int(np.argmin(std_rad)) + 1} has a negative {STD_COLUMN}",
            "Give the standard deviation of the attitude about each axis in rad, 0 if it is exact",
        )
    return std_rad
