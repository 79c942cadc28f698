"""The rows of a reference that are not placements, and the readings left out of placements, with the reasons."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rig.errors import Fault
from rig.estimation.arrays import Array
from rig.observation.by_hand.rests import BLOCK_S
from rig.observation.external.omission import Omitted
from rig.observation.time_stamps.sampling import find_sampling
from rig.observation.windows import Window, inside


@dataclass(frozen=True, slots=True)
class AttitudeRows:
    """N rows of a reference: `windows`, `attitudes` (N, 3, 3) from body to table, and the rows' `numbers` in the file.

    `std_rad` (N,): the attitudes' stated standard deviations, or None.
    """

    windows: Sequence[Window]
    attitudes: Array
    numbers: NDArray[np.intp]
    std_rad: Array | None = None


@dataclass(frozen=True, slots=True)
class Account:
    """The placements among the N `rows` of a reference, for readings at `time_s` (n,).

    - `rest` (N,): for each row the number of the rest that contains the row, −1 without one.
    - `cuts`: for each row the indices of those of its samples that were taken at rest.
    - `dwells` (N,): mask of rows that last so long that they declare a rest.
    """

    time_s: Array
    rows: AttitudeRows
    rest: NDArray[np.intp]
    cuts: Sequence[NDArray[np.intp]]
    dwells: NDArray[np.bool_]

    def check_mostly_at_rest(self) -> None:
        """Raise Fault `not_at_rest` if the body moves in all rows, or in more than half of the dwells.

        Raise `lost_samples` instead if most of the dwells without a rest have a gap in the readings that hides the
        rest.
        """
        left_out, windows = int((self.rest[self.dwells] < 0).sum()), self.rows.windows
        if (self.rest >= 0).any() and 2 * left_out <= int(self.dwells.sum()):
            return
        if 2 * int((self._find_gaps_s(self.dwells) > 0).sum()) > left_out > 0:
            raise Fault(
                "lost_samples",
                f"{next(self._moving(self.dwells))}",
                "See that the sensor's link loses nothing; give rows without a gap",
            )
        what = f"the body moves in all of {len(windows)} rows, the first from {windows[0].start_s:.10g} s"
        if (self.rest >= 0).any():
            what = f"more rows are left out than kept: {next(self._moving(self.dwells))}"
        raise Fault(
            "not_at_rest",
            f"{what}; but a sensor measures gravity, or a field, alone only while the body is at rest",
            "Add attitudes in which it lies still for half a second or longer; begin a row when it lies still",
        )

    def list_omitted(self, knocked: NDArray[np.intp]) -> Iterator[Omitted]:
        """Yield entries for omitted rows, and for readings omitted from dwells because of a knock, motion or a gap."""
        yield from self._moving(np.ones_like(self.dwells))
        kept = [self._inside(row) for row in self._kept]
        total = sum(map(len, kept))
        knocks = [np.intersect1d(knocked, samples) for samples in kept]
        moved = [self._find_moved(row) for row in self._kept]
        for samples_by_row, reason in (
            (knocks, "knocks that the other sensors did not measure"),
            (moved, "not_at_rest: the body was knocked or moved"),
        ):
            if count := sum(map(len, samples_by_row)):
                row, samples = next(
                    (row, samples) for row, samples in zip(self._kept, samples_by_row, strict=True) if len(samples)
                )
                yield Omitted(
                    "readings at rest", count, total, reason, self._where(row, float(self.time_s[samples[0]]))
                )
        yield from self._missing(kept)

    def _missing(self, kept: Sequence[NDArray[np.intp]]) -> Iterator[Omitted]:
        """Yield one entry for all readings missing in the dwells, if any; `kept` holds the samples of each dwell."""
        sampling = find_sampling(self.time_s)
        windows_s = np.array([(window.start_s, window.end_s) for window in self.rows.windows]).reshape(-1, 2)
        expected = np.floor(sampling.count_expected(self.time_s, windows_s[self._kept])).astype(int)
        gaps = [samples[:-1][sampling.missing[samples[:-1]] > 0] for samples in kept]
        inside = [int(sampling.missing[before_gaps].sum()) for before_gaps in gaps]
        lost = [
            max(within, wanted - len(samples)) for within, wanted, samples in zip(inside, expected, kept, strict=True)
        ]
        if not any(lost):
            return
        first = next(number for number, count in enumerate(lost) if count)
        row = self._kept[first]
        at_s = self.time_s[gaps[first][0]] if len(gaps[first]) else self.rows.windows[row].start_s
        reason = "lost_samples: they are missing"
        yield Omitted(
            "readings at rest", sum(lost), sum(lost) + sum(map(len, kept)), reason, self._where(row, float(at_s))
        )

    def _where(self, row: int, time_s: float) -> str:
        return f"at {time_s:.10g} s, in row {self.rows.numbers[row]}"

    @property
    def _kept(self) -> list[int]:
        return [int(row) for row in np.flatnonzero((self.rest >= 0) & self.dwells)]

    def _moving(self, rows: NDArray[np.bool_]) -> Iterator[Omitted]:
        """Yield one entry for the `rows` with a gap, and one for those in which the body moves, if any."""
        left_out, gaps_s, total = (self.rest < 0) & rows, self._find_gaps_s(rows), int(rows.sum())
        if len(lacking := np.flatnonzero(gaps_s > 0)):
            first = int(lacking[0])
            edges_s = self._list_edges_s(first)
            where = f"row {self.rows.numbers[first]}, after {edges_s[np.argmax(np.diff(edges_s))]:.10g} s"
            reason = f"lost_samples: readings are missing for up to {gaps_s.max():.3g} s, in which the body may move"
            yield Omitted("rows", len(lacking), total, reason, where)
        if len(moving := np.flatnonzero(left_out & (gaps_s == 0))):
            first = int(moving[0])
            where = f"row {self.rows.numbers[first]}, from {self.rows.windows[first].start_s:.10g} s"
            yield Omitted("rows", len(moving), total, "not_at_rest: the body moves in them", where)

    def _find_gaps_s(self, rows: NDArray[np.bool_]) -> Array:
        """Return the longest gap (N,), s, between the samples of each row.

        The result is 0 if no gap is longer than `BLOCK_S`, for rows in a rest, and for rows that are not among `rows`.
        """
        gaps_s = np.zeros(len(rows))
        for row in np.flatnonzero((self.rest < 0) & rows).tolist():
            longest_s = float(np.diff(self._list_edges_s(row)).max())
            gaps_s[row] = longest_s if longest_s > BLOCK_S else 0.0
        return gaps_s

    def _list_edges_s(self, row: int) -> Array:
        """Return the start of a row, the times of its samples, and its end."""
        window = self.rows.windows[row]
        return np.array([window.start_s, *self.time_s[self._inside(row)], window.end_s])

    def _inside(self, row: int) -> NDArray[np.intp]:
        return np.arange(*inside(self.time_s, self.rows.windows[row]).indices(len(self.time_s)))

    def _find_moved(self, row: int) -> NDArray[np.intp]:
        """Return the samples of a dwell in which the body moves.

        Readings within `BLOCK_S` of an end of the dwell or of a gap are left out, because the ends of a rest are
        uncertain by as much.
        """
        window, samples = self.rows.windows[row], self._inside(row)
        gaps = np.flatnonzero(np.diff(self.time_s[samples]) > BLOCK_S)
        ends_s = [window.start_s, window.end_s, *self.time_s[samples[gaps]], *self.time_s[samples[gaps + 1]]]
        left_out = np.setdiff1d(samples, self.cuts[row])
        distances_s = np.abs(self.time_s[left_out][:, None] - np.array(ends_s))
        return np.asarray(left_out[distances_s.min(axis=1) >= BLOCK_S], dtype=np.intp)
