"""Data recorded elsewhere: a CSV file of samples and one of sweeps, solved as the rig solves its own recordings.

samples: `time_s`, `x_rad_s`, `y_rad_s`, `z_rad_s`. The gyroscope's readings; the time must increase.

sweeps: `start_s`, `end_s` on the same clock, `axis_x`, `axis_y`, `axis_z` (unit vector of the turn in a frame fixed to
the sensor's carrier, right-handed), and either `speed_rad_s` (mean speed) or `angle_rad` (angle turned from start to
end). A row of speed or angle 0 is a rest; its axis means nothing. Where the table or servo vibrates, let the sweep be a
whole turn: over that its mean speed is 2π/T all the same.

Columns may stand in any order; the first row holds their names.
"""

import csv
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from rig.errors import Fault, Refused
from rig.observation.average import Average
from rig.observation.observe import Observation
from rig.observation.timebase import widening

Array = NDArray[np.float64]

SAMPLE_COLUMNS = ("time_s", "x_rad_s", "y_rad_s", "z_rad_s")
SWEEP_COLUMNS = ("start_s", "end_s", "axis_x", "axis_y", "axis_z")
MOTION_COLUMNS = ("speed_rad_s", "angle_rad")
MIN_SAMPLES = 20
MAX_LOST_FRACTION = 0.01
MAX_READING_RATIO = 4.0  # reading over turn rate, either way: no gyroscope is that far off, a wrong unit is


@dataclass(frozen=True, slots=True)
class ExternalData:
    """What the two files tell: averaged sweeps and rests, in the order of the rows."""

    sweeps: tuple[Observation, ...]
    rests: tuple[Average, ...]


def read(samples_path: Path, sweeps_path: Path) -> ExternalData:
    """Read and average both files.

    Raises Refused `no_file`, `wrong_columns`, `wrong_unit`, `not_a_number`, `time_not_increasing`, `bad_sweep`,
    `overlapping_sweeps`; Fault `lost_samples`.
    """
    samples = _read(samples_path, SAMPLE_COLUMNS, ())
    sweeps = _read(sweeps_path, SWEEP_COLUMNS, MOTION_COLUMNS)
    return average(
        np.column_stack([samples[name] for name in SAMPLE_COLUMNS]),
        np.column_stack([sweeps["start_s"], sweeps["end_s"], _speeds(sweeps)]),
        np.column_stack([sweeps[name] for name in SWEEP_COLUMNS[2:]]),
    )


def average(samples: Array, sweeps: Array, axes: Array) -> ExternalData:
    """Average samples (n, 4) = [time_s, x, y, z] over sweeps (k, 3) = [start_s, end_s, speed_rad_s] about `axes`."""
    time_s, readings = samples[:, 0], samples[:, 1:]
    if len(time_s) < MIN_SAMPLES or not (np.diff(time_s) > 0).all():
        raise Refused(
            "time_not_increasing",
            "the samples are too few, or their time_s does not increase from row to row",
            "Give every sample once, in the order of time, on one clock",
        )
    _check_overlap(sweeps)
    interval_s = float(np.median(np.diff(time_s)))
    turns, rests = [], []
    for row, (start_s, end_s, speed) in enumerate(sweeps, start=1):
        inside = slice(*np.searchsorted(time_s, [start_s, end_s]).tolist())
        mean = _average(readings[inside], end_s - start_s, interval_s, row)
        if speed == 0:
            rests.append(mean)
        else:
            turns.append(_observation(row, mean, speed, axes[row - 1]))
    _check_unit(turns)
    return ExternalData(tuple(turns), tuple(rests))


def _read(path: Path, columns: Sequence[str], alternatives: Sequence[str]) -> dict[str, Array]:
    """The columns of a file by name: all of `columns`, and exactly one of `alternatives` if there are any."""
    try:
        with path.open(newline="", encoding="utf-8-sig") as file:
            header, *rows = list(csv.reader(file)) or [[]]
    except (OSError, UnicodeDecodeError) as error:
        raise Refused("no_file", f"{path} cannot be read: {error}", "Give a CSV file") from error
    names = [name.strip() for name in header]
    _check_columns(path, names, columns, alternatives)
    values = np.empty((len(rows), len(names)))
    for line, row in enumerate(rows):
        try:
            values[line] = [float(cell) for cell in row]
        except ValueError:
            values[line] = np.nan
        if not np.isfinite(values[line]).all():
            raise Refused(
                "not_a_number",
                f"{path}, line {line + 2}: {','.join(row)!r} is not {len(names)} finite numbers",
                "Write plain decimal numbers with a point, no NaN, one for each column",
            )
    return {name: values[:, i] for i, name in enumerate(names)}


