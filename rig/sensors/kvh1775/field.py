"""Format C's magnetic field: one axis in a message, x y z in three of every four, put together to readings. Pure."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from firmware_host.samples import FIELD_SAMPLE_DTYPE
from rig.data.recording.channel import stamped

MESSAGES_EACH = 4  # temperature, x, y, z: by the sequence number, whose 128 are a multiple of it
GAUSS_T = 1e-4


class FieldReader:
    """Makes samples, FIELD_SAMPLE_DTYPE, of one stream's messages; a reading of which an axis was lost is lost.

    `t_per_count` is the size of a count, `full_scale_counts` the largest that is written. A sample has the time of its
    middle axis and counts from the first reading that came whole.
    """

    def __init__(self, t_per_count: float, full_scale_counts: int) -> None:
        self._gauss_per_count, self._limit = t_per_count / GAUSS_T, full_scale_counts
        self._held = np.zeros(0, FIELD_SAMPLE_DTYPE)  # of a reading that has begun: its axes so far, one to a row,
        self._axes = np.zeros(0, np.int64)  # … and which they are
        self._first: int | None = None

    def feed(
        self, messages: NDArray[Any], numbers: NDArray[Any], times_us: NDArray[Any], host_time_s: float
    ) -> NDArray[Any]:
        """The readings that are whole with messages (n,), of these numbers (n,) and times (n,)."""
        place = messages["sequence"].astype(np.int64) % MESSAGES_EACH
        gauss = messages["fourth"].astype(np.float64)
        some = (place > 0) & np.isfinite(gauss)
        # Numbers go on across the wrap of the sequence: all four messages of a reading give the same.
        readings = (numbers[some] - place[some]) // MESSAGES_EACH + 1
        rows = stamped(FIELD_SAMPLE_DTYPE, readings, times_us[some], host_time_s)
        counts = np.rint(gauss[some] / self._gauss_per_count)
        rows["field_counts"] = np.clip(counts, -self._limit, self._limit)[:, None]
        rows, axes = np.concatenate([self._held, rows]), np.concatenate([self._axes, place[some] - 1])
        latest = rows["sequence"] == (rows["sequence"][-1] if len(rows) else 0)
        going_on = latest & ~np.any(axes[latest] == 2)  # z is the last of them
        self._held, self._axes = rows[going_on], axes[going_on]
        return self._whole(rows[~going_on], axes[~going_on])

    def _whole(self, rows: NDArray[Any], axes: NDArray[np.int64]) -> NDArray[Any]:
        starts = np.flatnonzero(axes == 0)
        starts = starts[starts + 2 < len(rows)]
        same = (rows["sequence"][starts] == rows["sequence"][starts + 2]) & (axes[starts + 2] == 2)
        starts = starts[same & (axes[starts + 1] == 1)]
        found: NDArray[Any] = rows[starts + 1].copy()
        found["field_counts"] = np.stack([rows["field_counts"][starts + axis, 0] for axis in range(3)], axis=1)
        if self._first is None and len(found):
            self._first = int(found["sequence"][0])
        found["sequence"] -= self._first or 0
        return found
