"""A parameter's value in transfer: four bytes, which the two firmwares interpret differently. Pure.

The field is a float. ArduPilot casts an integer to a float (GCS_Param.cpp, `cast_to_float`); PX4 copies the integer's
four bytes into the field (mavlink_parameters.cpp, "MAVLink encodes float and int params in the same space").
"""

import struct
from dataclasses import dataclass

from rig.sensors.mavlink.dialect import PX4

REAL32 = 9  # MAV_PARAM_TYPE
FORMATS = {1: "B", 2: "b", 3: "H", 4: "h", 5: "I", 6: "i"}  # MAV_PARAM_TYPE from UINT8 to INT32, as struct formats
FLOAT32 = struct.Struct("<f")


@dataclass(frozen=True, slots=True)
class AutopilotParameter:
    """A parameter of an autopilot: its type and the four bytes of its value as sent."""

    name: str
    type: int
    field: bytes
    firmware: int

    @property
    def value(self) -> float:
        """The value of the four bytes. Raise ValueError for a type that does not fit four bytes."""
        if self.type in FORMATS and self.firmware == PX4:
            code = FORMATS[self.type]
            return float(struct.unpack_from(f"<{code}", self.field)[0])
        if self.type in FORMATS or self.type == REAL32:
            return float(FLOAT32.unpack(self.field)[0])
        raise ValueError(f"{self.name} is of type {self.type}, which four bytes cannot hold")


def encode_value(value: float) -> bytes:
    """Return the four bytes of a value in single precision, as in a parameter of type REAL32."""
    return FLOAT32.pack(value)


def decode_float(field: bytes) -> float:
    """Return the float that pymavlink decodes from the four bytes of `field`."""
    return float(FLOAT32.unpack(field)[0])


def extract_value(frame: bytes) -> bytes:
    """Return the four bytes of the value, which follow the header in the frame of a PARAM_VALUE."""
    begin = 10 if frame[0] == 0xFD else 6
    return frame[begin : begin + 4]
