"""Fixes of the attitude, gathered from a reference's rows; a gyroscope is integrated from each fix to the next.

An increment is the rotation from one fix to the next. Rows that follow each other while the body moves are gathered
into one fix for each window; each row states the attitude at the row's middle. If the gyroscope shows that the body lay
still during a row, both ends of the row are fixes, which share the row's error.

Increments are left out, and listed, if samples are missing or saturated, or if the gyroscope turns too far between two
readings.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rig.errors import Fault
from rig.estimation.arrays import Array
from rig.estimation.external.attitude_drift import Fixes
from rig.observation.external.reference_rows import Turning, join_rests, select_covered
from rig.observation.false_readings import find_clipped
from rig.observation.time_stamps.gaps import hidden_angles_rad
from rig.observation.time_stamps.sampling import find_sampling

WINDOW_S, MIN_WINDOW_S = 1.0, 0.5  # the errors of cameras are correlated over tenths of a second
MIN_WINDOWS, MAX_WINDOWS = 40, 120  # unless they would be shorter than MIN_WINDOW_S
MIN_GAP_READINGS = 2  # missing ones: a cubic spline through the others bridges a single one
MAX_STEP_RAD = 0.35  # up to which a cubic spline through the rates is correct to microradians
MAX_HIDDEN_STD_RAD, UNKNOWN_STD_RAD = 0.05, 10.0  # of a rotation, above which there is no increment
BATCH_MEAN_S = 0.1  # at rest, over which correlated noise averages out
MIN_MOVING_INCREMENTS = 6  # 18 numbers for 12 parameters
MIN_ROW_RATIO = 0.25  # to a fix's usual number of rows


@dataclass(frozen=True, slots=True)
class OmittedIncrements:
    """`count` increments that could not be made because of the error `name`; the first of them starts at `first_s`.

    `longest_s`: the longest step from one reading to the next over which the motion is unknown.
    """

    name: str
    count: int
    first_s: float
    longest_s: float


@dataclass(frozen=True, slots=True)
class GatheredFixes:
    """Fixes, that is, attitudes averaged over windows of `window_s`, and the omitted increments between fixes."""

    fixes: Fixes
    window_s: float
    left_out: tuple[OmittedIncrements, ...]

    @property
    def increments(self) -> int:
        """The number of increments between consecutive fixes, including the increments that were left out."""
        return len(self.fixes.joined)


def gather(turning: Turning, window_s: float | None = None, clock_s: float = 0.0) -> GatheredFixes:
    """Return the fixes of a reference: its rows' attitudes, averaged over windows of a given or a suitable length.

    Time t of the reference is time t + `clock_s` of the readings. Increments in which the body lies still are not
    counted. Raise a Fault if too few of the others remain, or if more of them are left out than remain. The Fault's
    name is the most frequent reason for leaving out an increment (`lost_samples`, `saturation` or `turned_too_fast`),
    or `too_few_observations` if no increment was left out.
    """
    turning = select_covered(turning, clock_s)
    if len(turning.rows_s) < 2:
        raise _too_few(f"{len(turning.rows_s)} attitudes lie within the recording")
    length_s = window_s or _suitable_s(float(turning.rows_s[-1, 1] - turning.rows_s[0, 0]))
    rows, still = join_rests(turning, clock_s)
    fixes = _drop_thin(_fixes(rows, still, length_s))
    joined, blind_rad, left_out = _find_joined(turning, fixes, clock_s)
    moving = fixes.placement[1:] != fixes.placement[:-1]
    moving_count = int((joined & moving).sum())
    if moving_count < MIN_MOVING_INCREMENTS or moving_count < int((~joined & moving).sum()):
        raise _all_lost(moving_count, int(moving.sum()), left_out)
    walk = _measure_walk(turning, rows.rows_s[still] + clock_s)
    fixes = replace(fixes, joined=joined, blind_rad=blind_rad, walk=walk, hides_losses=turning.hides_losses)
    return GatheredFixes(fixes, length_s, left_out)


def _suitable_s(span_s: float) -> float:
    return max(min(WINDOW_S, max(MIN_WINDOW_S, span_s / MIN_WINDOWS)), span_s / MAX_WINDOWS)


def _fixes(turning: Turning, still: NDArray[np.bool_], window_s: float) -> Fixes:
    """Return the reference's attitudes, grouped into fixes without regard to the gyroscope's gaps.

    Rows of the reference that are `still` are rests. Each rest gives a fix at its start and one at its end, and these
    two have the same `placement`. The other rows give one fix for each window of `window_s` between two rests.
    """
    rows_s = turning.rows_s
    passed = np.cumsum(still)
    interval = 2 * passed - still  # odd: a row at rest; even: the interval between two such rows
    middles_s = rows_s.mean(axis=1)
    elapsed_s = middles_s - middles_s[np.searchsorted(interval, interval)]
    window = np.floor(elapsed_s / window_s).astype(np.intp)
    row = np.repeat(np.arange(len(rows_s)), 1 + still)
    is_second = np.append(False, row[1:] == row[:-1])
    window = np.where(still[row], is_second, window[row])
    at_s = np.where(still[row], rows_s[row, is_second.astype(np.intp)], middles_s[row])
    keys, fix = np.unique(np.column_stack([interval[row], window]), axis=0, return_inverse=True)
    at_rest = keys[:, 0] % 2 == 1
    placement = np.where(at_rest, -keys[:, 0], np.arange(len(keys)))
    std_rad = None if turning.std_rad is None else turning.std_rad[row]
    joined = np.ones(len(keys) - 1, dtype=np.bool_)
    return Fixes(at_s, turning.attitudes[row], fix.reshape(-1), placement, joined, std_rad)


def _measure_walk(turning: Turning, rests_s: Array) -> tuple[float, float]:
    """Return a sum of squares, rad²/s, and its degrees of freedom; their ratio is the square of the angle random walk.

    They are computed from the gyroscope's readings in k rests, whose starts and ends are `rests_s` (k, 2). The readings
    are first averaged over `BATCH_MEAN_S`, because their noise may be coloured over a few samples.
    """
    squares, dof = 0.0, 0.0
    for start_s, end_s in rests_s.tolist():
        first, last = np.searchsorted(turning.time_s, [start_s, end_s])
        size = max(int(np.ceil(BATCH_MEAN_S * (last - first) / (end_s - start_s))), 1)
        count = int(last - first) // size
        if count > 1:
            batches = turning.readings_rad_s[first : first + count * size].reshape(count, size, 3).mean(axis=1)
            lasts_s = (end_s - start_s) * size / (last - first)
            squares += float(np.var(batches, axis=0).sum()) * count * lasts_s
            dof += 3.0 * (count - 1)
    return squares, dof


def _drop_thin(fixes: Fixes) -> Fixes:
    """Return the fixes (averaged attitudes) without those in motion that consist of far fewer rows than usual."""
    counts = np.bincount(fixes.fix)
    moving = fixes.placement >= 0
    kept = ~moving | (counts >= MIN_ROW_RATIO * np.median(counts[moving] if moving.any() else counts))
    rows = kept[fixes.fix]
    number = np.cumsum(kept) - 1
    return Fixes(
        fixes.at_s[rows],
        fixes.attitudes[rows],
        number[fixes.fix[rows]],
        fixes.placement[kept],
        np.ones(int(kept.sum()) - 1, dtype=np.bool_),
        None if fixes.std_rad is None else fixes.std_rad[rows],
    )


def _find_joined(
    turning: Turning, fixes: Fixes, clock_s: float
) -> tuple[NDArray[np.bool_], Array, tuple[OmittedIncrements, ...]]:
    """Return a mask of the increments to use, the std of each increment's hidden rotation, and the omitted increments.

    Mask and std, rad, have the shape (N − 1,) for N fixes. An increment is not used if it contains a step, from one
    reading to the next, that may hide too much rotation.
    """
    count = len(fixes.placement)
    first_s = clock_s + fixes.at_s[np.searchsorted(fixes.fix, np.arange(count))]
    last_s = clock_s + fixes.at_s[np.searchsorted(fixes.fix, np.arange(count), side="right") - 1]
    joined = np.ones(count - 1, dtype=np.bool_)
    hidden = np.zeros(count - 1)
    left_out = []
    for name, steps, hidden_rad in _find_unknown_steps(turning):
        begins, ends = turning.time_s[steps], turning.time_s[steps + 1]
        from_step, to_step = np.searchsorted(ends, first_s[:-1], side="right"), np.searchsorted(begins, last_s[1:])
        # The hidden variance of an increment is the sum over its steps, a difference of cumulative sums.
        squares = np.concatenate([[0.0], np.cumsum(np.square(hidden_rad))])
        amount = np.maximum(squares[np.maximum(to_step, from_step)] - squares[from_step], 0.0)
        lost = np.flatnonzero((amount > MAX_HIDDEN_STD_RAD**2) & joined)
        joined[lost] = False
        hidden += np.where(joined, amount, 0.0)
        if len(lost):
            first = float(begins[from_step[lost[0]]])
            left_out.append(OmittedIncrements(name, len(lost), first, float((ends - begins).max())))
    return joined, np.sqrt(hidden), tuple(left_out)


def _find_unknown_steps(turning: Turning) -> Iterator[tuple[str, NDArray[np.intp], Array]]:
    """Yield the name of each error, the steps (k,) in which the motion is unknown for this reason, and their stds (k,).

    A step, from one reading to the next, has the index of the reading before it. The stds, in rad, are those of the
    unknown rotation.
    """
    steps_s = np.diff(turning.time_s)
    readings = turning.readings_rad_s
    angle_rad = np.linalg.norm(readings[:-1] - np.median(readings, axis=0), axis=1) * steps_s
    clipped = np.flatnonzero(find_clipped(readings))
    adjacent = np.unique(np.clip(np.concatenate([clipped - 1, clipped]), 0, len(steps_s) - 1))
    lost = find_sampling(turning.time_s).gaps(turning.time_s, MIN_GAP_READINGS)
    gaps = np.flatnonzero(lost)
    fast = np.flatnonzero((angle_rad > MAX_STEP_RAD) & ~lost)
    yield "lost_samples", gaps, np.minimum(hidden_angles_rad(turning.time_s, readings, gaps), UNKNOWN_STD_RAD)
    yield "saturation", adjacent, np.full(len(adjacent), UNKNOWN_STD_RAD)
    yield "turned_too_fast", fast, np.full(len(fast), UNKNOWN_STD_RAD)


def _all_lost(count: int, total: int, left_out: tuple[OmittedIncrements, ...]) -> Fault:
    """Return the Fault of too few increments; its name is the commonest reason for leaving increments out."""
    if not left_out:
        return _too_few(f"{count} increments between attitudes are left")
    most = max(left_out, key=lambda cause: cause.count)
    what = (
        f"{count} of {total} increments in which the body moves are left; {most.count} had to be left out, the first "
        f"at {most.first_s:.2f} s"
    )
    if most.name == "lost_samples":
        what = f"{what}, where readings are missing for up to {most.longest_s:.2g} s"
        return Fault(
            "lost_samples", what, "See that the sensor's link loses nothing, and that both files use one clock"
        )
    if most.name == "saturation":
        return Fault("saturation", what, "Choose a wider range, or turn more slowly")
    return Fault("turned_too_fast", what, "Read the sensor more often, or turn more slowly")


def _too_few(what: str) -> Fault:
    return Fault(
        "too_few_observations",
        f"{what}; at least {MIN_MOVING_INCREMENTS} increments are needed",
        "Record longer, in more attitudes",
    )
