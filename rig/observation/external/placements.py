"""What sensors read in the attitudes in which a body was laid down: only rests tell gravity, or a field.

A placement is a rest of the recording (`rig.observation.by_hand.rests`) and the rows of a reference that fall into it:
rows that follow each other without a movement in between are one placement, however many they are. Rests of which the
reference says nothing tell the size of what is felt all the same.

A knock costs the readings that felt it, and no more: where the body reads the same before and after, it lay still.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig.data.installed_kinds import quantities
from rig.data.quantity import RATE, Quantity
from rig.estimation.arrays import Array
from rig.estimation.sensor_axes import nearest_rotation
from rig.observation.by_hand.knocks import without_knocks
from rig.observation.by_hand.rests import BLOCK_S, COUNTS, find_rests
from rig.observation.by_hand.steadiness import BEYOND
from rig.observation.external.csv_windows import MIN_SAMPLES, scatter_of
from rig.observation.external.omitted import Omitted
from rig.observation.external.placement_account import Account, AttitudeRows
from rig.observation.external.still_attitudes import DWELL_S, still_windows
from rig.observation.statistics.mean import Mean
from rig.observation.windows import Window, inside

TURNED_RAD = 0.02  # rows of one rest that are farther apart: it was turned about what it feels
INTERRUPTED_S = 1.0  # a body that reads the same before and after lay still, for as long at most
MOSTLY = 0.5  # of a dwell, in which the body lies still: then the rest of it is left out, and not the dwell


@dataclass(frozen=True, slots=True)
class Rested:
    """What N rests tell: `means` (N, 3) of every quantity, their `variances` (N, 3), the `freedom` (N, 3) of these.

    `windows` from the first to the last of the `samples` (N,) that each has.
    """

    means: Mapping[Quantity, Array]
    variances: Mapping[Quantity, Array]
    freedom: Mapping[Quantity, Array]
    windows: tuple[Window, ...]
    samples: tuple[int, ...]

    def mean(self, quantity: Quantity, rest: int) -> Mean:
        """What was read in one of them."""
        variance, samples = self.variances[quantity][rest], self.samples[rest]
        noise = np.sqrt(variance * samples)
        return Mean(self.means[quantity][rest], variance, noise, samples, self.freedom[quantity][rest])


@dataclass(frozen=True, slots=True)
class Placements:
    """N placements: what was `read`, `attitudes` (N, 3, 3), body to table, and `attitude_std_rad` (N,) as stated.

    `elsewhere` are rests without an attitude; `left_out` how many rows were none, for the body moved. `omitted` says
    what else is left out, and of dwells which.
    """

    read: Rested
    attitudes: Array
    attitude_std_rad: Array | None
    elsewhere: Rested
    left_out: int
    omitted: tuple[Omitted, ...] = ()


@dataclass(frozen=True, slots=True)
class _Rest:
    """A rest in `pieces`, which knocks have cut, and the numbers of its `samples`."""

    number: int
    pieces: tuple[Window, ...]
    samples: NDArray[np.intp]

    @property
    def start_s(self) -> float:
        return self.pieces[0].start_s

    @property
    def end_s(self) -> float:
        return self.pieces[-1].end_s


def find_placements(time_s: Array, readings: Mapping[Quantity, Array], rows: AttitudeRows) -> Placements:
    """Return the placements found in readings (n, 3) at rising times (n,) by a reference's rows.

    Raises Fault `not_at_rest` where the body moves in every row, or in more of the dwells than it lies still in.
    """
    dwells = np.array([window.end_s - window.start_s >= DWELL_S for window in rows.windows])
    windows_s = np.array([(window.start_s, window.end_s) for window in rows.windows])
    lying = still_windows(windows_s, rows.attitudes)
    pieces = _rejoined(time_s, readings, find_rests(time_s, readings, lying=lying))
    rests = [
        _Rest(number, each, np.concatenate([_closed(time_s, piece) for piece in each]))
        for number, each in enumerate(pieces)
    ]
    starts, ends = np.array([each.start_s for each in rests]), np.array([each.end_s for each in rests])
    found = []
    for window in rows.windows:
        near = slice(*(int(np.searchsorted(*each)) for each in ((ends, window.start_s), (starts, window.end_s))))
        found.append(_placed(time_s, window, rests[near]))
    rest, cuts = np.array([number for number, _ in found]), [cut for _, cut in found]
    groups = _groups(rest, rows.attitudes)
    account = Account(time_s, rows, rest, cuts, dwells)
    account.check_mostly_at_rest()
    covered = [np.unique(np.concatenate([cuts[row] for row in group])) for group in groups]
    named = {int(each) for each in rest}
    read, knocked = _read(time_s, readings, covered)
    return Placements(
        read,
        np.array([nearest_rotation(rows.attitudes[group].mean(axis=0)) for group in groups]),
        None if rows.std_rad is None else np.array([np.sqrt(np.mean(rows.std_rad[group] ** 2)) for group in groups]),
        _read(time_s, readings, [each.samples for each in rests if each.number not in named])[0],
        int((rest < 0).sum()),
        tuple(account.omitted(knocked)),
    )


def _closed(time_s: Array, window: Window) -> NDArray[np.intp]:
    """The samples of a window, those at either end too."""
    first, last = np.searchsorted(time_s, window.start_s), np.searchsorted(time_s, window.end_s, side="right")
    return np.arange(first, last)


def _rejoined(time_s: Array, readings: Mapping[Quantity, Array], rests: Sequence[Window]) -> list[tuple[Window, ...]]:
    """Rests in pieces, which knocks have cut: it reads the same before and after, and has not turned in between."""
    quantity = next(each for each in quantities().values() if each in readings)
    joined: list[tuple[Window, ...]] = []
    for rest in rests:
        if joined and _same_rest(time_s, readings[quantity], quantity, joined[-1][-1], rest):
            joined[-1] = (*joined[-1], rest)
        else:
            joined.append((rest,))
    return joined


def _same_rest(time_s: Array, read: Array, quantity: Quantity, before: Window, after: Window) -> bool:
    if after.start_s - before.end_s > INTERRUPTED_S:
        return False
    one, other = (read[_closed(time_s, each)] for each in (before, after))
    noise = np.maximum(np.minimum(one.std(axis=0), other.std(axis=0)), COUNTS * quantity.steady)
    apart = quantity.steady + BEYOND * noise * np.sqrt(1 / len(one) + 1 / len(other))
    if (np.abs(one.mean(axis=0) - other.mean(axis=0)) > apart).any():
        return False
    between = _closed(time_s, Window(before.end_s, after.start_s))
    if np.diff(time_s[between]).max() > BLOCK_S:
        return False
    if quantity != RATE:
        return True
    turned = np.trapezoid(read[between] - one.mean(axis=0), time_s[between], axis=0)
    return bool(np.linalg.norm(turned) <= TURNED_RAD)


def _placed(time_s: Array, window: Window, rests: Sequence[_Rest]) -> tuple[int, NDArray[np.intp]]:
    """The number of the rest that a row lies in, −1 of none, and its samples at rest.

    All of a row lies in it, to a block at either end; of a dwell most, if the body lies nowhere else in it.
    """
    row, nothing = inside(time_s, window), np.zeros(0, dtype=np.intp)
    met: list[tuple[int, float, NDArray[np.intp]]] = []
    for rest in rests:
        overlap_s = sum(
            max(min(window.end_s, each.end_s) - max(window.start_s, each.start_s), 0) for each in rest.pieces
        )
        cut = rest.samples[slice(*np.searchsorted(rest.samples, [row.start, row.stop]).tolist())]
        if overlap_s <= 0 or not len(cut):
            continue
        if rest.start_s - BLOCK_S <= window.start_s and window.end_s <= rest.end_s + BLOCK_S:
            return rest.number, cut
        met.append((rest.number, overlap_s, cut))
    lasts_s = window.end_s - window.start_s
    if lasts_s < DWELL_S or sum(overlap_s > BLOCK_S for _, overlap_s, _ in met) != 1:
        return -1, nothing
    number, overlap_s, cut = max(met, key=lambda each: each[1])
    return (number, cut) if overlap_s >= MOSTLY * lasts_s else (-1, nothing)


def _groups(rest: NDArray[np.intp], attitudes: Array) -> list[NDArray[np.intp]]:
    """The rows of each placement."""
    groups: list[list[int]] = []
    last: dict[int, list[int]] = {}
    for row in np.flatnonzero(rest >= 0).tolist():
        before = last.get(int(rest[row]))
        if before is not None and _apart(attitudes[before[0]], attitudes[row]) <= TURNED_RAD:
            before.append(row)
            continue
        groups.append([row])
        last[int(rest[row])] = groups[-1]
    return [np.array(group) for group in groups]


def _apart(one: Array, other: Array) -> float:
    """The angle by which two rotations (3, 3) differ, rad."""
    return float(np.arccos(np.clip((np.trace(one.T @ other) - 1) / 2, -1, 1)))


def _read(
    time_s: Array, readings: Mapping[Quantity, Array], cuts: Sequence[NDArray[np.intp]]
) -> tuple[Rested, NDArray[np.intp]]:
    """The means of the rests, of few samples with the noise of all long enough; and the samples that were knocked."""
    means, variances, freedom = {}, {}, {}
    knocked = np.zeros(0, dtype=np.intp)
    for quantity, each in readings.items():
        axes = each.shape[1]
        untold = (np.full(axes, np.nan), np.full(axes, np.nan))  # variances and their freedom, of too few samples
        kept = [cut[without_knocks(each[cut], quantity)] for cut in cuts]
        knocked = np.unique(np.concatenate([knocked, *map(np.setdiff1d, cuts, kept)]))
        means[quantity] = np.array([each[cut].mean(axis=0) for cut in kept]).reshape(-1, axes)
        found = [scatter_of(each[cut])[:2] if len(cut) >= MIN_SAMPLES else untold for cut in kept]
        told, counted = np.array(found).reshape(-1, 2, axes).swapaxes(0, 1)
        variances[quantity] = _filled(told, np.array([len(cut) for cut in kept]), each, quantity)
        fewest = len(each) - 1.0 if np.isnan(counted).all() else np.nanmin(counted)
        freedom[quantity] = np.where(np.isnan(counted), fewest, counted)
    windows = tuple(Window(float(time_s[cut[0]]), float(time_s[cut[-1]])) for cut in cuts)
    return Rested(means, variances, freedom, windows, tuple(map(len, cuts))), knocked


def _filled(variances: Array, counts: NDArray[np.intp], readings: Array, quantity: Quantity) -> Array:
    """(N, 3) variances with what too few samples do not tell, from the others or from how readings (n, 3) jump."""
    unknown = np.isnan(variances[:, 0])
    if not unknown.any():
        return variances
    if unknown.all():
        jumps = np.diff(readings, axis=0)
        of_one = jumps[without_knocks(jumps, quantity)].var(axis=0) / 2
    else:
        of_one = np.median((variances * counts[:, None])[~unknown], axis=0)
    return np.where(unknown[:, None], of_one / np.maximum(counts, 1)[:, None], variances)
