"""The channels of a source: for each quantity a column of its samples, and its conversion to readings. Pure.

A sample is its three stamps and a column for each channel, so the channels determine the type of the samples.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Annotated, Any, Final, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from firmware_host.samples import STAMPS
from rig.data.installed_kinds import channel_contents
from rig.data.quantity import TEMPERATURE, Quantity, Scalar
from rig.data.validation import Finite, Positive
from rig.estimation.arrays import Array
from rig.estimation.statistics.rounding import Steps, cut_steps, find_steps

ColumnName = Annotated[str, Field(pattern="^[a-z][a-z0-9_]{0,39}$")]
MAX_CHANNELS: Final = 16


@dataclass(frozen=True, slots=True)
class Channel:
    """One quantity of a sensor: reading = number in the `column` × `unit_per_count` + `offset`, in the quantity's unit.

    - quantity: a name in `channel_contents()`; type: the NumPy type of the numbers.
    - full_scale_counts: the number at which the sensor saturates; range: the nominal end of scale, in the quantity's
      unit; None if unknown.
    - step: largest distance of neighbouring readings, in the unit, if it is more than a count. Numbers truncated toward
      zero have this step at zero, and half of it elsewhere.
    - stated: whether the user stated the value. All numbers are then equal, and a count is the value's possible change.
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
        """The quantity or scalar that the channel holds."""
        return channel_contents()[self.quantity]

    @property
    def resolution(self) -> float:
        """Step between neighbouring readings in the quantity's unit; 0 for numbers that are not counts."""
        return self.step or (0.0 if self.type == "<f8" else self.unit_per_count)

    def steps(self, readings: Array, *, trusts_counts: bool = False) -> Steps:
        """Return the resolution steps of readings (n, 3): as stated, or larger if the readings show larger steps.

        `trusts_counts`: whether the numbers are the converter's counts, so readings are not searched for steps.
        """
        if self.step is not None:
            return cut_steps(readings, self.step / 2)
        steps = np.zeros(readings.shape[1:]) if trusts_counts else find_steps(readings)
        return Steps(np.maximum(self.resolution, steps))

    def counts(self, samples: NDArray[Any]) -> NDArray[Any]:
        """Return the recorded numbers (n,) or (n, 3) of the channel in samples (n,), unconverted."""
        counts: NDArray[Any] = samples[self.column]
        return counts

    def convert(self, counts: NDArray[Any] | float) -> Array:
        """Return numbers of the column, of any shape, converted to the quantity's unit."""
        readings: Array = np.asarray(counts * self.unit_per_count + self.offset, dtype=np.float64)
        return readings

    def values(self, samples: NDArray[Any]) -> Array:
        """Return the readings (n,) or (n, 3) in samples (n,), in the quantity's unit."""
        return self.convert(self.counts(samples))

    def fill(self, samples: NDArray[Any], readings: Array) -> None:
        """Write readings (n,) or (n, 3), in the quantity's unit, into samples (n,), as the nearest counts."""
        counts = (readings - self.offset) / self.unit_per_count
        if self.type != "<f8":
            most = np.iinfo(self.type).max
            counts = np.clip(np.rint(counts), -most, most)
        samples[self.column] = counts

    def mean(self, samples: NDArray[Any]) -> tuple[float, ...]:
        """Return the mean reading of samples (n,): one number, or one for each axis."""
        return tuple(self.convert(self.counts(samples).mean(axis=0)).reshape(-1).tolist())

    def is_saturated(self, samples: NDArray[Any]) -> NDArray[np.bool_]:
        """Return a mask of the samples (n,) at the end of the scale."""
        if self.full_scale_counts is None:
            return np.zeros(len(samples), dtype=np.bool_)
        counts = self.counts(samples)
        # the smallest 32-bit integer has no positive counterpart
        wide = counts.astype(np.int64) if counts.dtype.kind == "i" else counts
        beyond = np.abs(wide) >= self.full_scale_counts
        return np.asarray(beyond.reshape(len(samples), -1).any(axis=1))


def triad_channel(
    quantity: Quantity, unit_per_count: float, full_scale_counts: int, end_of_scale: float | None
) -> Channel:
    """Return the channel of three axes in counts, as delivered by the board and the KVH 1775."""
    column = f"{quantity.prefix}counts"
    return Channel(quantity.name, column, "<i4", unit_per_count, 0.0, full_scale_counts, end_of_scale)


def thermometer_channel(c_per_count: float, offset_c: float) -> Channel:
    """Return the channel of the thermometer in a sensor of three axes."""
    return Channel(TEMPERATURE.name, "temperature_counts", "<i2", c_per_count, offset_c)


def make_stated_temperature_channel(stated_c: float, within_k: float) -> Channel:
    """Return the channel of a sensor without a thermometer: its stated temperature, and its possible change."""
    return replace(thermometer_channel(within_k, stated_c), stated=True)


def sample_dtype(channels: Sequence[Channel]) -> np.dtype[Any]:
    """Return the NumPy type of samples with these channels. Raise ValueError if columns have the same name."""
    return np.dtype([*STAMPS, *((channel.column, channel.type, channel.measures.shape) for channel in channels)])


def stamp_samples(
    dtype: np.dtype[Any], numbers: NDArray[Any], times_us: NDArray[Any], host_time_s: float
) -> NDArray[Any]:
    """Return samples (n,) received together, with numbers and times (n,) on their own clock; other columns are zero."""
    samples = np.zeros(len(numbers), dtype)
    samples["sequence"], samples["board_time_us"], samples["host_time_s"] = numbers, times_us, host_time_s
    return samples
