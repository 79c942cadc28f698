"""Sensors as recordings describe them, made anew with one thing changed."""

from dataclasses import replace
from typing import Any

from rig.data.quantity import RATE, Quantity, Scalar
from rig.data.recording.recorded_sensor import RecordedSensor


def with_channel(sensor: RecordedSensor, quantity: Quantity | Scalar = RATE, **changes: Any) -> RecordedSensor:
    """The sensor with something else said of one of its channels."""
    changed = (replace(each, **changes) if each.quantity == quantity.name else each for each in sensor.channels)
    return replace(sensor, channels=tuple(changed))
