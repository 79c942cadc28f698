"""What all sections of a configuration file share: how they are checked, and what their values may be."""

from typing import Annotated, Any, Literal
from urllib.parse import urlsplit

from pydantic import BaseModel, ConfigDict, Field, StringConstraints

from rig.config.ranges import JOINT_RANGE_DEG

Direction = Literal["cw", "ccw"]
# The arms that can turn the sensors, each a row of `rig/motion/models/`.
ModelName = Literal["ur3e", "ur5e", "ur7e", "ur10e", "ur12e", "ur16e", "ur20", "ur30", "ur10_cb3"]
Vector3 = tuple[float, float, float]
Positive = Annotated[float, Field(gt=0)]
AccelerometerOrder = Literal[0, 1, 2]
JointAngle = Annotated[float, Field(ge=-JOINT_RANGE_DEG, le=JOINT_RANGE_DEG)]
Words = Annotated[str, StringConstraints(strip_whitespace=True, min_length=1, max_length=200)]
Offset = Annotated[float, Field(ge=-1000, le=1000)]
# A name becomes that of a dataset, of files and of C arrays.
SensorName = Annotated[str, Field(pattern=r"^\w[\w -]*$", max_length=40)]
RATIO: dict[str, Any] = {"unit": "1"}  # a number without a unit, where the key cannot say so


class Section(BaseModel):
    """A part of the file: unknown keys are refused, values are frozen."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


def checked_host(name: str) -> str:
    """A host's name or address. Raises ValueError when it cannot be one."""
    try:
        name.encode("idna")
    except UnicodeError:
        raise ValueError("not the name of a host; each part between dots has 1 to 63 characters") from None
    return name


def checked_port(value: str) -> str:
    """A serial port's name, or `socket://host:port`. Raises ValueError when it cannot be one.

    pyserial knows other addresses, and one of them, `spy://`, empties and writes a file that it names.
    """
    if "://" in value:
        try:
            parts = urlsplit(value)
            complete = value.startswith("socket://") and bool(checked_host(parts.hostname or "") and parts.port)
        except ValueError:
            complete = False
        if not complete:
            raise ValueError("must be the name of a port, or socket://host:port with a port from 1 to 65535")
    return value
