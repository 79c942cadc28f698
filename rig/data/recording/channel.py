"""What a source delivers of one quantity: the column of its samples, and how the numbers there become readings. Pure.

A sample is its three stamps and a column for each channel, so the channels say what type the samples are of.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Annotated, Any, Final, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from firmware_host.samples import STAMPS
from rig.data.checked import Finite, Positive
from rig.data.installed_kinds import measured
from rig.data.quantity import TEMPERATURE, Quantity, Scalar
from rig.estimation.arrays import Array
from rig.estimation.statistics.rounding import Steps, cut_steps, found_steps

ColumnName = Annotated[str, Field(pattern="^[a-z][a-z0-9_]{0,39}$")]
MAX_CHANNELS: Final = 16


@dataclass(frozen=True, slots=True)
class Channel:
    """One quantity of a sensor: reading = number in the `column` × `unit_per_count` + `offset`, in the quantity's unit.

    `quantity` is a name in `measured()`, `type` NumPy's of a number. Numbers of `full_scale_counts` and more are
    saturated, None where nothing tells; `range` is the nominal end of scale in the unit, None where it is not known.
    `step` is how far neighbouring readings are apart at most, in the unit, where that is more than a count: so about
    zero of numbers that were cut toward it, and half as far elsewhere.
    Where the value is `stated` nobody read it: all numbers are the same; a count is by how much it may have changed.
    """

    quantity: str
    column: ColumnName
    type: Literal["<i2", "<i4", "<f8"]
    unit_per_count: Positive
    offset: Finite = 0.0
    full_scale_counts: Annotated[int, Field(gt=0)] | None = None
    range: Positive | None = None
    step: Positive | None = None
    stated: Literal[True] | None = None

    @property
    def measures(self) -> Quantity | Scalar:
        """The row of the quantity."""
        return measured()[self.quantity]

    @property
    def resolution(self) -> float:
        """The step between neighbouring readings in the quantity's unit; 0 of numbers that are no counts."""
        return self.step or (0.0 if self.type == "<f8" else self.unit_per_count)

    def steps(self, readings: Array, *, trusts_counts: bool = False) -> Steps:
        """The steps of a quantity with axes, of all its readings (n, 3): as stated, or larger ones that they show.

        `trusts_counts`: what is recorded are the converter's own counts, whatever the readings show.
        """
        if self.step is not None:
            return cut_steps(readings, self.step / 2)
        return Steps(self.resolution if trusts_counts else np.maximum(self.resolution, found_steps(readings)))

    def counts(self, samples: NDArray[Any]) -> NDArray[Any]:
        """The numbers (n,) or (n, 3) in samples (n,), as they were recorded."""
        counts: NDArray[Any] = samples[self.column]
        return counts

    def in_unit(self, counts: NDArray[Any] | float) -> Array:
        """Numbers of the column, of any shape, in the quantity's unit."""
        found: Array = np.asarray(counts * self.unit_per_count + self.offset, dtype=np.float64)
        return found

    def values(self, samples: NDArray[Any]) -> Array:
        """The readings (n,) or (n, 3) in samples (n,), in the quantity's unit."""
        return self.in_unit(self.counts(samples))

    def fill(self, samples: NDArray[Any], readings: Array) -> None:
        """Write readings (n,) or (n, 3), in the quantity's unit, into samples (n,): the nearest number that fits."""
        counts = (readings - self.offset) / self.unit_per_count
        if self.type != "<f8":
            most = np.iinfo(self.type).max
            counts = np.clip(np.rint(counts), -most, most)
        samples[self.column] = counts

    def mean(self, samples: NDArray[Any]) -> tuple[float, ...]:
        """The mean reading of samples (n,): one number, or one for each axis."""
        return tuple(self.in_unit(self.counts(samples).mean(axis=0)).reshape(-1).tolist())

    def saturated(self, samples: NDArray[Any]) -> NDArray[np.bool_]:
        """Which of samples (n,) hold a number at the end of the scale, (n,)."""
        if self.full_scale_counts is None:
            return np.zeros(len(samples), dtype=np.bool_)
        counts = self.counts(samples)
        wide = counts.astype(np.int64) if counts.dtype.kind == "i" else counts  # the least i4 has no positive
        beyond = np.abs(wide) >= self.full_scale_counts
        found: NDArray[np.bool_] = beyond.reshape(len(samples), -1).any(axis=1)
        return found


def of_three_axes(
    quantity: Quantity, unit_per_count: float, full_scale_counts: int, end_of_scale: float | None
) -> Channel:
    """The channel of a sensor of three axes as the board and the KVH 1775 deliver it."""
    column = f"{quantity.prefix}counts"
    return Channel(quantity.name, column, "<i4", unit_per_count, 0.0, full_scale_counts, end_of_scale)


def of_thermometer(c_per_count: float, offset_c: float) -> Channel:
    """The channel of the thermometer in such a sensor."""
    return Channel(TEMPERATURE.name, "temperature_counts", "<i2", c_per_count, offset_c)


def of_stated_temperature(stated_c: float, within_k: float) -> Channel:
    """The channel of a sensor without a thermometer: how warm it is, and by how much that may change."""
    return replace(of_thermometer(within_k, stated_c), stated=True)


def sample_dtype(channels: Sequence[Channel]) -> np.dtype[Any]:
    """The type of samples of these channels. Raises ValueError where two of them, or a stamp, share a column."""
    return np.dtype([*STAMPS, *((each.column, each.type, each.measures.shape) for each in channels)])


def stamped(dtype: np.dtype[Any], numbers: NDArray[Any], times_us: NDArray[Any], host_time_s: float) -> NDArray[Any]:
    """Samples (n,) of these numbers (n,) and times (n,) on their own clock, which came at once; zero in all else."""
    samples = np.zeros(len(numbers), dtype)
    samples["sequence"], samples["board_time_us"], samples["host_time_s"] = numbers, times_us, host_time_s
    return samples
