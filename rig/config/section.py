"""The base of all sections of a configuration file: common checks and types of values."""

from typing import Annotated, Any, Literal, get_args
from urllib.parse import urlsplit

from pydantic import AfterValidator, BaseModel, ConfigDict, Field, StringConstraints, ValidationInfo, field_validator

from rig.config.ranges import JOINT_RANGE_DEG

Direction = Literal["cw", "ccw"]
Vector3 = tuple[float, float, float]
Positive = Annotated[float, Field(gt=0)]
AccelerometerOrder = Literal[0, 1, 2]
JointAngle = Annotated[float, Field(ge=-JOINT_RANGE_DEG, le=JOINT_RANGE_DEG)]
Words = Annotated[str, StringConstraints(strip_whitespace=True, min_length=1, max_length=200)]
Offset = Annotated[float, Field(ge=-1000, le=1000)]
# A name becomes that of a dataset, of files and of C arrays.
SensorName = Annotated[str, Field(pattern=r"^\w[\w -]*$", max_length=40)]
DEFAULT_REST_S = 3.0  # of standing still after a sweep, and in an attitude (SIX, section IV)
RATIO: dict[str, Any] = {"unit": "1"}  # a number without a unit, where the key cannot say so


def no_number_is_true(cls: type[BaseModel], value: Any, info: ValidationInfo) -> Any:
    """Refuse true and false for numbers: YAML reads yes and on as true, which counts as the number 1."""
    field = cls.model_fields.get(info.field_name or "")
    if isinstance(value, bool) and field is not None:
        kinds = _kinds(field.annotation)
        if kinds & {int, float} and bool not in kinds:
            raise ValueError("must be a number; YAML reads yes, no, on and off as true and false")
    return value


def _kinds(annotation: Any) -> set[Any]:
    """Return the types in a field's annotation."""
    return {annotation}.union(*map(_kinds, get_args(annotation))) if get_args(annotation) else {annotation}


class Section(BaseModel):
    """A part of the file: unknown keys are refused, values are frozen."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False, defer_build=True)

    _numbers = field_validator("*", mode="before")(classmethod(no_number_is_true))


def check_host(name: str) -> str:
    """Return a host's name or address unchanged. Raise ValueError if it cannot be one."""
    try:
        name.encode("idna")
    except UnicodeError:
        raise ValueError("not the name of a host; each part between dots has 1 to 63 characters") from None
    return name


def check_port(value: str) -> str:
    """Return a serial port's name or `socket://host:port` unchanged. Raise ValueError if it cannot be one.

    pyserial knows other addresses, and one of them, `spy://`, empties and writes a file that it names.
    """
    if "://" in value:
        try:
            parts = urlsplit(value)
            complete = value.startswith("socket://") and bool(check_host(parts.hostname or "") and parts.port)
        except ValueError:
            complete = False
        if not complete:
            raise ValueError("must be the name of a port, or socket://host:port with a port from 1 to 65535")
    return value


Port = Annotated[str, AfterValidator(check_port)]  # the system knows the names of serial ports
