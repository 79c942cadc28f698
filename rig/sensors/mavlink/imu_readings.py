"""The readings in an IMU's message, in SI units, and the fields that it does not provide. Pure.

Sources: the definitions of `common` on mavlink.io; the senders' code: ArduPilot, GCS_Common.cpp (send_raw_imu,
send_scaled_imu, send_highres_imu), PX4, src/modules/mavlink/streams (SCALED_IMU.hpp, HIGHRES_IMU.hpp).
"""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any, Literal

import numpy as np

from rig.data.not_provided import RANGE_C, Absent
from rig.estimation.arrays import Array
from rig.estimation.earth import STANDARD_GRAVITY_M_S2

MILLI = 1e-3
INT16_MAX = 32767
# Both firmwares assign a float to an integer field, which truncates it toward zero: an integer covers the step beyond
# it, and 0 all between -1 and 1. So two steps bound the distance of readings that differ.
TRUNCATION_STEPS = 2
UNIT_US = {"HIGHRES_IMU": 1, "RAW_IMU": 1, "SCALED_IMU": 1000, "SCALED_IMU2": 1000, "SCALED_IMU3": 1000}


Field = Literal["rate", "force", "temperature"]
# In hundredths of a degree 0 means "not provided"; an IMU at 0 °C sends 1. MAVLink 1 has no such field, which reads as
# 0 too. A firmware converts NaN to an end of the 16 bits.
_WHOLE: Mapping[Field, Absent] = MappingProxyType(
    {"rate": Absent(), "force": Absent(), "temperature": Absent(numbers=(0, -32768, 32767))}
)
# HIGHRES_IMU_UPDATED_FLAGS in `fields_updated`: which fields have a new value since the last message.
_SINGLE: Mapping[Field, Absent] = MappingProxyType(
    {"rate": Absent(bits=0x38), "force": Absent(bits=0x07), "temperature": Absent(within=RANGE_C, bits=0x1000)}
)
NOT_PROVIDED: Mapping[str, Mapping[Field, Absent]] = MappingProxyType(
    {message: _SINGLE if message == "HIGHRES_IMU" else _WHOLE for message in UNIT_US}
)


@dataclass(frozen=True, slots=True)
class ImuReading:
    """One message: its time in `UNIT_US`, rates (3,) rad/s, specific force (3,) m/s², temperature °C.

    `provided` are the fields with a new value; a temperature that is not among them is NaN.
    """

    time: int
    rate_rad_s: Array
    force_m_s2: Array
    temperature_c: float
    provided: frozenset[Field]


def is_integer(imu: str) -> bool:
    """Return whether an IMU's message holds integers, truncated toward zero."""
    return imu != "HIGHRES_IMU"


def decode_reading(message: Any) -> ImuReading:
    """Return the reading in a message of pymavlink, with the IMU's temperature (HIGHRES_IMU: the barometer's)."""
    kind = message.get_type()
    sent: Mapping[Field, Array] = {
        "rate": np.array([message.xgyro, message.ygyro, message.zgyro], dtype=np.float64),
        "force": np.array([message.xacc, message.yacc, message.zacc], dtype=np.float64),
        "temperature": np.array([message.temperature], dtype=np.float64),
    }
    flags = getattr(message, "fields_updated", -1)
    provided = frozenset(
        name for name, absent in NOT_PROVIDED[kind].items() if absent.mask_provided(sent[name][None], flags).all()
    )
    integer = is_integer(kind)
    time = message.time_boot_ms if kind.startswith("SCALED_IMU") else message.time_usec
    celsius = float(sent["temperature"][0]) * (0.01 if integer else 1.0)
    return ImuReading(
        time,
        _add_half_step(sent["rate"]) * MILLI if integer else sent["rate"],
        _add_half_step(sent["force"]) * MILLI * STANDARD_GRAVITY_M_S2 if integer else sent["force"],
        celsius if "temperature" in provided else float("nan"),
        provided,
    )


def _add_half_step(whole: Array) -> Array:
    """Return the middle of the interval that a truncated integer represents."""
    middle: Array = whole + 0.5 * np.sign(whole)
    return middle
