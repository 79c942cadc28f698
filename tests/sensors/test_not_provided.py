"""What a source says in the place of a value it does not provide is no value: for each source, each of its markers."""

import numpy as np
import pytest

from rig.data.not_provided import Absent
from rig.sensors.errors import SensorError
from rig.sensors.kvh1775.kvh_source import NOT_PROVIDED as KVH
from rig.sensors.lines.fields import NOT_PROVIDED as LINES
from rig.sensors.mavlink.dialect import dialect
from rig.sensors.mavlink.imu_readings import NOT_PROVIDED as MAVLINK
from rig.sensors.mavlink.imu_readings import decode_reading
from rig.sensors.thermometer import MAX_WITHOUT_READING_S, Thermometer

SIX = (1, 2, 3, 4, 5, 6)
ALL_NEW = 0x103F


@pytest.mark.parametrize(
    ("absent", "value", "flags", "provided"),
    [
        (MAVLINK["SCALED_IMU"]["temperature"], 0, -1, False),
        (MAVLINK["RAW_IMU"]["temperature"], -32768, -1, False),
        (MAVLINK["SCALED_IMU3"]["temperature"], 32767, -1, False),
        (MAVLINK["SCALED_IMU2"]["temperature"], 1, -1, True),  # 0.01 °C: that is how an IMU at 0 °C says it
        (MAVLINK["HIGHRES_IMU"]["temperature"], 0.0, 0x3F, False),
        (MAVLINK["HIGHRES_IMU"]["temperature"], 0.0, ALL_NEW, True),
        (MAVLINK["HIGHRES_IMU"]["temperature"], np.nan, ALL_NEW, False),
        (MAVLINK["HIGHRES_IMU"]["rate"], [0.1, 0.2, 0.3], 0x1007, False),
        (MAVLINK["HIGHRES_IMU"]["rate"], [0.1, np.nan, 0.3], ALL_NEW, False),
        (MAVLINK["HIGHRES_IMU"]["force"], [0.1, 0.2, 0.3], 0x38, False),
        (KVH["rate"], [0.1, 0.2, 0.3], 0x75, False),
        (KVH["rate"], [0.1, 0.2, 0.3], 0x07, True),
        (KVH["force"], [0.1, 0.2, 0.3], 0x07, False),
        (KVH["temperature"], np.nan, -1, False),
        (LINES["temperature"], -127.0, -1, False),
        (LINES["temperature"], 999.0, -1, False),
        (LINES["temperature"], -12.5, -1, True),
    ],
)
def test_every_marker_of_none_is_known(absent: Absent, value: object, flags: int, provided: bool) -> None:
    assert absent.mask_provided(np.array([value]), np.array([flags])).tolist() == [provided]


@pytest.mark.parametrize("message", ["RAW_IMU", "SCALED_IMU"])
def test_mavlink_1_has_no_temperature_of_an_imu(message: str) -> None:
    """Its messages end before that field, and the library makes a zero of it."""
    from pymavlink.dialects.v10 import ardupilotmega as first_version

    second_version = dialect()
    extension = (0, 2531) if message == "RAW_IMU" else (2531,)
    for mavlink, more, celsius in ((second_version, extension, 25.31), (first_version, (), np.nan)):
        kind = mavlink.mavlink_map[getattr(mavlink, f"MAVLINK_MSG_ID_{message}")]
        sent = kind(1000, *SIX, 0, 0, 0, *more).pack(mavlink.MAVLink(None))  # pyrefly: ignore[bad-argument-type, bad-argument-count]  # a kind by its number
        (heard,) = second_version.MAVLink(None).parse_buffer(sent)
        reading = decode_reading(heard)
        assert reading.temperature_c == pytest.approx(celsius, nan_ok=True)
        assert ("temperature" in reading.provided) is bool(more) and {"rate", "force"} <= reading.provided


def test_the_last_temperature_stands_for_a_few_that_are_missing_and_not_for_many() -> None:
    thermometer = Thermometer("sensors.imu: it", rate_hz=10.0)
    assert np.isnan(thermometer.read(np.array([np.nan, np.nan]))).all() and not thermometer.provides
    assert thermometer.read(np.array([20.0, np.nan, 21.0, np.nan])).tolist() == [20.0, 20.0, 21.0, 21.0]
    assert thermometer.read(np.full(50, np.nan)).tolist() == [21.0] * 50 and thermometer.provides
    with pytest.raises(SensorError, match="temperature_lost"):
        thermometer.read(np.full(int(10 * MAX_WITHOUT_READING_S), np.nan))
