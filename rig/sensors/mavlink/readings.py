"""What an IMU's message says, in SI units, and what it does not provide. Pure.

Sources: the definitions of `common` on mavlink.io; who sends what in them: ArduPilot, GCS_Common.cpp (send_raw_imu,
send_scaled_imu, send_highres_imu), PX4, src/modules/mavlink/streams (SCALED_IMU.hpp, HIGHRES_IMU.hpp).
"""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any, Literal

import numpy as np

from rig.data.not_provided import POSSIBLE_C, Absent
from rig.estimation.arrays import Array
from rig.estimation.earth import STANDARD_GRAVITY_M_S2

MILLI = 1e-3
INT16_MAX = 32767
# Both firmwares hand a float to an integer field, which cuts it toward zero: a number stands for what lies beyond it,
# and 0 for all between -1 and 1. So two steps bound how far readings that differ may be apart.
CUT_STEPS = 2
UNIT_US = {"HIGHRES_IMU": 1, "RAW_IMU": 1, "SCALED_IMU": 1000, "SCALED_IMU2": 1000, "SCALED_IMU3": 1000}


Field = Literal["rate", "force", "temperature"]
# In hundredths of a degree 0 means "not provided"; an IMU at 0 °C sends 1. MAVLink 1 has no such field, which reads as
# 0 too. The ends of 16 bits are what a firmware makes of NaN.
_WHOLE: Mapping[Field, Absent] = MappingProxyType(
    {"rate": Absent(), "force": Absent(), "temperature": Absent(numbers=(0, -32768, 32767))}
)
# HIGHRES_IMU_UPDATED_FLAGS in `fields_updated`: which fields have a new value since the last message.
_SINGLE: Mapping[Field, Absent] = MappingProxyType(
    {
        "rate": Absent(bits=0x38),
        "force": Absent(bits=0x07),
        "temperature": Absent(within=POSSIBLE_C, bits=0x1000),
    }
)
NOT_PROVIDED: Mapping[str, Mapping[Field, Absent]] = MappingProxyType(
    {message: _SINGLE if message == "HIGHRES_IMU" else _WHOLE for message in UNIT_US}
)


@dataclass(frozen=True, slots=True)
class Reading:
    """One message: its time in `UNIT_US`, rates (3,) rad/s, specific force (3,) m/s², temperature °C.

    `provided` are the fields that hold a new value; a temperature that is not among them is NaN.
    """

    time: int
    rate_rad_s: Array
    force_m_s2: Array
    temperature_c: float
    provided: frozenset[Field]


def is_cut(imu: str) -> bool:
    """Whether the message holds whole numbers, cut toward zero."""
    return imu != "HIGHRES_IMU"


def reading_of(message: Any) -> Reading:
    """Return what a message of pymavlink's says. Its temperature is the IMU's own, in HIGHRES_IMU the barometer's."""
    kind = message.get_type()
    sent: Mapping[Field, Array] = {
        "rate": np.array([message.xgyro, message.ygyro, message.zgyro], dtype=np.float64),
        "force": np.array([message.xacc, message.yacc, message.zacc], dtype=np.float64),
        "temperature": np.array([message.temperature], dtype=np.float64),
    }
    flags = getattr(message, "fields_updated", -1)
    provided = frozenset(
        name for name, absent in NOT_PROVIDED[kind].items() if absent.provided(sent[name][None], flags).all()
    )
    cut = is_cut(kind)
    time = message.time_boot_ms if kind.startswith("SCALED_IMU") else message.time_usec
    celsius = float(sent["temperature"][0]) * (0.01 if cut else 1.0)
    return Reading(
        time,
        _amid(sent["rate"]) * MILLI if cut else sent["rate"],
        _amid(sent["force"]) * MILLI * STANDARD_GRAVITY_M_S2 if cut else sent["force"],
        celsius if "temperature" in provided else float("nan"),
        provided,
    )


def _amid(whole: Array) -> Array:
    """The middle of what a number that was cut toward zero stands for."""
    amid: Array = whole + 0.5 * np.sign(whole)
    return amid
