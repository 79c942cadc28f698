"""Which rows of a table of sweeps are turns from rest to rest, and which sweeps at a speed that had been reached.

The first are solved by how far the gyroscope turned, whatever its speed on the way was; the others by their mean.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rig.data.quantity import RATE
from rig.estimation.arrays import Array
from rig.estimation.gyroscope.known_turns import Gyroscope, Mean, Turn
from rig.observation.arm_rests import estimate_bias_drift
from rig.observation.average import Average
from rig.observation.by_hand.rests import find_rests
from rig.observation.external.csv_windows import average_of
from rig.observation.observe import Observation
from rig.observation.sampling import find_sampling
from rig.observation.windows import Window, inside

REACH_S = 0.5  # between a turn's end, as somebody marked it, and the rest that it belongs to
EDGE_SAMPLES = 2  # either side of an end
STANDING = 0.25  # of the mean speed: what turns slower at both ends had stood still
BY_HAND_ANGLE_RAD = float(np.radians(0.3))  # how well a hand brings a body back against its stop, where nobody says
BY_HAND_AXIS_RAD = 0.02  # how far it leans on the way


@dataclass(frozen=True, slots=True)
class TurnedData:
    """What is solved by increments: the gyroscope, the turns, by the rows' numbers, and the means beside them.

    `noise_freedom`, `bias_freedom`: with how many degrees of freedom the rests tell its noise, and how its bias
    differs between them.
    """

    gyroscope: Gyroscope
    turns: tuple[Turn, ...]
    rows: tuple[int, ...]
    means: tuple[Mean, ...]
    noise_freedom: int
    bias_freedom: int


@dataclass(frozen=True, slots=True)
class Known:
    """What the table says of row after row (k,): `angle_rad`, and how well angle and axis are known, or None."""

    angle_rad: Array
    angle_std_rad: Array | None
    axis_std_rad: Array | None


def turned(
    time_s: Array, readings: Array, known: Known, sweeps: Sequence[Observation], rests: Sequence[Average]
) -> TurnedData | None:
    """The turns from rest to rest among sweeps; None where there are none. `readings` (n, 3) in rad/s at `time_s`."""
    lying = find_rests(time_s, {RATE: readings}, lying=_between_all(time_s, sweeps))
    if not lying:
        return None
    resting = rests or [average_of(readings[inside(time_s, window)], window) for window in lying]
    bias = np.median([rest.mean_rad_s for rest in resting], axis=0)
    rates = readings - bias
    turns, rows, means = [], [], [Mean(rest.mean_rad_s, rest.variance_rad2_s2, np.zeros(3)) for rest in resting]
    for sweep in sweeps:
        row = sweep.sweep - 1
        window = _between(sweep, lying)
        if window is None or not _stood(time_s, rates, sweep):
            average = sweep.average
            means.append(Mean(average.mean_rad_s, average.variance_rad2_s2, sweep.speed_rad_s * sweep.axis_flange))
            continue
        angle_std = BY_HAND_ANGLE_RAD if known.angle_std_rad is None else float(known.angle_std_rad[row])
        axis_std = BY_HAND_AXIS_RAD if known.axis_std_rad is None else float(known.axis_std_rad[row])
        angle = float(known.angle_rad[row])
        turns.append(Turn(window.start_s, window.end_s, sweep.axis_flange, angle, angle_std, axis_std))
        rows.append(sweep.sweep)
    if not turns:
        return None
    interval_s = find_sampling(time_s).interval_s
    noise = np.sqrt(np.mean([np.square(rest.noise_rad_s) for rest in resting]) * interval_s)
    gyroscope = Gyroscope(time_s, readings, float(noise), np.sqrt(estimate_bias_drift(resting)))
    samples = sum(rest.samples - 1 for rest in resting)
    return TurnedData(gyroscope, tuple(turns), tuple(rows), tuple(means), samples, max(len(resting) - 1, 1))


def _between_all(time_s: Array, sweeps: Sequence[Observation]) -> list[Window]:
    """The time that no sweep takes: nowhere else is the body said to lie still."""
    taken = sorted((each.average.start_s, each.average.end_s) for each in sweeps)
    starts = [float(time_s[0]), *(end_s for _, end_s in taken)]
    ends = [*(start_s for start_s, _ in taken), float(time_s[-1])]
    return [Window(start_s, end_s) for start_s, end_s in zip(starts, ends, strict=True) if end_s > start_s]


def _between(sweep: Observation, lying: Sequence[Window]) -> Window | None:
    """The time from the end of the rest before a sweep to the beginning of the one after, where both are near."""
    start_s, end_s = sweep.average.start_s, sweep.average.end_s
    before = [rest for rest in lying if rest.start_s < start_s and rest.end_s >= start_s - REACH_S]
    after = [rest for rest in lying if rest.end_s > end_s and rest.start_s <= end_s + REACH_S]
    if not before or not after or before[-1] is after[0]:
        return None
    return Window(min(before[-1].end_s, start_s), max(after[0].start_s, end_s))


def _stood(time_s: Array, rates: Array, sweep: Observation) -> bool:
    """Whether it hardly turned at either end of a row: there, nobody had cut it out of a longer turn."""
    for at_s in (sweep.average.start_s, sweep.average.end_s):
        there = int(np.searchsorted(time_s, at_s))
        around = rates[max(there - EDGE_SAMPLES, 0) : there + EDGE_SAMPLES]
        if np.linalg.norm(around.mean(axis=0)) > STANDING * sweep.speed_rad_s:
            return False
    return True
