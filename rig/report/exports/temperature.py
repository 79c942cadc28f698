"""A calibration's biases at another temperature, computed from the slopes that a run of `bias_drift` measured. Pure.

A slope is valid only in its measured range, which must contain the calibration's temperature and the requested one.
"""

from dataclasses import replace

import numpy as np

from rig.data.entries.bias_drift import SlopeEntry
from rig.data.quantity import ACCELERATION, RATE
from rig.data.result_file import ResultDocument
from rig.errors import Refused
from rig.estimation.arrays import Array
from rig.report.exports.exported_corrections import ExportedCalibrations
from rig.report.findings.linear_corrections import SensorCorrection

DRIFT_QUANTITIES = (RATE, ACCELERATION)  # a run of `bias_drift` measures their biases


def move_to_temperature(
    calibrations: ExportedCalibrations, drift: ResultDocument, temperature_c: float
) -> ExportedCalibrations:
    """Return the calibrations with their biases converted to `temperature_c` by the temperature slopes in `drift`.

    Raise Refused `another_sensor`, `temperature_slope_unknown`, `temperature_outside`.
    """
    _check_same(calibrations.result, drift)
    sensors = tuple(
        replace(sensor, offset=sensor.offset + _change(drift, sensor, temperature_c), temperature_c=temperature_c)
        if sensor.quantity in DRIFT_QUANTITIES
        else sensor
        for sensor in calibrations.sensors
    )
    # Polynomials start at the temperature of the calibration.
    return replace(calibrations, sensors=sensors, over_temperature={})


def _change(drift: ResultDocument, sensor: SensorCorrection, to_c: float) -> Array:
    """Return the bias' change (3,) from the sensor's calibration to `to_c`.

    Raise Refused `temperature_slope_unknown`, `temperature_outside`.
    """
    name, quantity, from_c = sensor.sensor, sensor.quantity.name, sensor.temperature_c
    if from_c is None:
        raise Refused(
            "temperature_slope_unknown",
            f"the result does not state the temperature of {name}",
            "Leave out --at-temperature; calibrate it where its thermometer is read",
        )
    watched = drift.bias_drift.get(name, {}).get(quantity)
    slope = None if watched is None else watched.temperature_slope
    if not isinstance(slope, SlopeEntry):
        why = "it did not measure that bias" if slope is None else slope.error
        raise Refused(
            "temperature_slope_unknown",
            f"the run of bias_drift did not measure how {name}'s {quantity} changes with temperature: {why}",
            "Give a run of bias_drift in which the sensor warmed and cooled, or export without --at-temperature",
        )
    low, high = slope.range_c
    for what, temperature_c in (("the calibration was made at", from_c), ("its bias is requested at", to_c)):
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
    """Raise Refused `another_sensor` if a sensor of the result has another serial number in the run of the drift."""
    watched = drift.provenance.sensor_serial_numbers
    for name, serial_number in result.provenance.sensor_serial_numbers.items():
        if name in watched and watched[name] != serial_number:
            raise Refused(
                "another_sensor",
                f"{name} is {serial_number}, and the run of bias_drift is of {watched[name]}",
                "Give a run of bias_drift of the same sensor",
            )
