"""Scales of readings that come as fractions: a sample holds whole numbers, far finer than what was sent. Pure."""

from rig.config.sensors.stated_temperature import StatedTemperatureSection
from rig.data.quantity import Quantity
from rig.data.recording.channel import Channel, of_stated_temperature, of_three_axes

FULL_SCALE_COUNTS = 1 << 30  # half of what 32 bits hold, and finer than a float of single precision near the end
DEGREES_PER_COUNT = 0.01
FIELD_FULL_SCALE_T = 1e-3  # as far as samples of a magnetometer reach whose own range nobody states


def fine_axes(quantity: Quantity, end_of_scale: float) -> Channel:
    """The channel of three axes whose full scale is so many counts."""
    return of_three_axes(quantity, end_of_scale / FULL_SCALE_COUNTS, FULL_SCALE_COUNTS, end_of_scale)


def thermometer_channels(provided: Channel | None, stated: StatedTemperatureSection | None) -> tuple[Channel, ...]:
    """The channel of a temperature that the source provides, else of the one that is stated; none without both."""
    if provided is not None:
        return (provided,)
    return () if stated is None else (of_stated_temperature(stated.stated_c, stated.stated_within_k),)
