"""The sections of a sensor: its part and rate, its mounting, its own port, and its earlier calibration."""

from collections.abc import Mapping
from typing import Annotated, Any, Literal, Protocol, Self

import numpy as np
from pydantic import AfterValidator, Field, ValidationInfo, field_validator, model_validator

from rig.config.section import RATIO, Port, Positive, Section, Vector3
from rig.config.sensors.lines_section import UNDETERMINED, LinesSection
from rig.config.sensors.link_budget import KVH1775_MESSAGE_BYTES, sensor_line_over_budget
from rig.config.sensors.mavlink_section import MavlinkSection
from rig.config.sensors.sensor_catalogue import (
    CATALOGUE,
    MAGNETOMETERS,
    PARTS,
    MagnetometerName,
    PartName,
    list_numbers,
)

AxisName = Literal["+x", "-x", "+y", "-y", "+z", "-z"]
MAX_SERIAL_NUMBER = 24  # length of a "text24" in the board's protocol
PART_DEPENDENT: dict[str, Any] = {"allowed": "what the part has, see below", "usual": "the part's usual one"}


def mounting_matrix(mounting: "MountingSection") -> np.ndarray:
    """Return the (3, 3) rotation from the flange's frame to the sensor's nominal frame: row i is sensor axis i."""
    axes = {"x": 0, "y": 1, "z": 2}
    rows = np.zeros((3, 3))
    for row, name in enumerate((mounting.x, mounting.y, mounting.z)):
        rows[row, axes[name[1]]] = 1.0 if name[0] == "+" else -1.0
    return rows


def field_name(sensor: str) -> str:
    """Return the name of the magnetometer in the instrument `sensor`, which has a port of its own."""
    return f"{sensor}_field"


def scalar_name(sensor: str, scalar: str) -> str:
    """Return the name of the scalar quantity `scalar` in the lines of the device `sensor`."""
    return f"{sensor}_{scalar}"


# The speeds of a KVH 1775, and those that microcontrollers are usually set to.
KVH1775_BAUDS = (9600, 19200, 38400, 57600, 115200, 460800, 576000, 921600, 4147200)
Baud = Literal[
    9600, 19200, 38400, 57600, 115200, 230400, 250000, 460800, 500000, 576000, 921600, 1000000, 1500000, 2000000,
    3000000, 4147200,
]  # fmt: skip


class OwnPortSection(Section):
    """The serial port of a sensor that is not on the board, and its messages."""

    port: Port = Field(
        min_length=1,
        max_length=255,
        description="serial port, such as `/dev/ttyUSB0` or `COM4`, or `socket://host:port`",
    )
    baud: Baud = Field(
        default=921600, description="speed to which the sensor is set; the rig does not change it in the sensor"
    )
    message: Literal["A", "B", "C"] = Field(
        default="B",
        description="for a `kvh1775`: format of its messages: `B` contains the sensor's own microseconds, which show "
        "without doubt how many messages were lost; `A` and `C` do not contain them; `C` contains the magnetic "
        "field, recorded as the magnetometer `<sensor>_field`",
    )
    rotation: Literal["delta", "rate"] = Field(
        default="delta",
        description="for a `kvh1775`: `delta`: the angle since the message before, without aliasing; `rate`: the rate "
        "after the sensor's own filter",
    )


class MountingSection(Section):
    """The flange axis along which each sensor axis points, a right-handed frame. Errors of a few degrees do no harm."""

    x: AxisName = Field(default="+x", description="the flange axis along which the sensor's x axis points")
    y: AxisName = Field(default="+y", description="the flange axis along which the sensor's y axis points")
    z: AxisName = Field(default="+z", description="the flange axis along which the sensor's z axis points")

    @model_validator(mode="after")
    def refuse_left_handed_axes(self) -> Self:
        """Refuse a mirrored or repeated axis, which no mounting has."""
        if not np.isclose(np.linalg.det(mounting_matrix(self)), 1.0):
            raise ValueError("must name three different axes that form a right-handed frame, for example +x, +y, +z")
        return self


class TurntableSection(Section):
    """The reference's own earlier calibration: rate = scale · (reading + bias_rad_s)."""

    scale: tuple[Positive, Positive, Positive] = Field(
        default=(1.0, 1.0, 1.0), description="scale factor of each axis", json_schema_extra=RATIO
    )
    bias_rad_s: Vector3 = Field(default=(0.0, 0.0, 0.0), description="bias of each axis, added to the reading")


class AccelerationSection(Section):
    """The part's accelerometer. Without this section it is not read. Procedures with attitudes calibrate it."""

    range_g: float = Field(
        description="full scale of the accelerometer, one of the part's ranges",
        json_schema_extra={**PART_DEPENDENT, "unit": "g"},
    )


