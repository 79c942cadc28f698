"""A calibration's biases at another temperature, by the slopes that a run of `bias_drift` has found. Pure.

A slope holds in the range it was seen in, and nowhere else: neither the calibration's temperature nor the one that is
asked for may lie outside.
"""

from typing import Literal, TypeVar

import numpy as np

from rig.data.drift_entries import SlopeEntry
from rig.data.result_file import ResultDocument
from rig.data.result_types import Entry, Vector3
from rig.errors import Refused
from rig.estimation.arrays import Array

EntryT = TypeVar("EntryT", bound=Entry)


def at_temperature(result: ResultDocument, drift: ResultDocument, temperature_c: float) -> ResultDocument:
    """`result` with the biases of the sensors it calibrated as they are at that temperature, by the slopes in `drift`.

    Raises Refused `another_sensor`, `temperature_slope_unknown`, `temperature_outside`.
    """
    _check_same(result, drift)
    sensors, accelerometers = dict(result.sensors), dict(result.accelerometers)
    for name, sensor in result.sensors.items():
        if sensor.role == "calibrate":
            change = _change(drift, name, "rate", sensor.temperature_c, temperature_c)
            moved = _vector(np.array(sensor.bias_rad_s) - change)  # b is added to a reading, which the slope is of
            sensors[name] = _with(sensor, bias_rad_s=moved, temperature_c=temperature_c)
    for name, each in result.accelerometers.items():
        change = _change(drift, name, "acceleration", each.temperature_c, temperature_c)
        moved = _vector(np.array(each.bias_m_s2) + change)
        accelerometers[name] = _with(each, bias_m_s2=moved, temperature_c=temperature_c)
    polynomials: dict[str, object] = {}  # those that there are stand about the other temperature
    return _with(result, sensors=sensors, accelerometers=accelerometers, over_temperature=polynomials)


def _with(entry: EntryT, **changed: object) -> EntryT:
    """An entry with other values, which hold as those of a file do."""
    return type(entry).model_validate(entry.model_dump(by_alias=True, exclude_unset=True) | changed)


def _change(
    drift: ResultDocument, name: str, quantity: Literal["rate", "acceleration"], from_c: float | None, to_c: float
) -> Array:
    """(3,) change of the reading's bias."""
    if from_c is None:
        raise Refused(
            "temperature_slope_unknown",
            f"the result does not say how warm {name} was",
            "Leave out --temperature-c; calibrate it where its thermometer is read",
        )
    found = drift.bias_drift.get(name, {}).get(quantity)
    slope = None if found is None else found.over_temperature
    if not isinstance(slope, SlopeEntry):
        why = "it did not watch that bias" if slope is None else slope.error
        raise Refused(
            "temperature_slope_unknown",
            f"the run of bias_drift did not find how {name}'s {quantity} changes with temperature: {why}",
            "Give a run of bias_drift in which the sensor warmed and cooled, or export without --at-temperature",
        )
    low, high = slope.range_c
    for what, temperature_c in (("the calibration was made at", from_c), ("its bias is wanted at", to_c)):
        if not low <= temperature_c <= high:
            raise Refused(
                "temperature_outside",
                f"{what} {temperature_c:.1f} °C, and the slope of {name}'s {quantity} was measured "
                f"from {low:.1f} to {high:.1f} °C only",
                "Calibrate at the temperature at which it is used, or measure the bias over a wider range of "
                "temperature",
            )
    return np.array(slope.slope) * (to_c - from_c)


def _check_same(result: ResultDocument, drift: ResultDocument) -> None:
    """Raises Refused `another_sensor`."""
    watched = drift.provenance.sensor_serial_numbers
    for name, serial_number in result.provenance.sensor_serial_numbers.items():
        if name in watched and watched[name] != serial_number:
            raise Refused(
                "another_sensor",
                f"{name} is {serial_number}, and the run of bias_drift is of {watched[name]}",
                "Give a run of bias_drift of the same sensor",
            )


def _vector(values: Array) -> Vector3:
    x, y, z = values.tolist()
    return x, y, z
