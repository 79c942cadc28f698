"""What `result.json` says of biases by repeat."""

from rig.data.entries.result_types import Entry, ErrorEntry, Freedom3, Vector3


class BiasEntry(Entry):
    """A bias and its standard deviation."""

    bias: Vector3
    std: Vector3


class BiasStepEntry(Entry):
    """A move of the bias before `repeat`, counted from 1, by `change`, known to `std`; most along `axis`."""

    repeat: int
    axis: str
    change: Vector3
    std: Vector3


class RepeatEntry(Entry):
    """One repeat of all attitudes: its bias with scale, axes and reference fixed, and with all of them estimated.

    `time_s` is that of its middle since the first's.
    """

    time_s: float
    temperature_c: float | None
    scale_fixed: BiasEntry
    scale_free: BiasEntry | ErrorEntry


class SlopeEntry(Entry):
    """Slope of the bias over temperature, per °C, in the range that was seen; it holds nowhere else."""

    slope: Vector3
    std: Vector3
    range_c: tuple[float, float]
    correlation_with_time: float
    degrees_of_freedom: Freedom3


class DriftEntry(Entry):
    """One quantity's bias by repeat, in its `unit`.

    - `common_std` is what all biases share beside their own; `scatter_ratio` how many times more the readings scatter
      from repeat to repeat than they do within a dwell.
    - `degrees_of_freedom` are those of the standard deviations of `scale_fixed`, null where they have no end.
    - A steady bias has `steps` with the probability `false_alarm_probability`.
    - `temperature_slope` is the slope of the bias over temperature. Temperatures are `temperature_stated` where the
      sensor has no thermometer.
    - `part`, `serial_number` and `full_scale`, in the same unit, say whose bias it is.
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
        known = [repeat.temperature_c for repeat in self.repeats if repeat.temperature_c is not None]
        return (min(known), max(known)) if known else None