def _check_columns(path: Path, names: Sequence[str], columns: Sequence[str], alternatives: Sequence[str]) -> None:
    known = (*columns, *alternatives)
    by_quantity = {name.split("_")[0]: name for name in known if not name.startswith("axis")}
    for name in names:
        meant = by_quantity.get(name.split("_")[0], name)
        if name not in known and meant not in (name, *names):
            raise Refused(
                "wrong_unit",
                f"{path} has a column {name} where {meant} belongs",
                f"Convert it to the unit that the name {meant} carries",
            )
    problems = [f"lacks {name}" for name in columns if name not in names]
    problems += [f"has the unknown {name}" for name in names if name not in known]
    problems += [f"names {name} twice" for name in known if names.count(name) > 1]
    given = [name for name in names if name in alternatives]
    if alternatives and len(set(given)) != 1:
        problems.append(f"has {' and '.join(given) or 'none'} of {', '.join(alternatives)}")
    if problems:
        wanted = ", ".join(columns) + (f" and one of {', '.join(alternatives)}" if alternatives else "")
        raise Refused("wrong_columns", f"{path} {', '.join(problems)}", f"Its first row must name {wanted}")


def _speeds(sweeps: dict[str, Array]) -> Array:
    """Mean speeds (k,), from whichever of the two columns there is. Raises Refused `bad_sweep`."""
    durations = sweeps["end_s"] - sweeps["start_s"]
    motion = sweeps.get("speed_rad_s", sweeps.get("angle_rad"))
    assert motion is not None
    norms = np.linalg.norm(np.column_stack([sweeps[name] for name in SWEEP_COLUMNS[2:]]), axis=1)
    for row, (duration, moved, norm) in enumerate(zip(durations, motion, norms, strict=True), start=1):
        what = None
        if duration <= 0:
            what = "ends before it starts"
        elif moved < 0:
            what = "turns by less than nothing"
        elif moved > 0 and abs(norm - 1) > 1e-3:
            what = f"has an axis of length {norm:.3g}"
        if what:
            raise Refused(
                "bad_sweep",
                f"sweep {row} {what}",
                "Give start before end, a positive speed or angle, and the direction of the turn as a unit vector",
            )
    return np.asarray(motion / durations if "angle_rad" in sweeps else motion, dtype=np.float64)


def _check_overlap(sweeps: Array) -> None:
    order = np.argsort(sweeps[:, 0])
    late = np.flatnonzero(sweeps[order[1:], 0] < sweeps[order[:-1], 1])
    if len(late):
        first, second = int(order[late[0]]) + 1, int(order[late[0] + 1]) + 1
        raise Refused(
            "overlapping_sweeps",
            f"sweeps {first} and {second} share samples",
            "Give every sweep once, with its own start and end",
        )


def _average(readings: Array, duration_s: float, interval_s: float, row: int) -> Average:
    """Mean and its variance, from the scatter about the mean; vibration counts as noise here, for no arm reports it."""
    count, expected = len(readings), duration_s / interval_s
    if count < MIN_SAMPLES or count < (1 - MAX_LOST_FRACTION) * expected - 1:
        raise Fault(
            "lost_samples",
            f"sweep {row} has {count} samples where {expected:.0f} belong",
            "Check that both files use one clock in seconds, and that no samples are missing",
        )
    variance = readings.var(axis=0, ddof=1)
    wider = np.array([widening(readings[:, axis] - readings[:, axis].mean()) for axis in range(3)])
    return Average(
        mean_rad_s=readings.mean(axis=0),
        variance_rad2_s2=variance * wider / count,
        noise_rad_s=np.sqrt(variance),
        samples=count,
        duration_s=duration_s,
        temperature_c=float("nan"),
    )


def _observation(row: int, mean: Average, speed_rad_s: float, axis: Array) -> Observation:
    nearest = int(np.argmax(np.abs(axis)))
    return Observation(
        sweep=row,
        joint_name="external",
        direction="",
        axis="xyz"[nearest],
        sign=1 if axis[nearest] > 0 else -1,
        axis_flange=axis,
        speed_rad_s=float(speed_rad_s),
        speed_std_rad_s=0.0,
        lost=0,
        average=mean,
    )


def _check_unit(turns: Sequence[Observation]) -> None:
    """Readings counted from their mean, which takes the bias out, must be about as large as the speeds."""
    if not turns:
        return
    means = np.array([turn.average.mean_rad_s for turn in turns])
    turned = np.sqrt(np.mean(np.sum((means - means.mean(axis=0)) ** 2, axis=1)))
    ratio = float(turned / np.sqrt(np.mean([turn.speed_rad_s**2 for turn in turns])))
    if ratio > MAX_READING_RATIO:
        raise Refused(
            "wrong_unit",
            f"the gyroscope reads {ratio:.3g} times the turn rate; degrees per second would make it 57",
            "Convert readings, speeds and angles to radians",
        )
    if len(turns) > 1 and ratio < 1 / MAX_READING_RATIO:
        raise Refused(
            "wrong_unit",
            f"the gyroscope reads {ratio:.3g} times the turn rate; speeds in degrees per second would make it 0.017",
            "Convert speeds and angles to radians; if they are, the readings do not change with the turn's direction",
        )
