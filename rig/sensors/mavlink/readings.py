"""What an IMU's message says, in SI units. Pure.

Sources: the definitions of `common` on mavlink.io; who sends what in them: ArduPilot, GCS_Common.cpp (send_raw_imu,
send_scaled_imu, send_highres_imu), PX4, src/modules/mavlink/streams (SCALED_IMU.hpp, HIGHRES_IMU.hpp).
"""

from dataclasses import dataclass
from typing import Any

import numpy as np

from rig.estimation.arrays import Array
from rig.estimation.earth import STANDARD_GRAVITY_M_S2

MILLI = 1e-3
INT16_MAX = 32767
# Both firmwares hand a float to an integer field, which cuts it toward zero: a number stands for what lies beyond it,
# and 0 for all between -1 and 1. So two steps bound how far readings that differ may be apart.
CUT_STEPS = 2
UNIT_US = {"HIGHRES_IMU": 1, "RAW_IMU": 1, "SCALED_IMU": 1000, "SCALED_IMU2": 1000, "SCALED_IMU3": 1000}


@dataclass(frozen=True, slots=True)
class Reading:
    """One message: its time in `UNIT_US`, rates (3,) rad/s, specific force (3,) m/s², temperature °C."""

    time: int
    rate_rad_s: Array
    force_m_s2: Array
    temperature_c: float


def is_cut(imu: str) -> bool:
    """Whether the message holds whole numbers, cut toward zero."""
    return imu != "HIGHRES_IMU"


def reading_of(message: Any) -> Reading:
    """What a message of pymavlink's says. Its temperature is the IMU's own, in HIGHRES_IMU the barometer's."""
    rates = np.array([message.xgyro, message.ygyro, message.zgyro], dtype=np.float64)
    forces = np.array([message.xacc, message.yacc, message.zacc], dtype=np.float64)
    if not is_cut(message.get_type()):
        return Reading(message.time_usec, rates, forces, float(message.temperature))
    time = message.time_usec if message.get_type() == "RAW_IMU" else message.time_boot_ms
    force_m_s2 = _amid(forces) * MILLI * STANDARD_GRAVITY_M_S2
    return Reading(time, _amid(rates) * MILLI, force_m_s2, 0.01 * message.temperature)


def _amid(whole: Array) -> Array:
    """The middle of what a number that was cut toward zero stands for."""
    amid: Array = whole + 0.5 * np.sign(whole)
    return amid
