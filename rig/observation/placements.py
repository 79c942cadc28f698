"""What sensors read in the attitudes in which a body was laid down: only rests tell gravity, or a field.

A placement is a rest of the recording (`rig.observation.rests`) and the rows of a reference that fall into it: rows
that follow each other without a movement in between are one placement, however many they are. Rests of which the
reference says nothing tell the size of what is felt all the same.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig.data.quantity import Quantity
from rig.errors import Fault
from rig.estimation.arrays import Array
from rig.estimation.sensor_axes import nearest_rotation
from rig.observation.csv_windows import MIN_SAMPLES, scatter_of
from rig.observation.mean import Mean
from rig.observation.rests import BLOCK_S, find_rests
from rig.observation.windows import Window, inside

TURNED_RAD = 0.02  # rows of one rest that are farther apart: it was turned about what it feels


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

    `elsewhere` are rests without an attitude; `left_out` how many rows were none, for the body moved.
    """

    read: Rested
    attitudes: Array
    attitude_std_rad: Array | None
    elsewhere: Rested
    left_out: int


def find_placements(
    time_s: Array,
    readings: Mapping[Quantity, Array],
    windows: Sequence[Window],
    attitudes: Array,
    std_rad: Array | None,
) -> Placements:
    """Placements found in readings (n, 3) at rising times (n,) by a reference's rows.

    Raises Fault `not_at_rest` where the body moves in every row.
    """
    rests = find_rests(time_s, readings)
    rest = np.array([_rest_of(window, rests) for window in windows])
    groups = _groups(rest, attitudes)
    if not groups:
        raise Fault(
            "not_at_rest",
            f"the body moves in all of {len(windows)} rows, but only a body at rest feels gravity, or a "
            "field, and nothing else",
            "Add attitudes in which it lies still for half a second or longer",
        )
    covered = [_covered(time_s, rests[rest[group[0]]], [windows[row] for row in group]) for group in groups]
    named = {int(each) for each in rest}
    others = [inside(time_s, each) for number, each in enumerate(rests) if number not in named]
    return Placements(
        _read(time_s, readings, covered),
        np.array([nearest_rotation(attitudes[group].mean(axis=0)) for group in groups]),
        None if std_rad is None else np.array([np.sqrt(np.mean(std_rad[group] ** 2)) for group in groups]),
        _read(time_s, readings, [np.arange(each.start, each.stop) for each in others]),
        int((rest < 0).sum()),
    )


def _rest_of(window: Window, rests: Sequence[Window]) -> int:
    """The number of the rest that a row lies in, to a block at either end; −1 of none."""
    for number, rest in enumerate(rests):
        if rest.start_s - BLOCK_S <= window.start_s and window.end_s <= rest.end_s + BLOCK_S:
            overlap_s = min(window.end_s, rest.end_s) - max(window.start_s, rest.start_s)
            if overlap_s > 0:
                return number
    return -1


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


def _covered(time_s: Array, rest: Window, windows: Sequence[Window]) -> NDArray[np.intp]:
    """The samples of a rest that rows name."""
    cuts = [inside(time_s, Window(max(each.start_s, rest.start_s), min(each.end_s, rest.end_s))) for each in windows]
    return np.unique(np.concatenate([np.arange(each.start, each.stop) for each in cuts]))


def _read(time_s: Array, readings: Mapping[Quantity, Array], cuts: Sequence[NDArray[np.intp]]) -> Rested:
    """The means of the rests; of few samples, with the noise of all that are long enough."""
    means, variances, freedom = {}, {}, {}
    for quantity, each in readings.items():
        axes = each.shape[1]
        untold = (np.full(axes, np.nan), np.full(axes, np.nan))  # variances and their freedom, of too few samples
        means[quantity] = np.array([each[cut].mean(axis=0) for cut in cuts]).reshape(-1, axes)
        found = [scatter_of(each[cut])[:2] if len(cut) >= MIN_SAMPLES else untold for cut in cuts]
        told, counted = np.array(found).reshape(-1, 2, axes).swapaxes(0, 1)
        variances[quantity] = _filled(told, np.array([len(cut) for cut in cuts]), each)
        fewest = len(each) - 1.0 if np.isnan(counted).all() else np.nanmin(counted)
        freedom[quantity] = np.where(np.isnan(counted), fewest, counted)
    windows = tuple(Window(float(time_s[cut[0]]), float(time_s[cut[-1]])) for cut in cuts)
    return Rested(means, variances, freedom, windows, tuple(map(len, cuts)))


def _filled(variances: Array, counts: NDArray[np.intp], readings: Array) -> Array:
    """(N, 3) variances with what too few samples do not tell, from the others or from how readings (n, 3) jump."""
    unknown = np.isnan(variances[:, 0])
    if not unknown.any():
        return variances
    of_one = (
        np.diff(readings, axis=0).var(axis=0) / 2
        if unknown.all()
        else np.median((variances * counts[:, None])[~unknown], axis=0)
    )
    return np.where(unknown[:, None], of_one / np.maximum(counts, 1)[:, None], variances)
