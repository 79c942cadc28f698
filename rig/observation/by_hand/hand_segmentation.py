"""The recording of a session by hand, segmented into rests and moves by its readings alone.

Rests are found by `rig.observation.by_hand.rests`; a move extends from one rest to the next, and a little into both,
because the body still rocks or already moves there.
"""

from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from rig.data.quantity import ACCELERATION, RATE
from rig.estimation.arrays import Array, equal_runs
from rig.estimation.by_hand.session_parts import HandRecording, HandRest, Move
from rig.estimation.statistics.rounding import Steps, bound_rounding_variance, find_steps
from rig.observation.by_hand.knocks import mask_knocks
from rig.observation.by_hand.rests import ROUNDING_TOLERANCE, find_rests
from rig.observation.statistics.spikes import bridge_spikes, find_spikes
from rig.observation.time_stamps.gaps import find_hiding_gaps
from rig.observation.time_stamps.sampling import find_sampling
from rig.observation.windows import Window

MARGIN_S = 0.1  # time at either end of a rest that is assigned to the adjacent moves
MIN_GAP_READINGS = 2  # fewest missing readings that count as a gap
MIN_SATURATED = 3  # equal readings in a row at the largest value
MIN_COARSE_RAD_S = float(np.radians(0.1))  # step below which cut digits change a quarter turn by less than 5e-4
ONE_STEP = 1.5  # steps of coarse readings, between one and two
MIN_CLIPPED_FRACTION = 0.8  # of readings at the end of a range among those within a step of it; a parabola has 0.71
SATURATION_FRACTION = 0.995
BEGINNING_S, MAX_STILL_SCATTER_RAD_S = 1.0, 0.03  # of a recording, and the scatter there without a hand
MIN_REST_S, EVALUATION_S = 1.0, 0.25  # during a session; interval of the evaluations
# A body held in the hand: least duration, largest rate; length of the blocks.
MIN_HELD_S, MAX_HELD_RATE_RAD_S, BLOCK_S = 0.75, 0.15, 0.25


def segment_session(
    time_s: Array, rates: Array, acceleration: Array | None = None, *, range_rad_s: float | None = None
) -> HandRecording:
    """Return the rests and moves that readings (n, 3), in rad/s and m/s², at rising times (n,) show.

    `range_rad_s` is the gyroscope's range, None if unknown. Spikes, as of damaged lines, are interpolated.
    """
    if len(spikes := find_spikes(time_s, rates)):
        rates = bridge_spikes(time_s, rates, spikes)
    windows = find_rests(time_s, {RATE: rates}, still_at_first=_began_still(time_s, rates)) if len(time_s) > 1 else ()
    steps = Steps(find_steps(rates))
    rests = tuple(_rest(time_s, rates, acceleration, window, steps) for window in windows)
    top = _find_clipped(rates, range_rad_s, steps)
    gaps = _find_gaps(time_s, rates)
    moves = []
    for first, second in pairwise(windows):
        start_s, end_s = first.end_s - _margin_s(first), second.start_s + _margin_s(second)
        inside = (time_s >= start_s) & (time_s <= end_s)
        peak = float(np.abs(rates[inside]).max())
        moves.append(Move(start_s, end_s, peak, bool(gaps[inside].any()), bool(top[inside].any())))
    held_in_air_s = _find_held_intervals(time_s, rates, rests)
    spikes_s = tuple(time_s[spikes].tolist())
    coarse_rad_s = np.where(steps.units > MIN_COARSE_RAD_S, steps.units, 0.0)
    return HandRecording(
        time_s, rates, acceleration, rests, tuple(moves), held_in_air_s, spikes_s=spikes_s, coarse_rad_s=coarse_rad_s
    )


def _find_gaps(time_s: Array, rates: Array) -> NDArray[np.bool_]:
    """Return a mask (n,) of the last reading before each gap in which the body may have turned unobserved."""
    mask = np.zeros(len(time_s), dtype=np.bool_)
    if len(time_s) > 1:
        steps = np.flatnonzero(find_sampling(time_s).gaps(time_s, MIN_GAP_READINGS))
        mask[find_hiding_gaps(time_s, rates, steps)] = True
    return mask


