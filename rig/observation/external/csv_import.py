"""External data: a CSV file of samples and one of sweeps, solved like the rig's own recordings.

The file of samples is that of `rig.observation.external.csv_samples`; only a gyroscope's samples are used.

The file of sweeps has `start_s`, `end_s` on the same clock, `axis_x`, `axis_y`, `axis_z` (unit vector of the turn in a
frame fixed to the sensor's carrier, right-handed), and either `speed_rad_s` (mean speed) or `angle_rad` (angle turned
from start to end). A row with the speed or angle 0 is a rest, without an axis. If the table or servo vibrates, a sweep
should be a whole turn, whose mean speed is 2π/T in spite of it. Standard deviations may be given: `angle_std_rad` of
the angle reached, and `axis_std_rad` of the direction of the axis.

If a row states an angle, and the body is at rest before and after it, the solution compares the stated angle with the
integral of the gyroscope's readings (`rig.estimation.gyroscope.rotations_by_angle`).

Columns may have any order; the first row holds their names.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from rig.data.quantity import RATE
from rig.data.recording.motion_file import MOTIONS
from rig.errors import Fault, Refused
from rig.estimation.arrays import Array
from rig.estimation.external.abrupt_change import AbruptChange
from rig.estimation.external.row_changes import find_row_change
from rig.estimation.refusals import check_reading_ratio
from rig.observation.average import Average
from rig.observation.external.csv_samples import Samples
from rig.observation.external.csv_windows import (
    RowGaps,
    average_bridged,
    check_complete,
    check_overlap,
    check_scattered,
    check_times,
    find_overlap,
    find_row_gaps,
    is_losing,
)
from rig.observation.external.omission import Omitted
from rig.observation.external.turns import DeclaredTurns, TurnedData, find_turns
from rig.observation.false_readings import check_frozen, check_unclipped
from rig.observation.formats.column_selection import MappedColumns
from rig.observation.formats.csv_table import read_columns
from rig.observation.observe import Observation, nearest_axis
from rig.observation.stuck_check import check_reads
from rig.observation.time_stamps.sampling import find_sampling
from rig.observation.windows import Window, inside

AXIS_COLUMNS = ("axis_x", "axis_y", "axis_z")
STD_COLUMNS = ("angle_std_rad", "axis_std_rad")
MIN_DURATION_S = 1e-3  # the fewest samples take longer at any data rate
# Cosine between two axes, and between their readings; least reading relative to a sweep's speed.
SAME_AXIS_COSINE, OPPOSITE_COSINE, ACROSS_COSINE, MIN_READING_RATIO = 0.9, -0.5, 0.5, 0.25
ROUNDING_RATIO = 1e-12  # scatter relative to the mean that is rounding
QUARTER_DEG = 90.0
MIN_MOTION = 1e-9  # rad or rad/s: a smaller motion is no sweep, and its square might underflow
SWEEPS_MB = 1  # some ten thousand sweeps


@dataclass(frozen=True, slots=True)
class ExternalData:
    """Averages of samples over the sweeps and rests of a file, in the order of its rows, and turns with a stated angle.

    - `at_reference`: whether polynomials have corrected the means to one temperature. The polynomials' uncertainty then
      includes the differences between repeated measurements, so checks of these differences are omitted.
    - `by_mean`: the numbers, from 1, of rows solved from the mean speed, not the angle, because the body moved before
      or after.
    - `omitted`: rows left out for missing readings, and the readings that are missing in the other rows.
    - `change`: an abrupt change of the gyroscope that the rows show.
    """

    sweeps: tuple[Observation, ...]
    rests: tuple[Average, ...]
    turned: TurnedData | None = None
    at_reference: bool = False
    by_mean: tuple[int, ...] = ()
    omitted: tuple[Omitted, ...] = ()
    change: AbruptChange | None = None

    @property
    def all_rests(self) -> tuple[Average, ...]:
        """The stated rests; if there are turns, also the rests found between them."""
        return self.rests if self.turned is None else self.turned.rests


def read_sweeps(path: Path, mapped: MappedColumns | None = None, origin_s: int = 0) -> dict[str, Array]:
    """Return the columns (k,) of a file of sweeps, with times that count from `origin_s`.

    Raise Refused `no_file`, `wrong_columns`, `wrong_unit`, `not_a_number`.
    """
    return read_columns(path, MOTIONS["sweeps"], SWEEPS_MB, mapped, origin_s)


def average_sweeps(samples: Samples, sweeps: Mapping[str, Array]) -> ExternalData:
    """Return the averages of the gyroscope's samples over the `sweeps`, which are the columns of their file.

    Raise Refused `bad_sweep`, `overlapping_sweeps`; Fault `stuck_sensor`; and as `check_times` and `average` do.
    """
    check_reads(samples.readings[RATE], RATE)
    check_frozen(samples.time_s, samples.readings[RATE])
    windows = [Window(*row) for row in np.column_stack([sweeps["start_s"], sweeps["end_s"]]).tolist()]
    check_unclipped(samples.time_s, samples.readings[RATE], windows)
    data = average(
        np.column_stack([samples.time_s, samples.readings[RATE]]),
        np.column_stack([sweeps["start_s"], sweeps["end_s"], _speeds(sweeps)]),
        np.column_stack([sweeps[name] for name in AXIS_COLUMNS]),
        samples.temperature_c,
    )
    if "angle_rad" in sweeps:
        data = _add_turns(samples, sweeps, data)
    return replace(data, change=_find_change(data))


def _add_turns(samples: Samples, sweeps: Mapping[str, Array], data: ExternalData) -> ExternalData:
    """Return the data with its turns, which are rows with a stated angle that start and end at rest.

    The numbers of the other rows with a sweep are added to `by_mean`, or to `omitted` if missing readings may hide a
    part of the turn.
    """
    declared = DeclaredTurns(sweeps["angle_rad"], *(sweeps.get(name) for name in STD_COLUMNS))
    by_angle = find_turns(samples.time_s, samples.readings[RATE], declared, data.sweeps, data.rests)
    if by_angle is None:
        return replace(data, by_mean=tuple(sweep.sweep for sweep in data.sweeps))
    by_mean = tuple(sweep.sweep for sweep in data.sweeps if sweep.sweep not in (*by_angle.rows, *by_angle.hiding))
    return replace(data, turned=by_angle, by_mean=by_mean, omitted=(*_list_hiding(by_angle, data), *data.omitted))


def _find_change(data: ExternalData) -> AbruptChange | None:
    """Return the abrupt change of the gyroscope that the rows show, None if they show none."""
    averages, rates_rad_s = stack_rows(data.sweeps, data.all_rests)
    starts_s = np.array([average.start_s for average in averages])
    order = np.argsort(starts_s, kind="stable")
    return find_row_change(
        np.array([average.mean_rad_s for average in averages])[order],
        np.array([average.variance_rad2_s2 for average in averages])[order],
        rates_rad_s[order],
        starts_s[order],
        (RATE.steady, 10 * RATE.steady),
    )


def stack_rows(sweeps: Sequence[Observation], rests: Sequence[Average]) -> tuple[list[Average], Array]:
    """Return N averages, of the sweeps and then of the rests, and their stated rates (N, 3) in rad/s, zero at rest."""
    rates_rad_s = [sweep.speed_rad_s * sweep.axis_flange for sweep in sweeps]
    return [*(sweep.average for sweep in sweeps), *rests], np.array([*rates_rad_s, *np.zeros((len(rests), 3))])


def _list_hiding(by_angle: TurnedData, data: ExternalData) -> Iterator[Omitted]:
    """Yield an entry for the turns, if any, that are left out because missing readings may hide a part of them."""
    if by_angle.hiding:
        first = next(sweep for sweep in data.sweeps if sweep.sweep in by_angle.hiding)
        where = f"row {first.sweep}, from {first.average.start_s:.10g} s"
        reason = "lost_samples: the missing readings may contain a part of the turn"
        yield Omitted("rows", len(by_angle.hiding), len(data.sweeps), reason, where)


def average(samples: Array, sweeps: Array, axes: Array, temperature_c: Array | None = None) -> ExternalData:
    """Return the averages of samples (n, 4) over sweeps (k, 3) about axes (k, 3).

    A sample is [time_s, x, y, z], a sweep [start_s, end_s, speed_rad_s]. `temperature_c` (n,) is each sample's
    temperature, None without a thermometer. Raise Refused `time_not_increasing`, `too_few_samples`,
    `overlapping_sweeps`, `bad_sweep`; Fault `too_few_observations`, `clocks_apart`, `lost_samples`, `wrong_unit`.
    """
    time_s, readings = samples[:, 0], samples[:, 1:]
    check_times(time_s)
    if not len(sweeps):
        raise Fault("too_few_observations", "there is no sweep", "Give a row for every sweep and every rest")
    windows = [Window(start_s, end_s) for start_s, end_s in sweeps[:, :2].tolist()]
    if shared := find_overlap(windows):
        raise Refused(
            "overlapping_sweeps",
            f"sweeps {shared[0]} and {shared[1]} share samples",
            "Give every sweep once, with its own start and end",
        )
    check_overlap(time_s, windows)
    sampling = find_sampling(time_s)
    check_scattered(sampling)
    rows = find_row_gaps(time_s, readings, sampling, windows)
    kept = [row.is_usable for row in rows]
    if 2 * sum(kept) < len(kept) or is_losing(rows):
        for row, (gaps, window) in enumerate(zip(rows, windows, strict=True), start=1):
            check_complete(gaps.count, gaps.expected, window, f"sweep {row}")
    turns = []
    rests = []
    for row, (window, speed, gaps) in enumerate(zip(windows, sweeps[:, 2].tolist(), rows, strict=True), start=1):
        within = inside(time_s, window)
        if not gaps.is_usable:
            continue
        mean = average_bridged(readings[within], sampling.numbers[within], window, gaps.hidden_rad)
        _check_noisy(mean, row)
        if temperature_c is not None:
            mean = replace(mean, temperature_c=float(temperature_c[within].mean()))
        if speed == 0:
            rests.append(mean)
        else:
            turns.append(_observation(row, mean, speed, axes[row - 1]))
    _check_unit(turns)
    _check_directions(turns, rests)
    return ExternalData(tuple(turns), tuple(rests), omitted=tuple(_list_omitted(rows, windows)))


def _list_omitted(rows: Sequence[RowGaps], windows: Sequence[Window]) -> Iterator[Omitted]:
    """Yield entries for the rows left out, and one for the readings that are missing in the other rows."""
    omitted = [(number, row) for number, row in enumerate(rows, start=1) if not row.is_usable]
    for is_inside, reason in (
        (False, "not covered by the recording"),
        (True, "lost_samples: the missing readings may contain a change of the rate"),
    ):
        if of_reason := [(number, row) for number, row in omitted if row.is_inside == is_inside]:
            number, row = of_reason[0]
            start_s = windows[number - 1].start_s if row.first_s is None else row.first_s
            yield Omitted("rows", len(of_reason), len(rows), reason, f"row {number}, at {start_s:.10g} s")
    usable = [(number, row) for number, row in enumerate(rows, start=1) if row.is_usable]
    if missing := sum(row.missing for _, row in usable):
        number, row = next((number, row) for number, row in usable if row.missing)
        total = missing + sum(row.count for _, row in usable)
        where = f"after {row.first_s:.10g} s, in row {number}"
        yield Omitted("readings", missing, total, "lost_samples: they are missing", where)


def _speeds(sweeps: Mapping[str, Array]) -> Array:
    """Return mean speeds (k,) from the column of speeds or angles. Raise Refused `bad_sweep`, `wrong_unit`."""
    durations = sweeps["end_s"] - sweeps["start_s"]
    by_angle = "angle_rad" in sweeps
    motion = sweeps["angle_rad" if by_angle else "speed_rad_s"]
    norms = np.linalg.norm(np.column_stack([sweeps[name] for name in AXIS_COLUMNS]), axis=1)
    if by_angle and (moved_rad := motion[motion > 0]).any() and not (moved_rad % QUARTER_DEG).any():
        raise Refused(
            "wrong_unit",
            f"angle_rad is {moved_rad[0]:g} in row {int(np.argmax(motion > 0)) + 1}, and a whole multiple of "
            f"{QUARTER_DEG:g} in every row: these are degrees",
            "Give radians, or name the column's unit with --columns (unit: deg); for a turn of so many radians, give "
            "speed_rad_s",
        )
    for row, (duration, moved, norm) in enumerate(zip(durations, motion, norms, strict=True), start=1):
        what = None
        if duration <= 0:
            what = "ends before it starts"
        elif duration < MIN_DURATION_S:
            what = f"lasts {duration:g} s, which is too short for a sweep"
        elif moved < 0:
            what = "turns by a negative amount"
        elif 0 < moved < MIN_MOTION:
            what = f"turns by {moved:.0e}, which is too little; a rest has 0"
        elif moved > 0 and abs(norm - 1) > 1e-3:
            what = f"has an axis of length {norm:.3g}"
        elif any(sweeps[name][row - 1] <= 0 for name in STD_COLUMNS if name in sweeps and moved > 0):
            what = "is stated to be known exactly"
        if what:
            raise Refused(
                "bad_sweep",
                f"sweep {row} {what}",
                "Give start before end, a positive speed or angle, and the direction of the turn as a unit vector; "
                "standard deviations above zero",
            )
    return np.asarray(motion / durations if by_angle else motion, dtype=np.float64)


def _observation(row: int, mean: Average, speed_rad_s: float, axis: Array) -> Observation:
    name, sign = nearest_axis(axis)
    return Observation(
        sweep=row,
        joint_name=None,
        direction=None,
        axis=name,
        sign=sign,
        axis_flange=axis,
        speed_rad_s=speed_rad_s,
        speed_std_rad_s=0.0,
        lost=0,
        average=mean,
    )


def _check_noisy(mean: Average, row: int) -> None:
    """Raise Fault `stuck_sensor` if an axis has one value in a whole row, so that no scatter shows the mean's error."""
    quiet = np.flatnonzero(mean.noise_rad_s <= ROUNDING_RATIO * np.abs(mean.mean_rad_s))
    if len(quiet):
        axis = int(quiet[0])
        raise Fault(
            "stuck_sensor",
            f"in row {row}, from {mean.start_s:.6g} to {mean.end_s:.6g} s, the gyroscope always reads "
            f"{mean.mean_rad_s[axis]:.6g} rad/s on {RATE.axes[axis]}: it is stuck, at the end of its range, or too "
            "coarse to show its noise",
            "Check its supply, its bus wires and its range; record with all digits",
        )


