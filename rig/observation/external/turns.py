"""Turns from rest to rest among the rows of a table of sweeps; the other rows are sweeps at a constant speed.

For a turn the solution compares the stated angle with the integral of the readings, so the speed may vary; for a sweep
it compares mean rates. Readings are integrated from the rest before a turn to the rest after it.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from rig.data.quantity import RATE
from rig.estimation.arrays import Array
from rig.estimation.gyroscope.rotations_by_angle import Gyroscope, RateMean, Turn
from rig.observation.arm_rests import estimate_bias_drift
from rig.observation.average import Average
from rig.observation.by_hand.rests import find_rests
from rig.observation.external.csv_windows import average_of
from rig.observation.external.means_at_rest import find_rests_at_other_bias
from rig.observation.observe import Observation
from rig.observation.time_stamps.gaps import hidden_angles_rad
from rig.observation.time_stamps.sampling import find_sampling
from rig.observation.windows import Window, inside

MAX_REST_DISTANCE_S = 0.5  # between the marked end of a turn and the adjacent rest
EDGE_SAMPLES = 2  # samples on either side of an end
STANDING_SPEED_RATIO = 0.25  # to the mean speed, below which the body starts or stops at an end of the turn
MAX_BIAS_RAD_S = 0.1  # a body whose readings in a pause exceed this rate is turning
MAX_HIDDEN_RAD = 0.02  # by missing readings of a turn
BY_HAND_ANGLE_RAD = float(np.radians(0.3))  # default repeatability of a body turned by hand to a stop
BY_HAND_AXIS_RAD = 0.02  # default tilt during the turn


@dataclass(frozen=True, slots=True)
class TurnedData:
    """The input of a solution by increments.

    - `gyroscope`: the gyroscope's readings; `turns`: the turns from rest to rest, with the numbers `rows` in the file.
    - `means`: the mean readings in the rests, and in those rows that do not start and end at rest.
    - `noise_dof`, `bias_dof`: degrees of freedom of the estimated noise, and of the estimated change of the bias from
      rest to rest.
    - `rests`: the rests that the file states or the readings show, also those in which the bias had changed.
    - `hiding`: numbers of omitted rows, in which missing readings may hide a part of the turn.
    """

    gyroscope: Gyroscope
    turns: tuple[Turn, ...]
    rows: tuple[int, ...]
    means: tuple[RateMean, ...]
    noise_dof: int
    bias_dof: int
    rests: tuple[Average, ...]
    hiding: tuple[int, ...] = ()


@dataclass(frozen=True, slots=True)
class DeclaredTurns:
    """The stated angles (k,) of the table's rows, and the standard deviations (k,) of angle and axis, if given."""

    angle_rad: Array
    angle_std_rad: Array | None
    axis_std_rad: Array | None


def find_turns(
    time_s: Array, readings: Array, declared: DeclaredTurns, sweeps: Sequence[Observation], rests: Sequence[Average]
) -> TurnedData | None:
    """Return the turns among the `sweeps`: those that start and end at rest, by the readings (n, 3) in rad/s.

    `declared` are the stated angles of the sweeps, `rests` the rests that the file states. The mean readings of sweeps
    that are not turns are among the `means` of the result. Turns with gaps that may hide too much rotation are left
    out. Return None if there are no turns.
    """
    pauses = _find_pauses(time_s, sweeps)
    found_rests = find_rests(time_s, {RATE: readings}, lying=pauses)
    if not found_rests:
        return None
    unstated = _find_others(found_rests, rests)
    resting = [*rests, *(average_of(readings[inside(time_s, window)], window) for window in unstated)]
    bias = np.median([rest.mean_rad_s for rest in resting], axis=0)
    rates = readings - bias
    sampling = find_sampling(time_s)
    gaps = np.flatnonzero(sampling.missing)
    turns = []
    turn_rows = []
    hiding = []
    means = [RateMean(rest.mean_rad_s, rest.variance_rad2_s2, np.zeros(3)) for rest in resting]
    for sweep in sweeps:
        row = sweep.sweep - 1
        window = _enclosing_window(sweep, found_rests)
        if window is None or not _starts_and_stops(time_s, rates, sweep):
            average = sweep.average
            means.append(RateMean(average.mean_rad_s, average.variance_rad2_s2, sweep.speed_rad_s * sweep.axis_flange))
            continue
        within = gaps[(time_s[gaps + 1] > window.start_s) & (time_s[gaps] < window.end_s)]
        hidden_rad = float(np.linalg.norm(hidden_angles_rad(time_s, readings, within)))
        if hidden_rad > MAX_HIDDEN_RAD:
            hiding.append(sweep.sweep)
            continue
        angle_std = BY_HAND_ANGLE_RAD if declared.angle_std_rad is None else float(declared.angle_std_rad[row])
        axis_std = BY_HAND_AXIS_RAD if declared.axis_std_rad is None else float(declared.axis_std_rad[row])
        angle = float(declared.angle_rad[row])
        angle_std = float(np.hypot(angle_std, hidden_rad))
        turns.append(Turn(window.start_s, window.end_s, sweep.axis_flange, angle, angle_std, axis_std))
        turn_rows.append(sweep.sweep)
    if not turns:
        return None
    rests_at_other_bias = _find_other_bias(time_s, rates, pauses, found_rests)
    noise = np.sqrt(np.mean([np.square(rest.noise_rad_s) for rest in resting]) * sampling.interval_s)
    gyroscope = Gyroscope(time_s, readings, float(noise), np.sqrt(estimate_bias_drift(resting)))
    return TurnedData(
        gyroscope=gyroscope,
        turns=tuple(turns),
        rows=tuple(turn_rows),
        means=tuple(means),
        noise_dof=sum(rest.samples - 1 for rest in resting),
        bias_dof=max(len(resting) - 1, 1),
        rests=(
            *resting,
            *(average_of(readings[inside(time_s, window)], window) for window in rests_at_other_bias),
        ),
        hiding=tuple(hiding),
    )


