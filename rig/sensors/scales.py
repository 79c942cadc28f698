"""Channels of readings that a source sends as decimal numbers. They are stored as integers of a much smaller unit."""

from rig.config.sensors.stated_temperature import StatedTemperatureSection
from rig.data.quantity import Quantity
from rig.data.recording.channel import Channel, make_stated_temperature_channel, triad_channel

FULL_SCALE_COUNTS = 1 << 30  # half of the 32-bit range, and finer than single precision near the end
DEGREES_PER_COUNT = 0.01
FIELD_FULL_SCALE_T = 1e-3  # range of samples of a magnetometer without a stated range


def fine_axes(quantity: Quantity, end_of_scale: float) -> Channel:
    """Return the channel of three axes with a full scale of `FULL_SCALE_COUNTS`."""
    return triad_channel(quantity, end_of_scale / FULL_SCALE_COUNTS, FULL_SCALE_COUNTS, end_of_scale)


def thermometer_channels(provided: Channel | None, stated: StatedTemperatureSection | None) -> tuple[Channel, ...]:
    """Return a tuple of one channel, of the `provided` or else the `stated` temperature; empty if there is neither."""
    if provided is not None:
        return (provided,)
    return () if stated is None else (make_stated_temperature_channel(stated.stated_c, stated.stated_within_k),)
