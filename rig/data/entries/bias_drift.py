"""Biases by repeat in `result.json`."""

from rig.data.entries.result_types import Entry, ErrorEntry, Freedom3, Vector3


class BiasEntry(Entry):
    """A bias and its standard deviation."""

    bias: Vector3
    std: Vector3


class BiasStepEntry(Entry):
    """An abrupt `change` of the bias just before `repeat` (counted from 1), and the change's standard deviations.

    `axis` is the axis whose change is the most significant.
    """

    repeat: int
    axis: str
    change: Vector3
    std: Vector3


class RepeatEntry(Entry):
    """One repeat of all attitudes, and the bias in it.

    `scale_fixed` is the bias estimated with scale, axes and reference fixed, `scale_free` together with them. `time_s`
    is the time from the middle of the first repeat to the middle of this repeat.
    """

    time_s: float
    temperature_c: float | None
    scale_fixed: BiasEntry
    scale_free: BiasEntry | ErrorEntry


class SlopeEntry(Entry):
    """Slope of the bias over temperature, per °C, valid only in the recorded range."""

    slope: Vector3
    std: Vector3
    range_c: tuple[float, float]
    correlation_with_time: float
    degrees_of_freedom: Freedom3


class DriftEntry(Entry):
    """One quantity's bias by repeat.

    - unit: the unit of all values whose names state none.
    - repeats: bias and temperature of each repeat.
    - common_std: standard deviation of the error that the biases of all repeats have in common.
    - scatter_ratio: ratio of the readings' scatter from repeat to repeat to that within a dwell.
    - steps: jumps of the bias.
    - false_alarm_probability: probability that a steady bias shows steps.
    - largest_change: the largest change between any two repeats.
    - temperature_slope: the slope of the bias, or why there is none.
    - earth_rate_known: whether the Earth's rate was subtracted.
    - degrees_of_freedom: of the standard deviations in the repeats' scale_fixed; null if infinite.
    - part, serial_number, full_scale: properties of the sensor.
    - temperature_stated: whether the temperatures are stated, not measured.
    """

    unit: str
    repeats: tuple[RepeatEntry, ...]
    common_std: Vector3
    scatter_ratio: Vector3
    steps: tuple[BiasStepEntry, ...]
    false_alarm_probability: float
    largest_change: Vector3
    temperature_slope: SlopeEntry | ErrorEntry
    earth_rate_known: bool
    degrees_of_freedom: Freedom3
    part: str
    serial_number: str
    full_scale: float
    temperature_stated: bool

    @property
    def range_c(self) -> tuple[float, float] | None:
        """Coldest and warmest repeat, °C; None if no temperature is known."""
        temperatures_c = [repeat.temperature_c for repeat in self.repeats if repeat.temperature_c is not None]
        return (min(temperatures_c), max(temperatures_c)) if temperatures_c else None