def _began_still(time_s: Array, rates: Array) -> bool:
    """Return whether the body hardly moved in the first second; if not, a hand held the body at first."""
    first = rates[time_s < time_s[0] + BEGINNING_S]
    return bool(len(first) > 1 and first.std(axis=0).max() < MAX_STILL_SCATTER_RAD_S)


def _margin_s(window: Window) -> float:
    return min(MARGIN_S, (window.end_s - window.start_s) / 4)


def _rest(time_s: Array, rates: Array, acceleration: Array | None, window: Window, steps: Steps) -> HandRest:
    """Return the rest in a window: its readings' means and standard deviations, without a margin at either end.

    Single accelerations that are far from the others, as of damaged lines, are left out too.
    """
    start_s, end_s = window.start_s + _margin_s(window), window.end_s - _margin_s(window)
    inside = (time_s >= start_s) & (time_s <= end_s)
    at_rest = rates[inside]
    forces = None if acceleration is None else acceleration[inside]
    forces = None if forces is None else forces[mask_knocks(forces, ACCELERATION)]
    return HandRest(
        start_s,
        end_s,
        len(at_rest),
        at_rest.mean(axis=0),
        at_rest.std(axis=0, ddof=1),
        None if forces is None else forces.mean(axis=0),
        None if forces is None else forces.std(axis=0, ddof=1),
        _find_rounding_std(rates, at_rest, steps),
    )


def _find_rounding_std(rates: Array, at_rest: Array, steps: Steps) -> Array:
    """Return the standard uncertainty (3,) that coarse readings cause in the mean of those `at_rest` (k, 3).

    If an axis repeats one value, it may have read anything nearer to this value than to any other reading (n, 3) of the
    session, or, if its program cuts digits or writes zeros for small rates, anything up to that reading.
    """
    variances = bound_rounding_variance(at_rest, steps, np.zeros_like(at_rest), at_rest.var(axis=0))
    for axis in np.flatnonzero(np.ptp(at_rest, axis=0) == 0):
        distances = np.abs(rates[:, axis] - at_rest[0, axis])
        variances[axis] = np.min(distances, where=distances > 0, initial=np.inf) ** 2 / 3
    return np.sqrt(np.where(np.isfinite(variances), variances, 0.0))


def _find_clipped(rates: Array, range_rad_s: float | None, steps: Steps) -> NDArray[np.bool_]:
    """Return a mask (n,) of the readings that are at the limit of the range.

    The device may have a smaller range than `range_rad_s`, so long series of the largest reading count as clipped too.
    Coarse readings of a rate that passes its maximum repeat the largest value as well, but then also the next smaller
    one, at least half as often.
    """
    limit = np.inf if range_rad_s is None else SATURATION_FRACTION * range_rad_s
    top: NDArray[np.bool_] = np.any(np.abs(rates) >= limit, axis=1)
    for axis, unit in enumerate(steps.units):
        size = np.abs(rates[:, axis])
        largest = (size >= size.max() * (1 - 1e-9)) & (size > 0)
        near = largest | (size >= size.max() - ONE_STEP * unit)
        runs = equal_runs(near)
        for first, end in runs[near[runs[:, 0]]].tolist():
            count = int(np.count_nonzero(largest[first:end]))
            if count >= max(MIN_SATURATED, MIN_CLIPPED_FRACTION * (end - first)):
                top[first:end] |= largest[first:end]
    return top


def _find_held_intervals(time_s: Array, rates: Array, rests: tuple[HandRest, ...]) -> tuple[tuple[float, float], ...]:
    """Return the intervals in which a hand held the body: it did not rest, but turned more slowly than in a move."""
    if not rests:
        return ()
    width = max(2, int(np.ceil(BLOCK_S / find_sampling(time_s).interval_s - ROUNDING_TOLERANCE)))
    count = len(time_s) // width
    bias = np.median([rest.mean_rad_s for rest in rests], axis=0)
    blocks = (rates[: count * width] - bias).reshape(count, width, 3)
    times = time_s[: count * width].reshape(count, width)
    slow = np.linalg.norm(blocks.mean(axis=1), axis=1) < MAX_HELD_RATE_RAD_S
    slow &= np.abs(blocks).max(axis=(1, 2)) < 4 * MAX_HELD_RATE_RAD_S
    for rest in rests:
        slow &= (times[:, -1] < rest.start_s - BLOCK_S) | (times[:, 0] > rest.end_s + BLOCK_S)
    runs = equal_runs(slow)
    intervals = (
        (float(times[first, 0]), float(times[last - 1, -1])) for first, last in runs[slow[runs[:, 0]]].tolist()
    )
    return tuple((start_s, end_s) for start_s, end_s in intervals if end_s - start_s >= MIN_HELD_S)


