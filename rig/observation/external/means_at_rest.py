"""A gyroscope's mean readings in rests that both its readings and a reference's attitudes show."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rig.data.quantity import RATE
from rig.estimation.arrays import Array, rotation_vectors
from rig.estimation.statistics.rounding import Steps, bound_rounding_variance, find_steps
from rig.observation.by_hand.rests import find_rests
from rig.observation.external.reference_rows import Turning
from rig.observation.external.still_attitudes import MAX_STILL_RATE_RAD_S, MAX_TIME_ERROR_S, still_windows
from rig.observation.windows import Window, inside

MIN_REST_S, MAX_NOISE_RATIO = 0.4, 1.5  # rest with another bias; its noise, relative to the other rests
MIN_RESTS, MIN_TOTAL_S = 2, 1.0  # that show a scatter, and their total duration


@dataclass(frozen=True, slots=True)
class MeansAtRest:
    """The gyroscope's mean `readings_rad_s` (k, 3) in k rests, and the body's rates (k, 3) from the reference.

    `rounding` (3,) is the variance that rounding to coarse steps adds to each mean, the same in all rests.
    """

    readings_rad_s: Array
    rates_rad_s: Array
    rounding: Array


def means_at_rest(turning: Turning, clock_s: float) -> MeansAtRest | None:
    """Return the means in the rests, in body coordinates; None if all rests together are too short.

    Time t of the rows is time t + `clock_s` of the readings.
    """
    rows_s = turning.rows_s.mean(axis=1) + clock_s
    lying = still_windows(turning.rows_s + clock_s, turning.attitudes)
    lasting_s = 0.0
    readings, rates, rounding = list[Array](), list[Array](), list[Array]()
    steps = Steps(find_steps(turning.readings_rad_s))
    rests = find_rests(turning.time_s, {RATE: turning.readings_rad_s}, lying=lying)
    for rest in _split_single(
        [*rests, *find_rests_at_other_bias(turning.time_s, turning.readings_rad_s, lying, rests)]
    ):
        rows = np.flatnonzero((rows_s >= rest.start_s) & (rows_s <= rest.end_s))
        if not len(rows):
            continue
        rows = rows[np.argsort(rows_s[rows])]
        rate = _rate_rad_s(rows_s[rows], turning.attitudes[rows])
        if np.linalg.norm(rate) <= MAX_STILL_RATE_RAD_S:
            at_rest = turning.readings_rad_s[inside(turning.time_s, rest)]
            readings.append(at_rest.mean(axis=0))
            rounding.append(bound_rounding_variance(at_rest, steps, np.zeros_like(at_rest), at_rest.var(axis=0)))
            rates.append(rate)
            lasting_s += rest.end_s - rest.start_s
    if len(rates) < MIN_RESTS or lasting_s < MIN_TOTAL_S:
        return None
    return MeansAtRest(np.array(readings), np.array(rates), np.mean(rounding, axis=0))


def find_rests_at_other_bias(
    time_s: Array, readings: Array, lying: Sequence[Window], rests: Sequence[Window]
) -> list[Window]:
    """Return the windows of `lying` that are quiet but not among the rests found, because the bias had changed.

    In the windows `lying` the body should lie still; the result is without their ends, whose times are uncertain.
    `rests` are the rests found in the readings (n, 3) at times (n,).
    """
    if not rests:
        return []
    noise = np.median([readings[inside(time_s, rest)].std(axis=0) for rest in rests], axis=0)
    first_s, last_s = float(time_s[0]), float(time_s[-1])
    # The recording may begin later than the attitudes, or end before them.
    inner = [
        Window(max(window.start_s + MAX_TIME_ERROR_S, first_s), min(window.end_s - MAX_TIME_ERROR_S, last_s))
        for window in lying
    ]

    def is_quiet(window: Window) -> bool:
        within = readings[inside(time_s, window)]
        return len(within) > 1 and bool((within.std(axis=0) <= MAX_NOISE_RATIO * noise).all())

    return [
        window
        for window in inner
        if window.end_s - window.start_s >= MIN_REST_S
        and all(rest.end_s <= window.start_s or rest.start_s >= window.end_s for rest in rests)
        and is_quiet(window)
    ]


def _split_single(windows: Sequence[Window]) -> Sequence[Window]:
    """Return the windows; if there is only one, its halves."""
    if len(windows) != 1:
        return windows
    window = windows[0]
    middle_s = (window.start_s + window.end_s) / 2
    return (Window(window.start_s, middle_s), Window(middle_s, window.end_s))


def _rate_rad_s(times_s: Array, attitudes: Array) -> Array:
    """Return the body's rate (3,) from its attitudes at increasing times; zero for a single attitude.

    The rate is the median over pairs of rows that are half of all rows apart (Theil's incomplete method, 1950), so that
    a few rows at either end, in which the body already moves, have no effect. A single row means that the body rests.
    """
    half = len(times_s) // 2
    if not half:
        return np.zeros(3)
    angles_rad = rotation_vectors(np.swapaxes(attitudes[:half], -1, -2) @ attitudes[-half:])
    return np.asarray(np.median(angles_rad / (times_s[-half:] - times_s[:half])[:, None], axis=0), dtype=np.float64)