class ConfiguredSensor(Protocol):
    """The common keys of every sensor's section; the properties of its part are in the catalogue."""

    @property
    def part(self) -> str: ...
    @property
    def serial_number(self) -> str: ...
    @property
    def rate_hz(self) -> float: ...
    @property
    def mounting(self) -> MountingSection: ...


def check_serial_number(value: str) -> str:
    """Return a serial number that fits the board's record of a calibration. Raise ValueError otherwise."""
    if value == UNDETERMINED:
        raise ValueError("write the number of this specimen here; it is on the device or its certificate")
    if not (value.isascii() and value.isprintable() and 0 < len(value) <= MAX_SERIAL_NUMBER):
        raise ValueError(f"must be 1 to {MAX_SERIAL_NUMBER} plain ASCII characters: a board can store no others")
    return value


def the_part_has_it(value: float, info: ValidationInfo) -> float:
    """Return a rate or range as the part has it. Raise ValueError if the part has no such value."""
    part = CATALOGUE.get(info.data.get("part", ""))
    if part is None:
        return value
    return part.accept_rate(value) if info.field_name == "rate_hz" else part.accept_range(value)


SerialNumber = Annotated[str, AfterValidator(check_serial_number)]
OfThePart = Annotated[float, AfterValidator(the_part_has_it)]


