"""The library that knows MAVLink's messages, which an extra brings."""

from typing import Any

from rig.errors.extras import missing_extra

ARDUPILOT, PX4 = 3, 12  # MAV_AUTOPILOT of a heartbeat
FIRMWARES = {ARDUPILOT: "ArduPilot", PX4: "PX4"}
ARMED = 128  # MAV_MODE_FLAG_SAFETY_ARMED of its base_mode


def dialect() -> Any:
    """The messages and the parser of MAVLink 2, ArduPilot's among them. Raises Refused `missing_extra`."""
    try:
        from pymavlink.dialects.v20 import ardupilotmega
    except ImportError as error:
        raise missing_extra(error, "autopilot") from error
    return ardupilotmega
