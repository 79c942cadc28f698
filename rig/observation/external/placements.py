"""Sensor readings in the attitudes in which a body was laid down, because only a rest shows gravity or a field alone.

A placement is a rest of the recording (`rig.observation.by_hand.rests`) that contains rows of a reference. Consecutive
rows without a movement in between are one placement. Rests without a row still show the norm of gravity or the field.

A knock or a gap does not end a placement if the readings before and after are equal, because the body then lay still.
Only the readings in between are left out.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig.data.installed_kinds import quantities
from rig.data.quantity import RATE, Quantity
from rig.estimation.arrays import Array
from rig.estimation.sensor_axes import nearest_rotation
from rig.observation.by_hand.knocks import mask_knocks
from rig.observation.by_hand.rests import BLOCK_S, MIN_SCATTER_FRACTION, find_rests
from rig.observation.by_hand.steadiness import MAX_NOISE_STDS
from rig.observation.external.csv_windows import MIN_SAMPLES, scatter_of
from rig.observation.external.omission import Omitted
from rig.observation.external.placement_account import Account, AttitudeRows
from rig.observation.external.still_attitudes import MAX_TIME_ERROR_S, MIN_DWELL_S, still_windows
from rig.observation.statistics.mean import Mean
from rig.observation.windows import Window, inside

MAX_REST_ANGLE_RAD = 0.02  # between rows of one rest, beyond which the body was turned about the measured vector
MAX_KNOCK_S = 1.0  # after which equal readings show that the body did not move
MAX_DISTURBANCE_S = 2.0  # in a dwell
MIN_STILL_FRACTION = 0.5  # of a dwell in which the body lies still; otherwise the whole dwell is left out


@dataclass(frozen=True, slots=True)
class RestMeans:
    """Averages in N rests: `means` (N, 3) of every quantity, their `variances` (N, 3), and the variances' `dof` (N, 3).

    `samples`: the number of samples of each rest; `windows`: from the first to the last of these samples.
    """

    means: Mapping[Quantity, Array]
    variances: Mapping[Quantity, Array]
    dof: Mapping[Quantity, Array]
    windows: tuple[Window, ...]
    samples: tuple[int, ...]

    def mean(self, quantity: Quantity, rest: int) -> Mean:
        """Return the mean reading of one rest."""
        variance, samples = self.variances[quantity][rest], self.samples[rest]
        noise = np.sqrt(variance * samples)
        return Mean(self.means[quantity][rest], variance, noise, samples, self.dof[quantity][rest])


@dataclass(frozen=True, slots=True)
class Placements:
    """N placements: averages of the readings (`read`), and attitudes as a reference states them.

    - `attitudes` (N, 3, 3): rotations from body to table; `attitude_std_rad` (N,): their standard deviations, or None.
    - `unplaced`: averages in rests without an attitude.
    - `left_out`: number of rows in which the body moved; `omitted`: everything else that is left out.
    """

    read: RestMeans
    attitudes: Array
    attitude_std_rad: Array | None
    unplaced: RestMeans
    left_out: int
    omitted: tuple[Omitted, ...] = ()


@dataclass(frozen=True, slots=True)
class _PlacedRest:
    """A rest: its `number` among all rests, its `windows` between knocks, and the indices of its `samples`."""

    number: int
    windows: tuple[Window, ...]
    samples: NDArray[np.intp]

    @property
    def start_s(self) -> float:
        return self.windows[0].start_s

    @property
    def end_s(self) -> float:
        return self.windows[-1].end_s


def find_placements(time_s: Array, readings: Mapping[Quantity, Array], rows: AttitudeRows) -> Placements:
    """Return the placements: the rests in readings (n, 3), at rising times (n,), for which a row states the attitude.

    Raise Fault `not_at_rest` if the body moves in every row, or in more than half of the dwells (long rows), or
    `lost_samples` if gaps hide the rests.
    """
    dwells = np.array([window.end_s - window.start_s >= MIN_DWELL_S for window in rows.windows])
    windows_s = np.array([(window.start_s, window.end_s) for window in rows.windows])
    lying = still_windows(windows_s, rows.attitudes)
    stated = [window for window, lasts in zip(rows.windows, dwells.tolist(), strict=True) if lasts]
    joined = _join_rests(time_s, readings, find_rests(time_s, readings, lying=lying), stated)
    rests = [
        _PlacedRest(number, windows, np.concatenate([_closed_slice(time_s, window) for window in windows]))
        for number, windows in enumerate(joined)
    ]
    starts, ends = np.array([placed.start_s for placed in rests]), np.array([placed.end_s for placed in rests])
    matches = []
    for window in rows.windows:
        near = slice(int(np.searchsorted(ends, window.start_s)), int(np.searchsorted(starts, window.end_s)))
        matches.append(_find_rest(time_s, window, rests[near]))
    rest_numbers, cuts = np.array([number for number, _ in matches]), [cut for _, cut in matches]
    is_inner = dwells | _mask_inner(rest_numbers, windows_s, starts, ends)
    groups = _group_by_placement(np.where(is_inner, rest_numbers, -1), rows.attitudes)
    account = Account(time_s, rows, rest_numbers, cuts, dwells)
    account.check_mostly_at_rest()
    covered = [np.unique(np.concatenate([cuts[row] for row in group])) for group in groups]
    named = {int(number) for number in rest_numbers}
    read, knocked = _read(time_s, readings, covered)
    return Placements(
        read,
        np.array([nearest_rotation(rows.attitudes[group].mean(axis=0)) for group in groups]),
        None if rows.std_rad is None else np.array([np.sqrt(np.mean(rows.std_rad[group] ** 2)) for group in groups]),
        _read(time_s, readings, [placed.samples for placed in rests if placed.number not in named])[0],
        int((rest_numbers < 0).sum()),
        tuple(account.list_omitted(knocked)),
    )


def _closed_slice(time_s: Array, window: Window) -> NDArray[np.intp]:
    """Return the indices of the samples of a window, including those at either end."""
    first, last = np.searchsorted(time_s, window.start_s), np.searchsorted(time_s, window.end_s, side="right")
    return np.arange(first, last)


def _join_rests(
    time_s: Array, readings: Mapping[Quantity, Array], rests: Sequence[Window], dwells: Sequence[Window]
) -> list[tuple[Window, ...]]:
    """Return the rests in groups: rests in the same group are separated only by knocks, not by a movement."""
    joined: list[tuple[Window, ...]] = []
    for rest in rests:
        if joined and _same_rest(time_s, readings, joined[-1][-1], rest, dwells):
            joined[-1] = (*joined[-1], rest)
        else:
            joined.append((rest,))
    return joined


def _same_rest(
    time_s: Array, readings: Mapping[Quantity, Array], before: Window, after: Window, dwells: Sequence[Window]
) -> bool:
    """Return whether the body lay still between two rests, except for a knock.

    A knock is short, but within one of the `dwells`, which state one attitude, it may be longer. In a gap of a
    gyroscope's readings the body may have turned, so the other quantities must show that it has not.
    """
    between = _closed_slice(time_s, Window(before.end_s, after.start_s))
    gap_s = float(np.diff(time_s[between]).max())
    has_gap = gap_s > BLOCK_S
    is_inner = any(dwell.start_s <= before.end_s and after.start_s <= dwell.end_s for dwell in dwells)
    longest_s = MAX_DISTURBANCE_S if is_inner else MAX_KNOCK_S
    if after.start_s - before.end_s > longest_s + (gap_s if has_gap else 0.0):
        return False
    cuts = (_closed_slice(time_s, before), _closed_slice(time_s, after))
    first, *others = (quantity for quantity in quantities().values() if quantity in readings)
    if not _reads_alike(readings[first], first, *cuts):
        return False
    if first != RATE:
        return True
    if has_gap:
        return bool(others) and all(_reads_alike(readings[quantity], quantity, *cuts) for quantity in others)
    bias = readings[RATE][cuts[0]].mean(axis=0)
    turned_rad = np.trapezoid(readings[RATE][between] - bias, time_s[between], axis=0)
    return bool(np.linalg.norm(turned_rad) <= MAX_REST_ANGLE_RAD)


def _reads_alike(read: Array, quantity: Quantity, before: NDArray[np.intp], after: NDArray[np.intp]) -> bool:
    """Return whether the parts `before` and `after` of readings (n, 3) at rest have the same mean within the noise."""
    one, other = read[before], read[after]
    noise = np.maximum(np.minimum(one.std(axis=0), other.std(axis=0)), MIN_SCATTER_FRACTION * quantity.steady)
    tolerance = quantity.steady + MAX_NOISE_STDS * noise * np.sqrt(1 / len(one) + 1 / len(other))
    return bool((np.abs(one.mean(axis=0) - other.mean(axis=0)) <= tolerance).all())


def _find_rest(time_s: Array, window: Window, rests: Sequence[_PlacedRest]) -> tuple[int, NDArray[np.intp]]:
    """Return the number of the rest that contains a row, −1 if none does, and the row's samples at rest.

    A rest contains a row that extends at most `BLOCK_S` beyond the rest at either end. For a dwell (a long row) it
    suffices that a rest overlaps at least half of it, and that no other rest overlaps it by more than `BLOCK_S`.
    """
    row, nothing = inside(time_s, window), np.zeros(0, dtype=np.intp)
    met: list[tuple[int, float, NDArray[np.intp]]] = []
    for rest in rests:
        overlap_s = sum(
            max(min(window.end_s, part.end_s) - max(window.start_s, part.start_s), 0) for part in rest.windows
        )
        cut = rest.samples[slice(*np.searchsorted(rest.samples, [row.start, row.stop]).tolist())]
        if overlap_s <= 0 or not len(cut):
            continue
        if rest.start_s - BLOCK_S <= window.start_s and window.end_s <= rest.end_s + BLOCK_S:
            return rest.number, cut
        met.append((rest.number, overlap_s, cut))
    lasts_s = window.end_s - window.start_s
    if lasts_s < MIN_DWELL_S or sum(overlap_s > BLOCK_S for _, overlap_s, _ in met) != 1:
        return -1, nothing
    number, overlap_s, cut = max(met, key=lambda match: match[1])
    return (number, cut) if overlap_s >= MIN_STILL_FRACTION * lasts_s else (-1, nothing)


def _mask_inner(rest: NDArray[np.intp], windows_s: Array, starts_s: Array, ends_s: Array) -> NDArray[np.bool_]:
    """Return a mask (N,) of the rows in a rest, except rows near the start or end of the rest.

    Near the ends of a rest, a lagging reference still shows motion. If all rows of a rest are near an end, the mask
    includes them all. `rest` (N,): the number of the rest in which each row lies, or −1.
    """
    at_rest = np.flatnonzero(rest >= 0)
    middles_s, number = windows_s[at_rest].mean(axis=1), rest[at_rest]
    is_inner = (middles_s >= starts_s[number] + MAX_TIME_ERROR_S) & (middles_s <= ends_s[number] - MAX_TIME_ERROR_S)
    inner = np.zeros(len(rest), dtype=np.bool_)
    inner[at_rest] = is_inner | ~np.isin(number, number[is_inner])
    return inner


def _group_by_placement(rest: NDArray[np.intp], attitudes: Array) -> list[NDArray[np.intp]]:
    """Return the rows of each placement: rows of the same `rest` (N,) with nearly equal attitudes."""
    groups: list[list[int]] = []
    last: dict[int, list[int]] = {}
    for row in np.flatnonzero(rest >= 0).tolist():
        before = last.get(int(rest[row]))
        if before is not None and _angle_between_rad(attitudes[before[0]], attitudes[row]) <= MAX_REST_ANGLE_RAD:
            before.append(row)
            continue
        groups.append([row])
        last[int(rest[row])] = groups[-1]
    return [np.array(group) for group in groups]


def _angle_between_rad(one: Array, other: Array) -> float:
    """Return the angle, rad, between two attitudes (3, 3)."""
    return float(np.arccos(np.clip((np.trace(one.T @ other) - 1) / 2, -1, 1)))


def _read(
    time_s: Array, readings: Mapping[Quantity, Array], cuts: Sequence[NDArray[np.intp]]
) -> tuple[RestMeans, NDArray[np.intp]]:
    """Return the means of the rests, and the indices of the samples in knocks; `cuts` are the samples of each rest.

    The variance of a rest with few samples is computed from the noise of the other rests.
    """
    means = {}
    variances = {}
    dof = {}
    knocked = np.zeros(0, dtype=np.intp)
    for quantity, values in readings.items():
        axes = values.shape[1]
        # Too few samples for variances and their degrees of freedom.
        unknown = (np.full(axes, np.nan), np.full(axes, np.nan))
        kept = [cut[mask_knocks(values[cut], quantity)] for cut in cuts]
        knocked = np.unique(np.concatenate([knocked, *map(np.setdiff1d, cuts, kept)]))
        means[quantity] = np.array([values[cut].mean(axis=0) for cut in kept]).reshape(-1, axes)
        estimates = [scatter_of(values[cut])[:2] if len(cut) >= MIN_SAMPLES else unknown for cut in kept]
        noise, dofs = np.array(estimates).reshape(-1, 2, axes).swapaxes(0, 1)
        variances[quantity] = _fill_variances(noise, np.array([len(cut) for cut in kept]), values, quantity)
        fewest = len(values) - 1.0 if np.isnan(dofs).all() else np.nanmin(dofs)
        dof[quantity] = np.where(np.isnan(dofs), fewest, dofs)
    windows = tuple(Window(float(time_s[cut[0]]), float(time_s[cut[-1]])) for cut in cuts)
    return RestMeans(means, variances, dof, windows, tuple(map(len, cuts))), knocked


def _fill_variances(variances: Array, counts: NDArray[np.intp], readings: Array, quantity: Quantity) -> Array:
    """Return variances (N, 3) of the rests' means, with those that are NaN computed from the noise elsewhere.

    The noise is that of the other rests, or of the differences of successive readings (n, 3) if all variances are NaN.
    """
    unknown = np.isnan(variances[:, 0])
    if not unknown.any():
        return variances
    if unknown.all():
        jumps = np.diff(readings, axis=0)
        of_one = jumps[mask_knocks(jumps, quantity)].var(axis=0) / 2
    else:
        of_one = np.median((variances * counts[:, None])[~unknown], axis=0)
    return np.where(unknown[:, None], of_one / np.maximum(counts, 1)[:, None], variances)
