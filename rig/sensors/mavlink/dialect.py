"""The library of MAVLink's messages, an optional dependency."""

from typing import Any

from rig.errors.extras import requiring

ARDUPILOT, PX4 = 3, 12  # MAV_AUTOPILOT of a heartbeat
FIRMWARES = {ARDUPILOT: "ArduPilot", PX4: "PX4"}
ARMED_FLAG = 128  # MAV_MODE_FLAG_SAFETY_ARMED in its base_mode


def dialect() -> Any:
    """Return the module with messages and parser of MAVLink 2, ArduPilot's included. Raise Refused `missing_extra`."""
    with requiring("autopilot"):
        from pymavlink.dialects.v20 import ardupilotmega
    return ardupilotmega
