"""What a certificate's uncertainties leave out, quantity by quantity: nobody should take it for included."""

from rig.data.accelerometer_entries import AccelerometerEntry
from rig.data.magnetometer_entries import MagnetometerEntry
from rig.data.result_file import SensorEntry

NONLINEARITY, TEMPERATURE, POWER, MOUNTING = "nonlinearity", "temperature", "switching", "mounting"
# What each is called in words. What a budget has of it, it has of the run, and not of other times and temperatures.
ALWAYS = {
    TEMPERATURE: "other temperatures",
    POWER: "switching off and on",
    MOUNTING: "mounting anew and its stress",
    "vibration": "vibration that the item rectifies",
    "ageing": "ageing and transport",
}


def left_out_of_rates(sensor: SensorEntry) -> str:
    """Of a gyroscope's U."""
    return _left_out({} if sensor.nonlinearity is not None else {NONLINEARITY: "nonlinearity at other speeds"})


def left_out_of_accelerations(found: AccelerometerEntry) -> str:
    """Of an accelerometer's U."""
    bent = "nonlinearity" if found.second_order_s2_m is None else "nonlinearity beyond the second order"
    return _left_out({NONLINEARITY: bent})


def left_out_of_fields(found: MagnetometerEntry) -> str:
    """Of a magnetometer's U; what it reads of the arm is told beside its bias."""
    return _left_out({NONLINEARITY: "nonlinearity", "magnetised": "iron magnetised since"})


def _left_out(more: dict[str, str]) -> str:
    return ", ".join({**more, **ALWAYS}.values())
