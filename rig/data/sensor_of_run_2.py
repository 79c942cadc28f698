"""A sensor as schemas "rig.run/1" and "rig.run/2" describe it: attributes of fixed names, no word of columns."""

from collections.abc import Mapping
from dataclasses import asdict
from typing import Any

from rig.config.sensor_catalogue import has_own_port
from rig.data.channel import Channel, of_thermometer, of_three_axes
from rig.data.quantity import ACCELERATION, FIELD, RATE, Quantity


def described_in_channels(name: str, attributes: Mapping[str, Any]) -> dict[str, Any]:
    """The attributes of the sensor `name` as a description in channels; no value is judged.

    Raises ValueError where one is missing.
    """
    try:
        if _per_count(FIELD) in attributes:
            clock, channels = attributes.get("within"), [_of_axes(FIELD, attributes)]
        else:
            clock = name if has_own_port(attributes["part"]) else None
            thermometer = of_thermometer(attributes["temperature_c_per_count"], attributes["temperature_offset_c"])
            channels = [_of_axes(RATE, attributes), thermometer]
            if _per_count(ACCELERATION) in attributes:
                channels.append(_of_axes(ACCELERATION, attributes))
        mounting = {"mounting": attributes["mounting"]}
    except KeyError as missing:
        raise ValueError(f"the description of {name} has no {missing.args[0]}") from None
    return {**attributes, **mounting, "clock": clock, "channels": [asdict(each) for each in channels]}


def _of_axes(quantity: Quantity, attributes: Mapping[str, Any]) -> Channel:
    full_scale, end_of_scale = attributes["full_scale_counts"], attributes.get(quantity.named("range"))
    return of_three_axes(quantity, attributes[_per_count(quantity)], full_scale, end_of_scale)


def _per_count(quantity: Quantity) -> str:
    return f"{quantity.named('sensitivity')}_per_count"
