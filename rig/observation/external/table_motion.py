"""The motion of a table from a file of attitudes, to find the clock of a recording."""

import numpy as np
from numpy.typing import NDArray

from rig.errors import Fault
from rig.estimation.arrays import Array, integrate_rates, rotation_vectors
from rig.estimation.cubic_spline import CubicSpline
from rig.estimation.refusals import RATE_UNIT_RATIOS, is_plausible, wrong_unit
from rig.observation.motion.reference_motion import MIN_RATE_RAD_S, closely_followed

MAX_STEP_S, MAX_STEP_RAD = 0.3, 2.6  # between rows that show how the table turned: below half a turn
MIN_ROWS = 20
PAIR_INTERVAL_S, MIN_PAIRS = 0.25, 12  # between two rows whose rates and attitudes are compared
# least rotation of a pair; largest relative deviation from the median ratio; least fraction of pairs within it
MIN_PAIR_RAD, MAX_RATIO_DEVIATION, MIN_PAIR_FRACTION = 0.02, 0.3, 0.8
# °/rad, and its tolerance: this ratio is a wrong unit; any other one is a turn of over half a revolution per row
DEG_PER_RAD, DEG_TOLERANCE = 180 / np.pi, 0.05  # a wrong unit; any other ratio: turns of over half a revolution
MAX_SPEED_RATIO = 2.0  # fastest to slowest: above it, turns of over half a revolution have no common ratio
# Scatter of the steps relative to their median, above which it matters in a rate; least median at which it does not.
STEP_SCATTER, COARSE_STEP_S = 0.2, 0.05


class TableMotion:
    """A `KnownMotion` from table rows in close succession, each of which covers a short interval.

    `middles_s` (n,) are the middles of these intervals on the table's clock, in any order; `attitudes` (n, 3, 3)
    transform body to table coordinates; `rates_rad_s` (n, 3) are in body coordinates, None if only the attitudes are
    known. Raise Fault `time_base_not_found`.
    """

    def __init__(self, middles_s: Array, attitudes: Array, rates_rad_s: Array | None) -> None:
        """Interpolate the given rates, or those between attitudes. Raise Fault `time_base_not_found`."""
        order = np.argsort(middles_s)
        if rates_rad_s is None:
            order = order[_thin(middles_s[order])]
        self.time_s = middles_s[order]
        turned = rotation_vectors(np.swapaxes(attitudes[order[:-1]], -1, -2) @ attitudes[order[1:]])
        close = (np.diff(self.time_s) <= MAX_STEP_S) & (np.linalg.norm(turned, axis=1) < MAX_STEP_RAD)
        if close.sum() < MIN_ROWS:
            raise _not_found(
                f"of {len(close) + 1} rows, only {int(close.sum())} follow the row before within {MAX_STEP_S:g} s and "
                "half a turn: they do not show how the table turned"
            )
        self._close = close
        if rates_rad_s is None:
            interval_s = np.diff(self.time_s)
            between_s, rates = self.time_s[:-1] + interval_s / 2, turned / interval_s[:, None]
            self._rate = CubicSpline(between_s, rates)
        else:
            rates = rates_rad_s[order]
            self._rate = CubicSpline(self.time_s, rates)
        if not np.linalg.norm(rates, axis=1).max() > MIN_RATE_RAD_S:
            raise _not_found("the table stands still in the whole file")

    def rate(self, time_s: Array, derivative: int = 0, /) -> Array:
        """Return the table's rate (n, 3), or its derivative, as `KnownMotion` defines it."""
        rate: Array = self._rate(time_s, derivative)
        return rate

    def covered(self, time_s: Array) -> NDArray[np.bool_]:
        """Return a mask of the times (n,) at which the table's motion is recorded, as `KnownMotion` defines it."""
        return closely_followed(self.time_s, self._close, time_s)


def check_rates_agree(middles_s: Array, attitudes: Array, rates_rad_s: Array) -> None:
    """Raise Fault `wrong_unit` if a table's rates (N, 3) differ by a factor from those of its attitudes (N, 3, 3).

    `middles_s` (N,) are the times of the rows. The check is needed because a solution that uses only the rates does not
    show a wrong unit that the readings have too.
    """
    order = np.argsort(middles_s)
    time_s, rates = middles_s[order], rates_rad_s[order]
    later = np.maximum(np.searchsorted(time_s, time_s + PAIR_INTERVAL_S), np.arange(len(time_s)) + 1)
    first = np.flatnonzero(later < len(time_s))
    last = later[first]
    first, last = (rows[time_s[last] - time_s[first] <= 2 * MAX_STEP_S] for rows in (first, last))
    swept = integrate_rates(time_s, rates)
    stated_rad = np.linalg.norm(swept[last] - swept[first], axis=1)
    turned = rotation_vectors(np.swapaxes(attitudes[order[first]], -1, -2) @ attitudes[order[last]])
    turned_rad = np.linalg.norm(turned, axis=1)
    moving = (turned_rad > MIN_PAIR_RAD) & (turned_rad < MAX_STEP_RAD)
    if moving.sum() < MIN_PAIRS:
        return
    ratios = stated_rad[moving] / turned_rad[moving]
    ratio = float(np.median(ratios))
    if is_plausible(ratio).all() or np.mean(np.abs(ratios - ratio) < MAX_RATIO_DEVIATION * ratio) < MIN_PAIR_FRACTION:
        return
    slowest_rad, fastest_rad = np.quantile(turned_rad[moving], (0.1, 0.9))
    if ratio < 1 or fastest_rad > MAX_SPEED_RATIO * slowest_rad or abs(ratio / DEG_PER_RAD - 1) < DEG_TOLERANCE:
        raise wrong_unit(f"the table's rates are {ratio:.3g} times those of its attitudes", ratio, RATE_UNIT_RATIOS)


def _thin(time_s: Array) -> NDArray[np.intp]:
    """Return the indices of rows at rising times (n,) far enough apart that time-stamp errors hardly change a rate."""
    steps_s = np.diff(time_s)
    median_s = float(np.median(steps_s)) if len(steps_s) else 0.0
    if median_s >= COARSE_STEP_S or not len(steps_s) or np.abs(steps_s - median_s).mean() <= STEP_SCATTER * median_s:
        return np.arange(len(time_s))
    last_s = -np.inf
    kept = []
    for row, row_s in enumerate(time_s.tolist()):
        if row_s - last_s >= COARSE_STEP_S:
            kept.append(row)
            last_s = row_s
    return np.array(kept)


def _not_found(what: str) -> Fault:
    return Fault(
        "time_base_not_found",
        f"{what}, so the sensor cannot be put on its clock",
        "Let the table write a row every quarter of a second or more often while it turns, or use one clock",
    )
