"""The description of one sensor in a recording: its part, its mounting, and the contents of its samples."""

import json
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Annotated, Any, Literal

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from rig.config.sensors.sensor_sections import AccelerationSection, ConfiguredSensor, mounting_matrix
from rig.data.installed_kinds import channel_contents
from rig.data.quantity import RATE, TEMPERATURE, Quantity, Scalar
from rig.data.recording.channel import MAX_CHANNELS, Channel, sample_dtype
from rig.data.validation import Finite, Positive, validate
from rig.errors.quoting import quote
from rig.estimation.earth import STANDARD_GRAVITY_M_S2

MOUNTING_TOLERANCE = 1e-6
# Change of a sensor's unknown temperature in a run, K: a flight controller in its case warms up by as much when it gets
# power. Assumed.
UNKNOWN_CHANGE_K = 20.0

Axis = Annotated[tuple[Finite, ...], Field(min_length=3, max_length=3)]
Mounting = Annotated[tuple[Axis, ...], Field(min_length=3, max_length=3)]
ALIGNED_MOUNTING: Mounting = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))


@dataclass(frozen=True, slots=True)
class RecordedSensor:
    """A sensor and its `channels`, in the order of their columns in its samples.

    - `mounting` (3 rows of 3): nominal rotation from flange to sensor frame; the identity for a sensor without axes.
    - `mode`: "calibrated" if the rates were corrected before they were recorded.
    - `clock`: the sensor whose clock stamps the samples, itself or its device; None for the board.
    - `stamp_std_s`: standard uncertainty of a time stamp, None if negligible.
    """

    part: str
    serial_number: str
    rate_hz: Positive
    channels: Annotated[tuple[Channel, ...], Field(min_length=1, max_length=MAX_CHANNELS)]
    mounting: Mounting = ALIGNED_MOUNTING
    mode: Literal["raw", "calibrated"] = "raw"
    clock: str | None = None
    stamp_std_s: Positive | None = None

    @property
    def on_board(self) -> bool:
        """Whether the board reads the sensor and stamps its samples."""
        return self.clock is None

    @property
    def has_axes(self) -> bool:
        """Whether a quantity of the sensor has axes and can be calibrated, unlike air pressure."""
        return any(channel.measures.shape for channel in self.channels)

    @property
    def temperature_stated(self) -> bool:
        """Whether its temperature was stated, because it has no thermometer."""
        return any(channel.quantity == TEMPERATURE.name and channel.stated is not None for channel in self.channels)

    @property
    def unseen_change_k(self) -> float:
        """The possible unrecorded change of temperature, K: the thermometer's step, or a stated or assumed change."""
        return self.channel(TEMPERATURE).resolution if self.measures(TEMPERATURE) else UNKNOWN_CHANGE_K

    @property
    def temperature_words(self) -> str:
        """The source of the sensor's temperature, in words for a budget; empty if it has a thermometer."""
        if not self.measures(TEMPERATURE):
            return f"no temperature was provided or stated, a change of {UNKNOWN_CHANGE_K:g} K is assumed"
        return f"temperature stated within {self.unseen_change_k:g} K" if self.temperature_stated else ""

    @property
    def sample_dtype(self) -> np.dtype[Any]:
        """The type of its samples."""
        return sample_dtype(self.channels)

    @property
    def range_rad_s(self) -> float:
        """The nominal end of scale of its rates, which every gyroscope states, rad/s."""
        range_rad_s = self.channel(RATE).range
        assert range_rad_s is not None, "a gyroscope that does not state it is not read"
        return range_rad_s

    def measures(self, quantity: Quantity | Scalar) -> bool:
        """Return whether the sensor's samples hold the quantity."""
        return any(channel.quantity == quantity.name for channel in self.channels)

    def channel(self, quantity: Quantity | Scalar) -> Channel:
        """Return the channel of a quantity. Raise KeyError if the sensor does not measure it."""
        for channel in self.channels:
            if channel.quantity == quantity.name:
                return channel
        raise KeyError(quantity.name)

    def means(self, samples: NDArray[Any]) -> dict[str, tuple[float, ...]]:
        """Return the mean reading of each channel in samples (n,), by the name of the quantity."""
        return {channel.quantity: channel.mean(samples) for channel in self.channels}

    def attributes(self) -> dict[str, Any]:
        """Return the attributes as in a run file: the channels as a list in JSON, without keys that are None."""
        document = {name: value for name, value in asdict(self).items() if value is not None}
        channels = [
            {name: value for name, value in channel.items() if value is not None} for channel in document["channels"]
        ]
        return {**document, "channels": json.dumps(channels)}


def build_sensor(
    section: ConfiguredSensor,
    *channels: Channel,
    part: str | None = None,
    rate_hz: float | None = None,
    clock: str | None = None,
) -> RecordedSensor:
    """Return the recorded sensor of a section, with these channels; part and rate are by default the section's."""
    mounting = tuple(tuple(row) for row in mounting_matrix(section.mounting).tolist())
    rate_hz = section.rate_hz if rate_hz is None else rate_hz
    return RecordedSensor(part or section.part, section.serial_number, rate_hz, channels, mounting, clock=clock)


def range_m_s2(section: AccelerationSection) -> float:
    """Return the full scale of an accelerometer, m/s²."""
    return section.range_g * STANDARD_GRAVITY_M_S2


def sensor_of(document: Mapping[str, Any]) -> RecordedSensor:
    """Return the sensor of a description in plain values.

    Raise ValueError naming the error: a wrong value, an unknown or duplicate quantity, columns with the same name, a
    mounting that is not a rotation, a gyroscope without range.
    """
    sensor = validate(RecordedSensor, document, "sensor")
    quantities = [channel.quantity for channel in sensor.channels]
    names = ", ".join(channel_contents())
    for quantity in quantities:
        if quantity not in channel_contents() or quantities.count(quantity) > 1:
            raise ValueError(f"the {sensor.part} measures {quote(quantity)}, which is not one of {names}")
    _ = sensor.sample_dtype
    if sensor.measures(RATE) and sensor.channel(RATE).range is None:
        raise ValueError(f"the gyroscope {sensor.part} states no range")
    check_rotation(sensor.mounting, f"the mounting of {sensor.part}")
    return sensor


def check_rotation(mounting: Mounting, what: str) -> None:
    """Raise ValueError if the rows of a mounting are not of length one and at right angles."""
    rows = np.array(mounting)
    # No element of a rotation exceeds one; the squares of much larger ones would overflow.
    small = np.abs(rows).max() < 2
    if not (small and np.allclose(rows @ rows.T, np.eye(3), atol=MOUNTING_TOLERANCE)):
        raise ValueError(f"{what} is not a rotation: {quote(mounting)}")