def _check_unit(turns: Sequence[Observation]) -> None:
    """Raise Fault `wrong_unit` if readings minus their mean (the bias) differ in size from the speeds."""
    if len(turns) < 2:
        return
    means = np.array([turn.average.mean_rad_s for turn in turns])
    rms_rad_s = np.sqrt(np.mean(np.sum((means - means.mean(axis=0)) ** 2, axis=1)))
    check_reading_ratio(float(rms_rad_s / np.sqrt(np.mean([turn.speed_rad_s**2 for turn in turns]))), "the sweeps")


def _check_directions(turns: Sequence[Observation], rests: Sequence[Average]) -> None:
    """Raise Refused `bad_sweep` if the readings of two sweeps about one axis contradict the stated directions."""
    if len(turns) < 2:
        return
    means = np.array([turn.average.mean_rad_s for turn in turns])
    rates = means - np.mean([rest.mean_rad_s for rest in rests] if rests else means, axis=0)
    sizes = np.linalg.norm(rates, axis=1)
    axes = np.array([turn.axis_flange for turn in turns])
    sensed = sizes > MIN_READING_RATIO * np.array([turn.speed_rad_s for turn in turns])
    cosines = axes @ axes.T
    agreement = np.sign(cosines) * (rates @ rates.T) / np.maximum(np.outer(sizes, sizes), np.finfo(float).tiny)
    alike = (np.abs(cosines) > SAME_AXIS_COSINE) & np.outer(sensed, sensed)
    contradicting = alike & (agreement < OPPOSITE_COSINE)
    if rests and (across := np.argwhere(alike & (agreement < ACROSS_COSINE) & ~contradicting)).size:
        one, other = across[0].tolist()
        raise Refused(
            "bad_sweep",
            f"sweeps {turns[one].sweep} and {turns[other].sweep} state the same axis, but the body turned about "
            "different ones",
            "Look at the axes in their rows and in those around them, and at start and end",
        )
    if contradicting.any():
        worst = int(np.argmax(contradicting.sum(axis=1)))
        others = np.flatnonzero(contradicting[worst])
        what = f"sweep {turns[worst].sweep} has the opposite sign to the others about its axis"
        if len(others) == 1:
            both = sorted((turns[worst].sweep, turns[int(others[0])].sweep))
            what = f"sweeps {both[0]} and {both[1]} have the opposite sign to what their axes state"
        raise Refused("bad_sweep", what, "Look at the sign of the axis in their rows, and at start and end")
