"""Attitude fixes from a reference's rows, between which a gyroscope is integrated, and the intervals left out, by name.

Rows that follow each other while the body moves are gathered over windows; each holds for its middle. A row in which
the gyroscope shows that the body lay still holds from its beginning to its end: both are fixes, and share the row's
error.

A gyroscope cannot be integrated over missing samples, at the end of its range, or if it turns too far from one reading
to the next for interpolation.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rig.errors import Fault
from rig.estimation.arrays import Array, rotation_vectors
from rig.estimation.external.attitude_drift import Fixes
from rig.observation.time_stamps.gaps import find_hiding_gaps
from rig.observation.time_stamps.sampling import find_sampling

WINDOW_S, SHORTEST_S = (
    1.0,
    0.5,
)  # cameras' errors are coloured over tenths of a second; a short recording needs windows too
WINDOWS, MOST = 40, 300  # at least, while they are longer than the shortest; at most
STILL_S, STILL_SAMPLES, STILL_RAD_S = 0.5, 20, 5e-3  # a row that may be a rest; largest difference between rests
GAP = 2  # missing readings: a cubic through the others bridges one
MAX_STEP_RAD = 0.35  # between two readings: up to here a cubic through rates is right to microradians
CLIPPED, CLIPPED_RAD_S = 4, 1.0  # equal readings in a row at the end of an axis' readings; least range of these
ROUGH_S, ROUGH_ROWS, ROUGH_ODD = 0.1, 30, 5.0  # between two rows for a rate; rows for F; outliers: times the median
EXPLAINED, WORST_START = 0.5, 100.0  # least fraction of the readings' variance that F explains; its largest condition
FEWEST = 6  # increments in which the body moves: 18 numbers for 12 parameters
THIN = 0.25  # of a fix's usual number of rows


@dataclass(frozen=True, slots=True)
class Turning:
    """A gyroscope's `readings_rad_s` (n, 3) at `time_s` (n,), and the rows of a reference.

    `rows_s` (N, 2): start and end of each row; `attitudes` (N, 3, 3), body to table; `std_rad` (N,) as stated.
    """

    time_s: Array
    readings_rad_s: Array
    rows_s: Array
    attitudes: Array
    std_rad: Array | None = None


@dataclass(frozen=True, slots=True)
class LeftOut:
    """Increments that could not be made: the error's name, their number, and when the first of them began.

    `longest_s`: the longest step from one reading to the next over which the motion is unknown.
    """

    name: str
    count: int
    first_s: float
    longest_s: float


@dataclass(frozen=True, slots=True)
class Gathered:
    """Fixes, windows of `window_s`, and what had to be left out."""

    fixes: Fixes
    window_s: float
    left_out: tuple[LeftOut, ...]

    @property
    def increments(self) -> int:
        """Number of increments if none were left out."""
        return len(self.fixes.joined)


def gather(turning: Turning, window_s: float | None = None, clock_s: float = 0.0) -> Gathered:
    """Return the fixes of a reference's rows, in windows of a given or a suitable length.

    The reference's attitude at time t is that at t + `clock_s` of the readings. Raise Fault `too_few_observations`, or
    `lost_samples`, `saturation`, `turned_too_fast` if that is the reason: too few increments remain in which the body
    moves, or more had to be left out.
    """
    turning = _select_covered(turning)
    if len(turning.rows_s) < 2:
        raise _too_few(f"{len(turning.rows_s)} attitudes lie within the recording")
    length_s = window_s or _suitable_s(float(turning.rows_s[-1, 1] - turning.rows_s[0, 0]))
    fixes = _drop_thin(_fixes(turning, _still(turning), length_s))
    joined, left_out = _find_joined(turning, fixes, clock_s)
    moving = fixes.placement[1:] != fixes.placement[:-1]
    moving_count = int((joined & moving).sum())
    if moving_count < FEWEST or moving_count < int((~joined & moving).sum()):
        raise _all_lost(moving_count, int(moving.sum()), left_out)
    return Gathered(replace(fixes, joined=joined), length_s, left_out)


def rough_matrix(turning: Turning) -> Array:
    """Return a start value of F (3, 3), from rates between rows that follow closely; else the identity."""
    turning = _select_covered(turning)
    middles_s = turning.rows_s.mean(axis=1)
    apart = max(1, int(np.ceil(ROUGH_S / max(float(np.median(np.diff(middles_s))), 1e-9)))) if len(middles_s) > 1 else 1
    first, last = np.arange(len(middles_s) - apart), np.arange(apart, len(middles_s))
    close = middles_s[last] - middles_s[first] <= 2 * ROUGH_S
    first, last = first[close], last[close]
    if len(first) < ROUGH_ROWS:
        return np.eye(3)
    rates = rotation_vectors(np.swapaxes(turning.attitudes[first], -1, -2) @ turning.attitudes[last])
    rates /= (middles_s[last] - middles_s[first])[:, None]
    total = np.concatenate([np.zeros((1, 3)), np.cumsum(turning.readings_rad_s, axis=0)])
    begin, end = (np.searchsorted(turning.time_s, middles_s[rows]) for rows in (first, last))
    some = end > begin
    means = (total[end[some]] - total[begin[some]]) / (end - begin)[some][:, None]
    design = np.column_stack([rates[some], np.ones(int(some.sum()))])
    fit = np.linalg.lstsq(design, means, rcond=None)[0]
    residuals = np.linalg.norm(means - design @ fit, axis=1)
    near = residuals <= ROUGH_ODD * np.median(residuals)
    fit = np.linalg.lstsq(design[near], means[near], rcond=None)[0]
    explained = 1 - np.var(means[near] - design[near] @ fit) / np.var(means[near])
    if explained < EXPLAINED or np.linalg.cond(fit[:3]) > WORST_START:
        return np.eye(3)
    return np.asarray(fit[:3].T, dtype=np.float64)


def _select_covered(turning: Turning) -> Turning:
    """Return the rows that lie within the recording, in the order of time."""
    order = np.argsort(turning.rows_s[:, 0])
    rows_s = turning.rows_s[order]
    order = order[(rows_s[:, 0] >= turning.time_s[0]) & (rows_s[:, 1] <= turning.time_s[-1])]
    std_rad = None if turning.std_rad is None else turning.std_rad[order]
    return replace(turning, rows_s=turning.rows_s[order], attitudes=turning.attitudes[order], std_rad=std_rad)


def _suitable_s(span_s: float) -> float:
    return max(min(WINDOW_S, max(SHORTEST_S, span_s / WINDOWS)), span_s / MOST)


def _still(turning: Turning) -> NDArray[np.bool_]:
    """Return the rows (N,) in which the body lay still: long ones with equal means, and with noise alone."""
    rows_s = turning.rows_s
    start, end = np.searchsorted(turning.time_s, rows_s.T)
    still: NDArray[np.bool_] = (rows_s[:, 1] - rows_s[:, 0] >= STILL_S) & (end - start >= STILL_SAMPLES)
    long = np.flatnonzero(still)
    if not len(long):
        return still
    cuts = [turning.readings_rad_s[start[row] : end[row]] for row in long]
    noise = min(float(np.diff(cut, axis=0).std(axis=0).max()) for cut in cuts) / np.sqrt(2)
    quiet = np.array([cut.std(axis=0).max() for cut in cuts]) <= 2 * noise + STILL_RAD_S
    means = np.array([cut.mean(axis=0) for cut in cuts])
    deviation = np.abs(means - np.median(means[quiet] if quiet.any() else means, axis=0)).max(axis=1)
    still[long] = quiet & (deviation <= STILL_RAD_S + 4 * noise / np.sqrt(end[long] - start[long]))
    return still


def _fixes(turning: Turning, still: NDArray[np.bool_], window_s: float) -> Fixes:
    """Group the reference's attitudes into fixes: start and end of each row at rest, and one per window between rests.

    `placement` is equal for both ends of a rest; whether the gyroscope can be integrated between them is not yet known.
    """
    rows_s = turning.rows_s
    passed = np.cumsum(still)
    interval = 2 * passed - still  # odd: a row at rest; even: what lies between two of these
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


def _drop_thin(fixes: Fixes) -> Fixes:
    """Return the fixes without windows in which the reference has hardly any rows."""
    counts = np.bincount(fixes.fix)
    moving = fixes.placement >= 0
    kept = ~moving | (counts >= THIN * np.median(counts[moving] if moving.any() else counts))
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


def _find_joined(turning: Turning, fixes: Fixes, clock_s: float) -> tuple[NDArray[np.bool_], tuple[LeftOut, ...]]:
    """Return which neighbours (N − 1,) the gyroscope connects, and the reasons for the others."""
    count = len(fixes.placement)
    first_s = clock_s + fixes.at_s[np.searchsorted(fixes.fix, np.arange(count))]
    last_s = clock_s + fixes.at_s[np.searchsorted(fixes.fix, np.arange(count), side="right") - 1]
    joined = np.ones(count - 1, dtype=np.bool_)
    left_out = []
    for name, steps in _blind(turning).items():
        begins, ends = turning.time_s[steps], turning.time_s[steps + 1]
        is_blind = np.searchsorted(begins, last_s[1:]) > np.searchsorted(ends, first_s[:-1], side="right")
        lost = np.flatnonzero(is_blind & joined)
        joined[lost] = False
        if len(lost):
            first = float(begins[np.searchsorted(ends, first_s[lost[0]], "right")])
            left_out.append(LeftOut(name, len(lost), first, float((ends - begins).max())))
    return joined, tuple(left_out)


def _blind(turning: Turning) -> dict[str, NDArray[np.intp]]:
    """Return the steps from one reading to the next, by the first one's index, of unknown motion, by reason."""
    steps_s = np.diff(turning.time_s)
    readings = turning.readings_rad_s
    angle_rad = np.linalg.norm(readings[:-1] - np.median(readings, axis=0), axis=1) * steps_s
    clipped = np.flatnonzero(_find_clipped(readings))
    adjacent = np.unique(np.clip(np.concatenate([clipped - 1, clipped]), 0, len(steps_s) - 1))
    gaps = find_sampling(turning.time_s).gaps(turning.time_s, GAP)
    return {
        "lost_samples": find_hiding_gaps(turning.time_s, readings, np.flatnonzero(gaps)),
        "saturation": adjacent,
        "turned_too_fast": np.flatnonzero((angle_rad > MAX_STEP_RAD) & ~gaps),
    }


def _find_clipped(readings: Array) -> NDArray[np.bool_]:
    """Return the readings (n,) in which an axis repeats its largest or smallest value several times.

    A sensor at rest repeats itself as well, but then its largest and smallest values are close together.
    """
    clipped = np.zeros(len(readings), dtype=np.bool_)
    for axis in readings.T:
        if np.ptp(axis) < CLIPPED_RAD_S:
            continue
        for end in (axis.max(), axis.min()):
            at_end = np.concatenate([[False], axis == end, [False]])
            edges = np.flatnonzero(np.diff(at_end.astype(np.int8))).reshape(-1, 2)
            for begin, stop in edges[np.diff(edges, axis=1)[:, 0] >= CLIPPED].tolist():
                clipped[begin:stop] = True
    return clipped


def _all_lost(count: int, total: int, left_out: tuple[LeftOut, ...]) -> Fault:
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
        "too_few_observations", f"{what}, {FEWEST} increments are the least", "Record longer, in more attitudes"
    )