State = Literal["starting", "resting", "moving", "held"]


@dataclass(frozen=True, slots=True)
class Live:
    """The body's `state` at `time_s`, and the time `since_s` at which this state began.

    `turned_rad` (3,) and `peak_rad_s` are the rotation and the largest rate of the present move so far.
    """

    time_s: float
    state: State
    since_s: float
    turned_rad: Array
    peak_rad_s: float


class Segmenter:
    """A segmentation in progress. At any time its result equals what `segment_session` returns for the readings so far.

    A rest is final, that is, `feed` returns it, once it has lasted `MIN_REST_S`. `range_rad_s` is the range of the
    gyroscope, None if unknown.
    """

    def __init__(self, range_rad_s: float | None = None) -> None:
        self._range_rad_s = range_rad_s
        self._blocks: list[tuple[Array, Array, Array | None]] = []
        self._given_s = -np.inf  # beginning of the last rest that was given
        self._looked_s = -np.inf
        self._session = HandRecording(np.empty(0), np.empty((0, 3)), None, (), ())

    def feed(self, time_s: Array, rates: Array, acceleration: Array | None = None) -> tuple[HandRest | Move, ...]:
        """Add the next readings (k, 3) at times (k,); return the moves and rests that are final since the last call."""
        if not len(time_s):
            return ()
        self._blocks.append((time_s, rates, acceleration))
        if time_s[-1] < self._looked_s + EVALUATION_S:
            return ()
        self._looked_s = float(time_s[-1])
        self._session = segment_session(*self._all(), range_rad_s=self._range_rad_s)
        settled: list[HandRest | Move] = []
        for row, rest in enumerate(self._session.rests):
            if rest.end_s - rest.start_s < MIN_REST_S - 2 * MARGIN_S or rest.start_s < self._given_s + EVALUATION_S:
                continue
            if row:
                settled.append(self._session.moves[row - 1])
            settled.append(rest)
            self._given_s = rest.start_s
        return tuple(settled)

    @property
    def handled(self) -> HandRecording:
        """The recording's rests and moves up to the last rest that has lasted `MIN_REST_S`."""
        session = self._session
        count = len(session.rests)
        while count and session.rests[count - 1].end_s - session.rests[count - 1].start_s < MIN_REST_S - 2 * MARGIN_S:
            count -= 1
        return replace(session, rests=session.rests[:count], moves=session.moves[: max(count - 1, 0)])

    @property
    def live(self) -> Live:
        """The body's state at the latest evaluation."""
        session = self._session
        if not session.rests:
            return Live(self._looked_s, "starting", self._looked_s, np.zeros(3), 0.0)
        last, now_s = session.rests[-1], self._looked_s
        if now_s - last.end_s < MARGIN_S + 2 * BLOCK_S:
            return Live(now_s, "resting", last.start_s - MARGIN_S, np.zeros(3), 0.0)
        moving = session.time_s > last.end_s
        rates = session.rates[moving] - last.mean_rad_s
        turned_rad = np.asarray(np.trapezoid(rates, session.time_s[moving], axis=0), dtype=np.float64)
        span = next((span for span in session.held_in_air_s if span[1] > now_s - 2 * BLOCK_S), None)
        state: State = "moving" if span is None else "held"
        since_s = last.end_s if span is None else span[0]
        return Live(now_s, state, since_s, turned_rad, float(np.abs(rates).max()))

    def _all(self) -> tuple[Array, Array, Array | None]:
        time_s, rates, acceleration = zip(*self._blocks, strict=True)
        forces = [block for block in acceleration if block is not None]
        whole = (np.concatenate(time_s), np.concatenate(rates), np.concatenate(forces) if forces else None)
        self._blocks = [whole]
        return whole