class SensorSection(Section):
    """One gyroscope, under a name of your choice: at most 40 letters, digits, `_`, `-` and spaces."""

    part: PartName = Field(description="which gyroscope it is; `lines` is any that prints its samples as lines")
    serial_number: SerialNumber = Field(
        description="serial number of this sensor; stored on the board and in every result; a `kvh1775` reports "
        "its own, and another number is refused",
        json_schema_extra={"allowed": f"1 to {MAX_SERIAL_NUMBER} plain ASCII characters"},
    )
    role: Literal["calibrate", "reference"] = Field(
        default="calibrate",
        description="purpose of the sensor: it is calibrated, or it is the reference with which the others are "
        "compared; at most one is the reference",
    )
    rate_hz: OfThePart = Field(
        description="samples per second, one of the part's rates; 333.33 means 1000/3", json_schema_extra=PART_DEPENDENT
    )
    range_deg_s: OfThePart = Field(
        description="full scale, one of the part's ranges; at least 1.5 times the fastest sweep",
        json_schema_extra=PART_DEPENDENT,
    )
    mounting: MountingSection = Field(default=MountingSection(), description="how it is mounted on the flange")
    correction: Literal["matrix", "diagonal"] = Field(
        default="diagonal",
        description="how the board and `calibration.h` correct readings: `diagonal`, each axis alone, as in the "
        "paper; `matrix`, with the whole matrix, which also brings the axes to right angles",
    )
    turntable: TurntableSection = Field(
        default=TurntableSection(), description="its own calibration, only for a reference; if left out, it reads true"
    )
    acceleration: AccelerationSection | None = Field(
        default=None, description="its accelerometer; if left out, only the gyroscope is read"
    )
    serial: OwnPortSection | None = Field(
        default=None, description="its own serial port, for a `kvh1775` or `lines`; the other parts are on the board"
    )
    mavlink: MavlinkSection | None = Field(
        default=None, description="the autopilot that the IMU is in, for a `mavlink`; other parts have none"
    )
    lines: LinesSection | None = Field(default=None, description="what it prints, for `lines`")

    @property
    def on_board(self) -> bool:
        """Whether the board reads the sensor."""
        return self.own_port is None

    @property
    def own_port(self) -> tuple[str, str] | None:
        """The sensor's own port and the key in its section that states the port; None if it has no port of its own."""
        if self.serial is not None:
            return "serial.port", self.serial.port
        return None if self.mavlink is None else ("mavlink.port", self.mavlink.port)

    def brings(self, name: str) -> set[str]:
        """Return the names of the other sensors in the device `name`: a magnetometer, and sensors of scalars."""
        if self.lines is None:
            return {field_name(name)} if self.serial is not None and self.serial.message == "C" else set()
        field = {field_name(name)} if self.lines.field is not None else set()
        return field | {scalar_name(name, scalar) for scalar in self.lines.scalars}

    @model_validator(mode="before")
    @classmethod
    def set_defaults_of_part(cls, data: Any) -> Any:
        """Fill in the part's default data rate and ranges if they are omitted."""
        if not isinstance(data, Mapping):
            return data
        name = data.get("part")
        # An unknown part is a separate error; any part stands in for it here.
        part = PARTS[name] if isinstance(name, str) and name in PARTS else next(iter(PARTS.values()))
        if part.any_rate:  # a part that may be any device has no usual values
            return data
        usual = {"rate_hz": part.default_rate_hz, "range_deg_s": part.default_range_deg_s}
        whole = {**data, **{key: value for key, value in usual.items() if data.get(key) is None}}
        acceleration = data.get("acceleration")
        if isinstance(acceleration, Mapping) and acceleration.get("range_g") is None:
            whole["acceleration"] = {**acceleration, "range_g": part.ranges_g[0]}
        return whole

    @field_validator("acceleration")
    @classmethod
    def check_accelerometer_range(
        cls, value: AccelerationSection | None, info: ValidationInfo
    ) -> AccelerationSection | None:
        """Refuse a missing range, or one that the part's accelerometer does not have."""
        part = PARTS.get(info.data.get("part", ""))
        if value is None or part is None:
            return value
        if part.any_rate:
            if value.range_g <= 0:
                raise ValueError("state range_g, the full scale to which its program sets the accelerometer")
            return value
        if value.range_g not in part.ranges_g:
            raise ValueError(f"the part has no range_g {value.range_g:g}; it has {', '.join(map(str, part.ranges_g))}")
        return value

    @model_validator(mode="after")
    def check_own_port(self) -> Self:
        """Refuse sections of a port or of lines that do not fit the part, and a baud rate too low or not supported."""
        if self.part == "mavlink" or self.mavlink is not None:
            return self._is_in_autopilot()
        own_port = PARTS[self.part].own_port
        if own_port != (self.serial is not None):
            raise ValueError(
                f"{self.part} is {'not on the board: give its section serial' if own_port else 'on the board: leave'}"
                f"{'' if own_port else ' serial out'}"
            )
        if (self.part == "lines") != (self.lines is not None):
            raise ValueError("part lines and a section lines go together: it says what the device prints")
        if self.lines is not None and self.acceleration is not None and self.lines.acceleration is None:
            raise ValueError("its accelerometer is to be read: give lines.acceleration, and the columns ax ay az")
        if self.serial is not None:
            if self.part == "kvh1775" and self.serial.baud not in KVH1775_BAUDS:
                raise ValueError(f"a kvh1775 supports serial.baud {', '.join(map(str, KVH1775_BAUDS))}")
            size = KVH1775_MESSAGE_BYTES[self.serial.message] if self.lines is None else self.lines.least_bytes
            problem = sensor_line_over_budget(self.rate_hz, size, self.serial.baud)
            if problem is not None:
                raise ValueError(problem)
        return self

    def _is_in_autopilot(self) -> Self:
        if self.part != "mavlink":
            raise ValueError(f"{self.part} is in no autopilot: leave mavlink out")
        if self.mavlink is None or self.serial is not None:
            raise ValueError("mavlink is in an autopilot: give its section mavlink, and no serial")
        return self

    @field_validator("turntable")
    @classmethod
    def require_reference(cls, value: TurntableSection, info: ValidationInfo) -> TurntableSection:
        """Refuse a stated calibration of a sensor that the run calibrates; only a reference may have one."""
        if info.data.get("role") == "calibrate":
            raise ValueError(
                "only a sensor with role: reference has a calibration in the configuration; the run finds that of a "
                "sensor to calibrate"
            )
        return value


class MagnetometerSection(Section):
    """One magnetometer on the board, under a name that no gyroscope has: recorded, and calibrated in attitudes."""

    part: MagnetometerName = Field(description="which magnetometer it is")
    serial_number: SerialNumber = Field(
        description="serial number of this sensor; in every result",
        json_schema_extra={"allowed": f"1 to {MAX_SERIAL_NUMBER} plain ASCII characters"},
    )
    rate_hz: OfThePart = Field(
        default=MAGNETOMETERS["lsm9ds1_magnetometer"].default_rate_hz,
        description="samples per second, one of the part's rates",
        json_schema_extra={"allowed": list_numbers(MAGNETOMETERS["lsm9ds1_magnetometer"].rates_hz)},
    )
    range_gauss: OfThePart = Field(
        default=MAGNETOMETERS["lsm9ds1_magnetometer"].ranges_gauss[0],
        description="full scale, one of the part's ranges; 1 gauss is 100 µT, twice the Earth's field",
        json_schema_extra={
            "unit": "gauss",
            "allowed": list_numbers(MAGNETOMETERS["lsm9ds1_magnetometer"].ranges_gauss),
        },
    )
    mounting: MountingSection = Field(default=MountingSection(), description="how it is mounted on the flange")
