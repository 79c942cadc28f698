"""What `result.json` says of biases by repeat."""

from rig.data.result_types import Entry, ErrorEntry, Freedom3, Vector3


class BiasEntry(Entry):
    """A bias and its standard deviation."""

    bias: Vector3
    std: Vector3


class MoveEntry(Entry):
    """A move of the bias before `repeat`, counted from 1, by `change`, known to `std`; most along `axis`."""

    repeat: int
    axis: str
    change: Vector3
    std: Vector3


class RepeatEntry(Entry):
    """One repeat of all attitudes: its bias with scale, axes and reference `held`, and with everything found `anew`.

    `time_s` is that of its middle since the first's.
    """

    time_s: float
    temperature_c: float | None
    held: BiasEntry
    anew: BiasEntry | ErrorEntry


class SlopeEntry(Entry):
    """Slope of the bias over temperature, per °C, in the range that was seen; it holds nowhere else."""

    slope: Vector3
    std: Vector3
    range_c: tuple[float, float]
    correlation_with_time: float
    freedom: Freedom3 | None = None


class DriftEntry(Entry):
    """One quantity's bias by repeat, in its `unit`.

    `common_std` is what all biases share beside their own; `excess` how many times more the readings scatter from
    repeat to repeat than they do within a dwell. `freedom` are the degrees of freedom of the `held` biases' standard
    deviations, null where they have no end; results of before do not count them. A steady bias has `moves` in a share
    of `false_alarm` of all runs. Results of before do not say whose bias it is: `part`, `serial_number`, `full_scale`
    in the same unit. The repeats' temperatures are `temperature_stated` where the sensor has no thermometer.
    """

    unit: str
    repeats: tuple[RepeatEntry, ...]
    common_std: Vector3
    excess: Vector3
    moves: tuple[MoveEntry, ...]
    false_alarm: float
    largest_change: Vector3
    over_temperature: SlopeEntry | ErrorEntry
    earth_rate_known: bool
    freedom: Freedom3 | None = None
    part: str | None = None
    serial_number: str | None = None
    full_scale: float | None = None
    temperature_stated: bool = False

    @property
    def range_c(self) -> tuple[float, float] | None:
        """Coldest and warmest repeat, °C; None if no temperature is known."""
        known = [repeat.temperature_c for repeat in self.repeats if repeat.temperature_c is not None]
        return (min(known), max(known)) if known else None
