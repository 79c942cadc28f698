"""Format C's magnetic field: of every four messages, three contain one axis each, in the order x, y, z. Pure."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from firmware_host.samples import FIELD_SAMPLE_DTYPE
from rig.data.recording.channel import stamp_samples

READING_MESSAGES = 4  # temperature, x, y, z in turn, by the sequence number, whose modulus 128 is a multiple
GAUSS_T = 1e-4


class MagneticFieldReader:
    """The assembler of one stream's field samples, FIELD_SAMPLE_DTYPE; readings without all three axes are left out.

    `t_per_count` is the size of a count in tesla, `full_scale_counts` the largest count. A sample has the time of the
    message with its y axis; samples are numbered from the first complete reading.
    """

    def __init__(self, t_per_count: float, full_scale_counts: int) -> None:
        self._gauss_per_count, self._limit = t_per_count / GAUSS_T, full_scale_counts
        self._rows = np.zeros(0, FIELD_SAMPLE_DTYPE)  # rows of an incomplete reading, one for each axis
        self._axes = np.zeros(0, np.int64)  # index of the axis of each row
        self._first_number: int | None = None

    def feed(
        self, messages: NDArray[Any], numbers: NDArray[Any], times_us: NDArray[Any], host_time_s: float
    ) -> NDArray[Any]:
        """Add messages (n,) with their numbers (n,) and times (n,); return the readings that are now complete."""
        slot = messages["sequence"].astype(np.int64) % READING_MESSAGES
        gauss = messages["fourth"].astype(np.float64)
        is_axis = (slot > 0) & np.isfinite(gauss)
        # Numbers do not wrap as the sequence does: all four messages of a reading give the same.
        readings = (numbers[is_axis] - slot[is_axis]) // READING_MESSAGES + 1
        rows = stamp_samples(FIELD_SAMPLE_DTYPE, readings, times_us[is_axis], host_time_s)
        counts = np.rint(gauss[is_axis] / self._gauss_per_count)
        rows["field_counts"] = np.clip(counts, -self._limit, self._limit)[:, None]
        rows, axes = (np.concatenate([self._rows, rows]), np.concatenate([self._axes, slot[is_axis] - 1]))
        latest = rows["sequence"] == (rows["sequence"][-1] if len(rows) else 0)
        incomplete = latest & ~np.any(axes[latest] == 2)  # z comes last
        self._rows, self._axes = rows[incomplete], axes[incomplete]
        return self._assemble(rows[~incomplete], axes[~incomplete])

    def _assemble(self, rows: NDArray[Any], axes: NDArray[np.int64]) -> NDArray[Any]:
        """Return one sample per reading, with the time of its y row.

        A reading is complete if its x, y and z rows follow one another and carry the same sequence number.
        """
        starts = np.flatnonzero(axes == 0)
        starts = starts[starts + 2 < len(rows)]
        same = (rows["sequence"][starts] == rows["sequence"][starts + 2]) & (axes[starts + 2] == 2)
        starts = starts[same & (axes[starts + 1] == 1)]
        samples: NDArray[Any] = rows[starts + 1].copy()
        samples["field_counts"] = np.stack([rows["field_counts"][starts + axis, 0] for axis in range(3)], axis=1)
        if self._first_number is None and len(samples):
            self._first_number = int(samples["sequence"][0])
        samples["sequence"] -= self._first_number or 0
        return samples