def _find_other_bias(
    time_s: Array, rates: Array, pauses: Sequence[Window], lying: Sequence[Window]
) -> Iterator[Window]:
    """Yield the pauses in which the body lies still but the bias had changed: the readings are quiet, but not near 0.

    `rates` (n, 3) are the readings minus the usual bias; `lying` are the rests found with this bias.
    """
    middles = [
        Window(pause.start_s + (pause.end_s - pause.start_s) / 4, pause.end_s - (pause.end_s - pause.start_s) / 4)
        for pause in pauses
    ]
    for window in find_rests_at_other_bias(time_s, rates, middles, lying):
        if np.linalg.norm(rates[inside(time_s, window)].mean(axis=0)) < MAX_BIAS_RAD_S:
            yield window


def _find_others(lying: Sequence[Window], rests: Sequence[Average]) -> list[Window]:
    """Return the windows `lying`, found in the readings, that do not overlap any of the stated `rests`."""
    return [
        window
        for window in lying
        if all(rest.end_s <= window.start_s or rest.start_s >= window.end_s for rest in rests)
    ]


def _find_pauses(time_s: Array, sweeps: Sequence[Observation]) -> list[Window]:
    """Return the intervals between sweeps, the only ones in which the body is assumed to lie still."""
    intervals = sorted((sweep.average.start_s, sweep.average.end_s) for sweep in sweeps)
    starts = [float(time_s[0]), *(end_s for _, end_s in intervals)]
    ends = [*(start_s for start_s, _ in intervals), float(time_s[-1])]
    return [Window(start_s, end_s) for start_s, end_s in zip(starts, ends, strict=True) if end_s > start_s]


def _enclosing_window(sweep: Observation, lying: Sequence[Window]) -> Window | None:
    """Return the window from the rest before a sweep to the rest after it; None if either rest is far away."""
    start_s, end_s = sweep.average.start_s, sweep.average.end_s
    before = [rest for rest in lying if rest.start_s < start_s and rest.end_s >= start_s - MAX_REST_DISTANCE_S]
    after = [rest for rest in lying if rest.end_s > end_s and rest.start_s <= end_s + MAX_REST_DISTANCE_S]
    if not before or not after or before[-1] is after[0]:
        return None
    return Window(min(before[-1].end_s, start_s), max(after[0].start_s, end_s))


def _starts_and_stops(time_s: Array, rates: Array, sweep: Observation) -> bool:
    """Return whether a sweep hardly turns at either end; otherwise it was cut out of a longer turn."""
    for at_s in (sweep.average.start_s, sweep.average.end_s):
        index = int(np.searchsorted(time_s, at_s))
        around = rates[max(index - EDGE_SAMPLES, 0) : index + EDGE_SAMPLES]
        if np.linalg.norm(around.mean(axis=0)) > STANDING_SPEED_RATIO * sweep.speed_rad_s:
            return False
    return True
