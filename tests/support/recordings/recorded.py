"""Sensors of recordings with one property changed."""

from dataclasses import replace
from typing import Any

from rig.data.quantity import RATE, Quantity, Scalar
from rig.data.recording.recorded_sensor import RecordedSensor


def change_channel(sensor: RecordedSensor, quantity: Quantity | Scalar = RATE, **changes: Any) -> RecordedSensor:
    """Return the sensor with changed properties of one of its channels."""
    changed = (
        replace(channel, **changes) if channel.quantity == quantity.name else channel for channel in sensor.channels
    )
    return replace(sensor, channels=tuple(changed))
