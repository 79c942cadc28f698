"""A parameter's value as it comes and goes: four bytes, whose meaning the two firmwares see differently. Pure.

The field is a float. ArduPilot casts whole numbers to one (GCS_Param.cpp, `cast_to_float`); PX4 copies their four bytes
into it (mavlink_parameters.cpp, "MAVLink encodes float and int params in the same space").
"""

import struct
from dataclasses import dataclass

from rig.sensors.mavlink.dialect import PX4

REAL32 = 9  # MAV_PARAM_TYPE
WHOLE = {1: "B", 2: "b", 3: "H", 4: "h", 5: "I", 6: "i"}  # … UINT8 to INT32
SINGLE = struct.Struct("<f")


@dataclass(frozen=True, slots=True)
class Parameter:
    """A parameter of an autopilot: its type and the four bytes of its value as they were sent."""

    name: str
    type: int
    field: bytes
    firmware: int

    @property
    def value(self) -> float:
        """What the four bytes mean. Raises ValueError of a type that nobody sends in four."""
        if self.type in WHOLE and self.firmware == PX4:
            code = WHOLE[self.type]
            return float(struct.unpack_from(f"<{code}", self.field)[0])
        if self.type in WHOLE or self.type == REAL32:
            return float(SINGLE.unpack(self.field)[0])
        raise ValueError(f"{self.name} is of type {self.type}, which four bytes cannot hold")


def field_of(value: float) -> bytes:
    """The four bytes of a value in single precision, as a parameter of type REAL32 has them."""
    return SINGLE.pack(value)


def field_as_number(field: bytes) -> float:
    """The float that pymavlink makes those four bytes of."""
    return float(SINGLE.unpack(field)[0])


def payload_field(frame: bytes) -> bytes:
    """The four bytes of the value in the frame of a PARAM_VALUE, which begins with them after the header."""
    begin = 10 if frame[0] == 0xFD else 6
    return frame[begin : begin + 4]
