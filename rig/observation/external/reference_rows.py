"""A gyroscope's readings with the rows of a reference, and the rests among the rows.

While the body lies still, rows that follow each other densely are combined in one long row for the whole rest, if both
the readings and the rows show the rest.
"""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from rig.data.quantity import RATE
from rig.estimation.arrays import Array, rotation_vectors
from rig.estimation.sensor_axes import nearest_rotation
from rig.observation.by_hand.rests import find_rests
from rig.observation.external.still_attitudes import still_windows

# Least duration and samples of a row that may be a rest; largest difference between rests.
MIN_STILL_S, MIN_STILL_SAMPLES, MAX_REST_DIFFERENCE_RAD_S = 0.5, 20, 5e-3
MARGIN_S = 0.05  # time at either end of a rest in which the body may move on the reference's clock
MAX_STILL_RATE_RAD_S = 0.02  # of the attitudes in a rest of the readings, above which the body turned


@dataclass(frozen=True, slots=True)
class Turning:
    """A gyroscope's `readings_rad_s` (n, 3) at `time_s` (n,), and the rows of a reference.

    `rows_s` (N, 2): start and end of each row; `attitudes` (N, 3, 3), body to table; `std_rad` (N,) as stated.
    `hides_losses`: True if a single lost reading leaves no gap in the readings' time stamps.
    """

    time_s: Array
    readings_rad_s: Array
    rows_s: Array
    attitudes: Array
    std_rad: Array | None = None
    hides_losses: bool = False

    def select(self, rows: NDArray[np.intp]) -> "Turning":
        """Return all readings with only some of the reference's rows, those with the indices `rows`."""
        std_rad = None if self.std_rad is None else self.std_rad[rows]
        return replace(self, rows_s=self.rows_s[rows], attitudes=self.attitudes[rows], std_rad=std_rad)


def select_covered(turning: Turning, clock_s: float = 0.0) -> Turning:
    """Return the rows within the recording, in the order of time, with `clock_s` added to their times."""
    order = np.argsort(turning.rows_s[:, 0], kind="stable")
    rows_s = turning.rows_s[order] + clock_s
    return turning.select(order[(rows_s[:, 0] >= turning.time_s[0]) & (rows_s[:, 1] <= turning.time_s[-1])])


def join_rests(turning: Turning, clock_s: float) -> tuple[Turning, NDArray[np.bool_]]:
    """Return the rows, with those of each rest joined into one, and a mask (N,) of the rows that are rests.

    `clock_s` converts the rows' times to those of the readings; the result keeps the rows' own times.
    """
    still = _find_still(turning, clock_s)
    middles_s = turning.rows_s.mean(axis=1) + clock_s
    kept = np.ones(len(middles_s), dtype=np.bool_)
    rests = []
    for rest in _find_dense_rests(turning, clock_s):
        rows = np.flatnonzero((middles_s >= rest[0]) & (middles_s <= rest[1]) & kept)
        inner = rows[(middles_s[rows] >= rest[0] + MARGIN_S) & (middles_s[rows] <= rest[1] - MARGIN_S)]
        if (
            not len(inner)
            or still[rows].any()
            or _find_rate_rad_s(turning.attitudes[inner], middles_s[inner]) > MAX_STILL_RATE_RAD_S
        ):
            continue
        kept[rows] = False
        rests.append((rest, inner))
    if not rests:
        return turning, still
    rows_s = np.array([(start + MARGIN_S - clock_s, end - MARGIN_S - clock_s) for (start, end), _ in rests])
    attitudes = np.array([nearest_rotation(turning.attitudes[inner].mean(axis=0)) for _, inner in rests])
    others = turning.select(np.flatnonzero(kept))
    std_rad = None
    if turning.std_rad is not None and others.std_rad is not None:
        of_rests = [float(np.sqrt(np.mean(turning.std_rad[inner] ** 2))) for _, inner in rests]
        std_rad = np.concatenate([others.std_rad, of_rests])
    joined = replace(
        turning,
        rows_s=np.concatenate([others.rows_s, rows_s]),
        attitudes=np.concatenate([others.attitudes, attitudes]),
        std_rad=std_rad,
    )
    order = np.argsort(joined.rows_s[:, 0], kind="stable")
    return joined.select(order), np.concatenate([still[kept], np.ones(len(rests), dtype=np.bool_)])[order]


def _find_dense_rests(turning: Turning, clock_s: float) -> list[tuple[float, float]]:
    """Return the start and end of each rest that both readings and rows show, on the readings' clock."""
    lying = still_windows(turning.rows_s + clock_s, turning.attitudes)
    rests = find_rests(turning.time_s, {RATE: turning.readings_rad_s}, lying=lying)
    return [(rest.start_s, rest.end_s) for rest in rests if rest.end_s - rest.start_s > 3 * MARGIN_S]


def _find_rate_rad_s(attitudes: Array, times_s: Array) -> float:
    """Return the size of the body's mean rate over attitudes (k, 3, 3) at times (k,).

    The rate is that between the mean attitudes of the first and the second half.
    """
    half = len(times_s) // 2
    if not half:
        return 0.0
    one, other = (nearest_rotation(part.mean(axis=0)) for part in (attitudes[:half], attitudes[-half:]))
    lasts_s = float(times_s[-half:].mean() - times_s[:half].mean())
    return float(np.linalg.norm(rotation_vectors((one.T @ other)[None])[0]) / max(lasts_s, 1e-9))


def _find_still(turning: Turning, clock_s: float) -> NDArray[np.bool_]:
    """Return a mask (N,) of rows in which the body lay still: long rows with equal means and only noise.

    `clock_s` converts the rows' times to those of the readings."""
    rows_s = turning.rows_s
    start, end = np.searchsorted(turning.time_s, rows_s.T + clock_s)
    still: NDArray[np.bool_] = (rows_s[:, 1] - rows_s[:, 0] >= MIN_STILL_S) & (end - start >= MIN_STILL_SAMPLES)
    long = np.flatnonzero(still)
    if not len(long):
        return still
    cuts = [turning.readings_rad_s[start[row] : end[row]] for row in long]
    # White noise by differences of successive readings, in the quietest row.
    noise = min(float(np.diff(cut, axis=0).std(axis=0).max()) for cut in cuts) / np.sqrt(2)
    quiet = np.array([cut.std(axis=0).max() for cut in cuts]) <= 2 * noise + MAX_REST_DIFFERENCE_RAD_S
    means = np.array([cut.mean(axis=0) for cut in cuts])
    deviation = np.abs(means - np.median(means[quiet] if quiet.any() else means, axis=0)).max(axis=1)
    still[long] = quiet & (deviation <= MAX_REST_DIFFERENCE_RAD_S + 4 * noise / np.sqrt(end[long] - start[long]))
    return still
