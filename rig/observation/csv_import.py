"""Data recorded elsewhere: a CSV file of samples and one of sweeps, solved as the rig solves its own recordings.

samples: as `rig.observation.csv_samples` says, a gyroscope's among them; other sensors' are left alone.

sweeps: `start_s`, `end_s` on the same clock, `axis_x`, `axis_y`, `axis_z` (unit vector of the turn in a frame fixed to
the sensor's carrier, right-handed), and either `speed_rad_s` (mean speed) or `angle_rad` (angle turned from start to
end). A row of speed or angle 0 is a rest; its axis means nothing. Where the table or servo vibrates, let the sweep be a
whole turn: over that its mean speed is 2π/T all the same. It may say how well it is known: `angle_std_rad`, how far the
body may have ended off where it was said to, and `axis_std_rad`, how far the axis may have leaned.

A row with an angle at both ends of which the body lay still is solved by how far the gyroscope turned meanwhile
(`rig.estimation.known_turns`): that is how a hand turns, or a servo that starts and stops.

Columns may stand in any order; the first row holds their names.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from rig.data.motion_file import MOTIONS
from rig.data.quantity import RATE
from rig.errors import Fault, Refused
from rig.estimation.arrays import Array
from rig.estimation.refusals import check_reading_ratio
from rig.observation.average import Average
from rig.observation.csv_samples import Samples
from rig.observation.csv_table import Mapped, read_columns
from rig.observation.csv_windows import average_of, check_complete, check_reads, check_times, overlapping
from rig.observation.observe import Observation, nearest_axis
from rig.observation.turns import Known, TurnedData, turned
from rig.observation.windows import Window, inside

AXIS_COLUMNS = ("axis_x", "axis_y", "axis_z")
STD_COLUMNS = ("angle_std_rad", "axis_std_rad")
MIN_DURATION_S = 1e-3  # so many samples need longer at any rate
LEAST_MOTION = 1e-9  # rad or rad/s: no sweep, and its square might be 0
SWEEPS_MB = 1  # some ten thousand sweeps


@dataclass(frozen=True, slots=True)
class ExternalData:
    """What the two files tell: averaged sweeps and rests, in the order of the rows; `turned` where a body was.

    `at_reference`: taken to one temperature by polynomials, which count what repeats contradict each other by.
    """

    sweeps: tuple[Observation, ...]
    rests: tuple[Average, ...]
    turned: TurnedData | None = None
    at_reference: bool = False


def read_sweeps(path: Path, mapped: Mapped | None = None) -> dict[str, Array]:
    """The columns (k,) of a file of sweeps. Raises Refused `no_file`, `wrong_columns`, `wrong_unit`, `not_a_number`."""
    return read_columns(path, MOTIONS["sweeps"], SWEEPS_MB, mapped)


def averaged(samples: Samples, sweeps: Mapping[str, Array]) -> ExternalData:
    """Samples, a gyroscope's among them, averaged over sweeps, given by the columns of their file.

    Raises Refused `time_not_increasing`, `bad_sweep`, `overlapping_sweeps`; Fault as `average` does, `stuck_sensor`.
    """
    check_reads(samples.readings[RATE], RATE)
    found = average(
        np.column_stack([samples.time_s, samples.readings[RATE]]),
        np.column_stack([sweeps["start_s"], sweeps["end_s"], _speeds(sweeps)]),
        np.column_stack([sweeps[name] for name in AXIS_COLUMNS]),
        samples.temperature_c,
    )
    if "angle_rad" not in sweeps:
        return found
    known = Known(sweeps["angle_rad"], *(sweeps.get(name) for name in STD_COLUMNS))
    return replace(found, turned=turned(samples.time_s, samples.readings[RATE], known, found.sweeps, found.rests))


def average(samples: Array, sweeps: Array, axes: Array, temperature_c: Array | None = None) -> ExternalData:
    """Samples (n, 4) = [time_s, x, y, z] averaged over sweeps (k, 3) = [start_s, end_s, speed_rad_s] about axes (k, 3).

    `temperature_c` (n,) is how warm it was at each sample, None where nothing tells that.
    Raises Refused `time_not_increasing`, `overlapping_sweeps`; Fault `too_few_observations`, `lost_samples`,
    `wrong_unit`.
    """
    time_s, readings = samples[:, 0], samples[:, 1:]
    check_times(time_s)
    if not len(sweeps):
        raise Fault("too_few_observations", "there is no sweep", "Give a row for every sweep and every rest")
    windows = [Window(start_s, end_s) for start_s, end_s in sweeps[:, :2].tolist()]
    if shared := overlapping(windows):
        raise Refused(
            "overlapping_sweeps",
            f"sweeps {shared[0]} and {shared[1]} share samples",
            "Give every sweep once, with its own start and end",
        )
    interval_s = float(np.median(np.diff(time_s)))
    turns, rests = [], []
    for row, (window, speed) in enumerate(zip(windows, sweeps[:, 2].tolist(), strict=True), start=1):
        within = inside(time_s, window)
        cut = readings[within]
        check_complete(len(cut), window, interval_s, f"sweep {row}")
        mean = average_of(cut, window)
        if temperature_c is not None:
            mean = replace(mean, temperature_c=float(temperature_c[within].mean()))
        if speed == 0:
            rests.append(mean)
        else:
            turns.append(_observation(row, mean, speed, axes[row - 1]))
    _check_unit(turns)
    return ExternalData(tuple(turns), tuple(rests))


def _speeds(sweeps: Mapping[str, Array]) -> Array:
    """Mean speeds (k,), from whichever of the two columns there is. Raises Refused `bad_sweep`."""
    durations = sweeps["end_s"] - sweeps["start_s"]
    by_angle = "angle_rad" in sweeps
    motion = sweeps["angle_rad" if by_angle else "speed_rad_s"]
    norms = np.linalg.norm(np.column_stack([sweeps[name] for name in AXIS_COLUMNS]), axis=1)
    for row, (duration, moved, norm) in enumerate(zip(durations, motion, norms, strict=True), start=1):
        what = None
        if duration <= 0:
            what = "ends before it starts"
        elif duration < MIN_DURATION_S:
            what = f"lasts {duration:g} s, which is no time to sweep"
        elif moved < 0:
            what = "turns by less than nothing"
        elif 0 < moved < LEAST_MOTION:
            what = f"turns by {moved:.0e}, which is nothing, and a rest has 0"
        elif moved > 0 and abs(norm - 1) > 1e-3:
            what = f"has an axis of length {norm:.3g}"
        elif any(sweeps[name][row - 1] <= 0 for name in STD_COLUMNS if name in sweeps and moved > 0):
            what = "is said to be known exactly"
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


def _check_unit(turns: Sequence[Observation]) -> None:
    """Readings counted from their mean, which takes the bias out, must be about as large as the speeds."""
    if len(turns) < 2:
        return
    means = np.array([turn.average.mean_rad_s for turn in turns])
    turned = np.sqrt(np.mean(np.sum((means - means.mean(axis=0)) ** 2, axis=1)))
    check_reading_ratio(float(turned / np.sqrt(np.mean([turn.speed_rad_s**2 for turn in turns]))), "the sweeps")
