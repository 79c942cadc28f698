"""What a reader of a recording must know about one sensor: what it is, how it sits, and what its samples hold."""

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Annotated, Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from rig.config.sensors.sensor_sections import AccelerationSection, ConfiguredSensor, mounting_matrix
from rig.data.checked import Finite, Positive, checked
from rig.data.installed_kinds import measured
from rig.data.quantity import RATE, TEMPERATURE, Quantity, Scalar
from rig.data.recording.channel import MAX_CHANNELS, Channel, sample_dtype
from rig.errors.quoting import quote
from rig.estimation.earth import STANDARD_GRAVITY_M_S2

MOUNTING_TOLERANCE = 1e-6
# K by which a sensor's temperature may change in a run if nothing tells it: a flight controller in its case warms by so
# much after it gets power. Assumed.
UNKNOWN_CHANGE_K = 20.0

Axis = Annotated[tuple[Finite, ...], Field(min_length=3, max_length=3)]
Mounting = Annotated[tuple[Axis, ...], Field(min_length=3, max_length=3)]
AS_THE_FLANGE: Mounting = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


@dataclass(frozen=True, slots=True)
class RecordedSensor:
    """A sensor and its `channels`, whose columns stand in its samples in their order.

    `mounting` (3 rows of 3) is the nominal rotation from the flange frame to the sensor's; what has no axes leaves it.
    `mode` is "calibrated" when the rates were corrected before they were recorded. `clock` names the sensor whose clock
    stamps the samples: itself, or the one it is in; None where the board's does. `stamp_std_s` is the standard
    uncertainty of a time stamp, None where it is nothing beside the interval between samples.
    """

    part: str
    serial_number: str
    rate_hz: Positive
    channels: Annotated[tuple[Channel, ...], Field(min_length=1, max_length=MAX_CHANNELS)]
    mounting: Mounting = AS_THE_FLANGE
    mode: Literal["raw", "calibrated"] = "raw"
    clock: str | None = None
    stamp_std_s: Positive | None = None

    @property
    def on_board(self) -> bool:
        """Whether the board read it, and stamped its samples with the board's clock."""
        return self.clock is None

    @property
    def has_axes(self) -> bool:
        """Whether it can be calibrated: of the pressure of the air, nothing is."""
        return any(each.measures.shape for each in self.channels)

    @property
    def temperature_stated(self) -> bool:
        """Whether somebody stated how warm it was: it has no thermometer."""
        return any(each.quantity == TEMPERATURE.name and each.stated is not None for each in self.channels)

    @property
    def unseen_change_k(self) -> float:
        """Temperature, K, by which it may change while the recorded one does not."""
        return self.channel(TEMPERATURE).resolution if self.measures(TEMPERATURE) else UNKNOWN_CHANGE_K

    @property
    def temperature_words(self) -> str:
        """What a budget says of how its temperature is known; nothing where a thermometer tells it."""
        if not self.measures(TEMPERATURE):
            return f"no temperature was provided or stated, a change of {UNKNOWN_CHANGE_K:g} K is assumed"
        return f"temperature stated within {self.unseen_change_k:g} K" if self.temperature_stated else ""

    @property
    def sample_dtype(self) -> np.dtype[Any]:
        """The type of its samples."""
        return sample_dtype(self.channels)

    @property
    def range_rad_s(self) -> float:
        """The nominal end of scale of its rates, which every gyroscope states."""
        known = self.channel(RATE).range
        assert known is not None, "a gyroscope that does not state it is not read"
        return known

    def measures(self, quantity: Quantity | Scalar) -> bool:
        """Whether its samples hold that quantity."""
        return any(each.quantity == quantity.name for each in self.channels)

    def channel(self, quantity: Quantity | Scalar) -> Channel:
        """The channel of a quantity it measures. Raises KeyError of another."""
        for each in self.channels:
            if each.quantity == quantity.name:
                return each
        raise KeyError(quantity.name)

    def means(self, samples: NDArray[Any]) -> dict[str, tuple[float, ...]]:
        """The mean reading of each channel in samples (n,), by the name of the quantity."""
        return {each.quantity: each.mean(samples) for each in self.channels}

    def attributes(self) -> dict[str, Any]:
        """The attributes as they stand in a run file: the channels as a list in JSON, without what there is none of."""
        document = {name: value for name, value in asdict(self).items() if value is not None}
        channels = [{name: value for name, value in each.items() if value is not None} for each in document["channels"]]
        return {**document, "channels": json.dumps(channels)}


def recorded_as(
    section: ConfiguredSensor,
    *channels: Channel,
    part: str | None = None,
    rate_hz: float | None = None,
    clock: str | None = None,
) -> RecordedSensor:
    """The sensor of a section, whose samples hold these channels; `part` and rate are the section's where left out."""
    mounting = tuple(tuple(row) for row in mounting_matrix(section.mounting).tolist())
    rate_hz = section.rate_hz if rate_hz is None else rate_hz
    return RecordedSensor(part or section.part, section.serial_number, rate_hz, channels, mounting, clock=clock)


def range_m_s2(section: AccelerationSection) -> float:
    """The full scale of an accelerometer."""
    return section.range_g * STANDARD_GRAVITY_M_S2


def sensor_of(document: Mapping[str, Any]) -> RecordedSensor:
    """The sensor of a description in plain values.

    Raises ValueError naming what is wrong: a value, a quantity nobody knows or that comes twice, columns of one name, a
    mounting that is no rotation, a gyroscope without range.
    """
    sensor = checked(RecordedSensor, document, "sensor")
    quantities = [each.quantity for each in sensor.channels]
    known = ", ".join(measured())
    for quantity in quantities:
        if quantity not in measured() or quantities.count(quantity) > 1:
            raise ValueError(f"the {sensor.part} measures {quote(quantity)}, which is not one of {known}")
    _ = sensor.sample_dtype
    if sensor.measures(RATE) and sensor.channel(RATE).range is None:
        raise ValueError(f"the gyroscope {sensor.part} states no range")
    check_rotation(sensor.mounting, f"the mounting of {sensor.part}")
    return sensor


def check_rotation(mounting: Mounting, what: str) -> None:
    """Raise ValueError where the rows of a mounting are not of length one and at right angles."""
    rows = np.array(mounting)
    # No element of a rotation exceeds one; the squares of much larger ones would overflow.
    small = np.abs(rows).max() < 2
    if not (small and np.allclose(rows @ rows.T, np.eye(3), atol=MOUNTING_TOLERANCE)):
        raise ValueError(f"{what} is no rotation: {quote(mounting)}")
