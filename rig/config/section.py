"""The base class of all sections of a configuration file, with common checks and types of values."""

import ipaddress
import re
from typing import Annotated, Any, Literal, get_args
from urllib.parse import urlsplit

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, StringConstraints, ValidationInfo, field_validator

from rig.config.ranges import JOINT_RANGE_DEG

Direction = Literal["cw", "ccw"]
Vector3 = tuple[float, float, float]
Positive = Annotated[float, Field(gt=0)]
AccelerometerOrder = Literal[0, 1, 2]
JointAngle = Annotated[float, Field(ge=-JOINT_RANGE_DEG, le=JOINT_RANGE_DEG)]
_LABEL = "[A-Za-z0-9](?:[A-Za-z0-9-]{0,61}[A-Za-z0-9])?"
_HOST_NAME = re.compile(rf"(?=.{{1,253}}$)(?:{_LABEL}\.)*(?!\d+\.?$){_LABEL}\.?")
Words = Annotated[str, StringConstraints(strip_whitespace=True, min_length=1, max_length=200)]
Offset = Annotated[float, Field(ge=-1000, le=1000)]
# A name becomes that of a dataset, of files and of C arrays.
SensorName = Annotated[str, Field(pattern=r"^\w[\w -]*$", max_length=40)]
DEFAULT_REST_S = 3.0  # duration of a rest after a sweep, and in an attitude (SIX, section IV)
RATIO: dict[str, Any] = {"unit": "1"}  # numbers without a unit: a key shows by its ending only which unit it has
Ratio = Annotated[float, Field(json_schema_extra=RATIO)]
WholeNumber = Annotated[int, Field(json_schema_extra=RATIO)]


def refuse_boolean_number(cls: type[BaseModel], value: Any, info: ValidationInfo) -> Any:
    """Refuse true and false for numbers, because YAML reads yes and on as true, which would count as 1."""
    field = cls.model_fields.get(info.field_name or "")
    if isinstance(value, bool) and field is not None:
        kinds = _kinds(field.annotation)
        if kinds & {int, float} and bool not in kinds:
            raise ValueError("must be a number; YAML reads yes, no, on and off as true and false")
    return value


def _kinds(annotation: Any) -> set[Any]:
    """Return the types in a field's type annotation."""
    return {annotation}.union(*map(_kinds, get_args(annotation))) if get_args(annotation) else {annotation}


class Section(BaseModel):
    """A part of a configuration file: unknown keys are refused, values are frozen."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False, defer_build=True)

    _numbers = field_validator("*", mode="before")(classmethod(refuse_boolean_number))


def check_host(name: str) -> str:
    """Return a host's IP address or name unchanged. Raise ValueError for any other text.

    A name has the form of RFC 1123, section 2.1, once its non-ASCII letters are encoded (IDNA, RFC 3490). Names whose
    last part is a number, as in an IPv4 address, and addresses of many or of unspecified hosts are refused.
    """
    try:
        address = ipaddress.ip_address(name)
        valid = not (address.is_unspecified or address.is_multicast)
    except ValueError:
        valid = _is_host_name(name)
    if not valid:
        raise ValueError(
            "neither an IP address nor a host name; give it as 192.168.1.102 or ur10e.local, without http:// and port"
        )
    return name


def _is_host_name(name: str) -> bool:
    try:
        return _HOST_NAME.fullmatch(name.encode("idna").decode("ascii")) is not None
    except UnicodeError:
        return False


PORT_NAME = re.compile(r".*[/\\].+|COM\d+", re.IGNORECASE)


def check_port(value: str) -> str:
    """Return a serial port's name or `socket://host:port` unchanged. Raise ValueError for any other text.

    A name is a path, or a port of Windows. Other addresses of pyserial are refused, because one of them, `spy://`,
    overwrites a file.
    """
    if "://" in value:
        try:
            parts = urlsplit(value)
            is_port = value.startswith("socket://") and bool(check_host(parts.hostname or "") and parts.port)
        except ValueError:
            is_port = False
    else:
        is_port = PORT_NAME.fullmatch(value) is not None
    if not is_port:
        raise ValueError(
            "must be the name of a serial port, such as /dev/ttyUSB0 or COM3, or socket://host:port with a port from 1 "
            "to 65535"
        )
    return value


Port = Annotated[str, AfterValidator(check_port)]  # the system knows the names of serial ports
