"""What a configuration file may say.

Every quantity carries its unit in its key. Degrees live only here, at the edge; the rig works in SI units. Every key
says what it means: docs/configuration.md is made of these descriptions.
"""

from collections.abc import Iterable, Mapping
from datetime import date
from typing import Annotated, Any, Literal, Self
from urllib.parse import urlsplit

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, StringConstraints, ValidationInfo, field_validator, model_validator

from rig.config.link_budget import KVH1775_MESSAGE_BYTES, Stream, over_budget, own_line_over_budget
from rig.config.sensor_catalogue import MAGNETOMETERS, PARTS, in_words, nearest_rate, one_of
from rig.config.ur10e_limits import (
    JOINT_LIMIT_DEG,
    PAYLOAD_LIMIT_KG,
    SPEED_LIMIT_DEG_S,
)

Direction = Literal["cw", "ccw"]
AxisName = Literal["+x", "-x", "+y", "-y", "+z", "-z"]
Vector3 = tuple[float, float, float]
Vector6 = tuple[float, float, float, float, float, float]
Positive = Annotated[float, Field(gt=0)]
AccelerometerOrder = Literal[0, 1, 2]
JointAngle = Annotated[float, Field(ge=-JOINT_LIMIT_DEG, le=JOINT_LIMIT_DEG)]
Words = Annotated[str, StringConstraints(strip_whitespace=True, min_length=1, max_length=200)]
Offset = Annotated[float, Field(ge=-1000, le=1000)]
# A name becomes that of a dataset, of files and of C arrays.
SensorName = Annotated[str, Field(pattern=r"^\w[\w -]*$", max_length=40)]
MIN_LEVEL = 0.1  # sine of the angle between the vertical and what a heading is given of
SERIAL_NUMBER_MAX = 24  # of the kind "text24" in the board's protocol
RATIO: dict[str, Any] = {"unit": "1"}  # a number without a unit, where the key cannot say so
OF_THE_PART: dict[str, Any] = {"allowed": "what the part has, see below", "usual": "the part's usual one"}


class Section(BaseModel):
    """A part of the file: unknown keys are refused, values are frozen."""

    model_config = ConfigDict(extra="forbid", frozen=True, allow_inf_nan=False)


class ArmSection(Section):
    """The robot arm and what it carries."""

    host: str = Field(min_length=1, max_length=253, description="name or address of the arm's controller")
    payload_kg: float = Field(
        ge=0, le=PAYLOAD_LIMIT_KG, description="mass of all that the flange carries: fixture, board, cable"
    )
    payload_centre_mm: tuple[Offset, Offset, Offset] = Field(
        default=(0.0, 0.0, 0.0), description="its centre of mass, x y z in the flange's frame"
    )
    home_deg: tuple[JointAngle, JointAngle, JointAngle, JointAngle, JointAngle, JointAngle] = Field(
        default=(0.0, -90.0, 90.0, -90.0, -90.0, 0.0),
        description="joint angles, base to wrist 3, of the pose around which everything turns; wrist 2 near ±90°, or "
        "the wrists' axes do not span space",
    )
    transfer_speed_deg_s: float = Field(
        default=120.0, ge=0.1, le=SPEED_LIMIT_DEG_S, description="speed of the ways between sweeps"
    )
    state_rate_hz: float = Field(default=125.0, ge=125, le=500, description="how often the arm tells its state")
    kinematics: Literal["controller", "nominal"] = Field(
        default="controller",
        description="whose account of the arm's geometry is used: `controller`, as the factory has measured this arm; "
        "`nominal`, that of every UR10e",
    )

    @field_validator("host")
    @classmethod
    def can_be_looked_up(cls, value: str) -> str:
        """What no name server could be asked for."""
        return checked_host(value)


def checked_host(name: str) -> str:
    """A host's name or address. Raises ValueError when it cannot be one."""
    try:
        name.encode("idna")
    except UnicodeError:
        raise ValueError("no host's name; between its dots stand 1 to 63 characters each") from None
    return name


def checked_port(value: str) -> str:
    """A serial port's name, or `socket://host:port`. Raises ValueError when it cannot be one."""
    if value.startswith("socket://"):
        try:
            parts = urlsplit(value)
            complete = bool(checked_host(parts.hostname or "") and parts.port)
        except ValueError:
            complete = False
        if not complete:
            raise ValueError("must be socket://host:port with a port from 1 to 65535")
    return value


class BoardSection(Section):
    """The microcontroller board; left out where every sensor has a port of its own."""

    port: str = Field(
        min_length=1,
        max_length=255,
        description="serial port, such as `/dev/ttyACM0` or `COM3`, or `socket://host:port`",
    )
    baud: Literal[115200, 230400, 460800, 921600] = Field(
        default=921600, description="speed of the serial line", json_schema_extra={"unit": "Bd"}
    )

    @field_validator("port")
    @classmethod
    def an_address_has_host_and_port(cls, value: str) -> str:
        """Of `socket://host:port`; the name of a serial port is the system's affair."""
        return checked_port(value)


def mounting_matrix(mounting: "MountingSection") -> np.ndarray:
    """(3, 3) rotation taking a flange-frame vector to the sensor's nominal frame: row i is sensor axis i."""
    axes = {"x": 0, "y": 1, "z": 2}
    rows = np.zeros((3, 3))
    for row, name in enumerate((mounting.x, mounting.y, mounting.z)):
        rows[row, axes[name[1]]] = 1.0 if name[0] == "+" else -1.0
    return rows


class OwnPortSection(Section):
    """The serial port of a sensor that is not on the board, and what it sends there."""

    port: str = Field(
        min_length=1,
        max_length=255,
        description="serial port, such as `/dev/ttyUSB0` or `COM4`, or `socket://host:port`",
    )
    baud: Literal[9600, 19200, 38400, 57600, 115200, 460800, 576000, 921600, 4147200] = Field(
        default=921600,
        description="speed the sensor's line is set to; the rig changes it on neither side",
        json_schema_extra={"unit": "Bd"},
    )
    message: Literal["A", "B", "C"] = Field(
        default="B",
        description="format of its messages: `B` has the sensor's own microseconds, by which lost messages are counted "
        "beyond doubt; `A` and `C` have none, and `C` has its magnetic field",
    )
    rotation: Literal["delta", "rate"] = Field(
        default="delta",
        description="`delta`: the angle turned through since the message before, in which nothing is aliased; `rate`: "
        "the rate as the sensor's own filter leaves it",
    )

    @field_validator("port")
    @classmethod
    def an_address_has_host_and_port(cls, value: str) -> str:
        """As of the board."""
        return checked_port(value)


class MountingSection(Section):
    """Which flange axis each sensor axis points along, nominally: a right-handed frame. It need not be exact."""

    x: AxisName = Field(default="+x", description="the flange axis along which the sensor's x axis points")
    y: AxisName = Field(default="+y", description="the same of its y axis")
    z: AxisName = Field(default="+z", description="the same of its z axis")

    @model_validator(mode="after")
    def right_handed(self) -> Self:
        """A mirrored or doubled axis is not a mounting."""
        if not np.isclose(np.linalg.det(mounting_matrix(self)), 1.0):
            raise ValueError("must name three different axes that form a right-handed frame, for example +x, +y, +z")
        return self


class TurntableSection(Section):
    """A reference's own calibration, found before: rate = scale · (reading + bias_rad_s)."""

    scale: tuple[Positive, Positive, Positive] = Field(
        default=(1.0, 1.0, 1.0), description="scale factor of each axis", json_schema_extra=RATIO
    )
    bias_rad_s: Vector3 = Field(default=(0.0, 0.0, 0.0), description="bias of each axis, added to the reading")


class AccelerationSection(Section):
    """The part's accelerometer; without this section it is not read. It is calibrated where attitudes are held."""

    range_g: float | None = Field(
        default=None,
        description="its full scale, one of the part's; left out, the smallest it has",
        json_schema_extra={"unit": "g"},
    )


class SensorSection(Section):
    """One gyroscope, under a name of your choice: at most 40 letters, digits, `_`, `-` and spaces."""

    part: Literal["lsm9ds1", "mpu9250", "adis16465", "kvh1775"] = Field(description="which gyroscope it is")
    serial_number: str = Field(
        description="which specimen it is; kept on the board and in every result; a `kvh1775` is asked for its own",
        json_schema_extra={"allowed": f"1 to {SERIAL_NUMBER_MAX} plain ASCII characters"},
    )
    role: Literal["calibrate", "reference"] = Field(
        default="calibrate",
        description="what it is here for; at most one sensor is the reference others are compared with",
    )
    rate_hz: float = Field(
        description="samples a second, one of the part's rates; 333.33 stands for 1000/3", json_schema_extra=OF_THE_PART
    )
    range_deg_s: float = Field(
        description="full scale, one of the part's ranges; at least 1.5 times the fastest sweep",
        json_schema_extra=OF_THE_PART,
    )
    mounting: MountingSection = Field(default=MountingSection(), description="how it sits on the flange")
    correction: Literal["matrix", "diagonal"] = Field(
        default="diagonal",
        description="what the board and `calibration.h` correct readings by: each axis for itself, as in the paper, or "
        "the whole matrix, which also brings the axes to right angles",
    )
    turntable: TurntableSection = Field(
        default=TurntableSection(), description="its own calibration, of a reference only; left out, it reads true"
    )
    acceleration: AccelerationSection | None = Field(
        default=None, description="its accelerometer; left out, only the gyroscope is read"
    )
    serial: OwnPortSection | None = Field(
        default=None, description="its own serial port, of a `kvh1775`; the other parts are on the board"
    )

    @property
    def on_board(self) -> bool:
        """Whether the board reads it."""
        return self.serial is None

    @model_validator(mode="before")
    @classmethod
    def usual_of_the_part(cls, data: Any) -> Any:
        """Left out, data rate and range are the part's usual ones."""
        if not isinstance(data, Mapping):
            return data
        name = data.get("part")
        # A part that is not known is an error of its own, whatever stands in for it here.
        part = PARTS[name] if isinstance(name, str) and name in PARTS else next(iter(PARTS.values()))
        usual = {"rate_hz": part.default_rate_hz, "range_deg_s": part.default_range_deg_s}
        return {**data, **{key: value for key, value in usual.items() if data.get(key) is None}}

    @field_validator("serial_number")
    @classmethod
    def the_board_can_keep_it(cls, value: str) -> str:
        """The board stores it beside the calibration, in a field of fixed width."""
        return checked_serial_number(value)

    @field_validator("rate_hz", "range_deg_s")
    @classmethod
    def the_part_has_it(cls, value: float, info: ValidationInfo) -> float:
        """Only what the part can do, and never silently something else."""
        part = PARTS.get(info.data.get("part", ""))
        if part is None:
            return value
        return part.accept_rate(value) if info.field_name == "rate_hz" else part.accept_range(value)

    @field_validator("acceleration")
    @classmethod
    def a_range_of_its_accelerometer(
        cls, value: AccelerationSection | None, info: ValidationInfo
    ) -> AccelerationSection | None:
        """As of its gyroscope; left out, the smallest: nothing on the arm is felt beyond 2 g."""
        part = PARTS.get(info.data.get("part", ""))
        if value is None or part is None:
            return value
        if value.range_g is None:
            return value.model_copy(update={"range_g": part.ranges_g[0]})
        if value.range_g not in part.ranges_g:
            raise ValueError(f"the part has no range_g {value.range_g:g}; it has {', '.join(map(str, part.ranges_g))}")
        return value

    @model_validator(mode="after")
    def its_own_port_carries_it(self) -> Self:
        """A part has a port of its own or it is on the board."""
        own_port = PARTS[self.part].own_port
        if own_port != (self.serial is not None):
            raise ValueError(
                f"{self.part} is {'not on the board: give its section serial' if own_port else 'on the board: leave'}"
                f"{'' if own_port else ' serial out'}"
            )
        if self.serial is not None:
            size = KVH1775_MESSAGE_BYTES[self.serial.message]
            problem = own_line_over_budget(self.rate_hz, size, self.serial.baud)
            if problem is not None:
                raise ValueError(problem)
        return self

    @field_validator("turntable")
    @classmethod
    def only_of_a_reference(cls, value: TurntableSection, info: ValidationInfo) -> TurntableSection:
        """A sensor that is to be calibrated has no calibration yet."""
        if info.data.get("role") == "calibrate":
            raise ValueError("only a sensor with role: reference has one; a sensor to calibrate gets its own here")
        return value


def checked_serial_number(value: str) -> str:
    """Raises ValueError when the board could not keep it."""
    if not (value.isascii() and value.isprintable() and 0 < len(value) <= SERIAL_NUMBER_MAX):
        raise ValueError(f"must be 1 to {SERIAL_NUMBER_MAX} plain ASCII characters; the board keeps no others")
    return value


class MagnetometerSection(Section):
    """One magnetometer on the board, under a name that no gyroscope has: recorded, and calibrated in attitudes."""

    part: Literal["lsm9ds1_magnetometer"] = Field(description="which magnetometer it is")
    serial_number: str = Field(
        description="which specimen it is; in every result",
        json_schema_extra={"allowed": f"1 to {SERIAL_NUMBER_MAX} plain ASCII characters"},
    )
    rate_hz: float = Field(
        default=MAGNETOMETERS["lsm9ds1_magnetometer"].default_rate_hz,
        description="samples a second, one of the part's rates",
        json_schema_extra={"allowed": in_words(MAGNETOMETERS["lsm9ds1_magnetometer"].rates_hz)},
    )
    range_gauss: float = Field(
        default=MAGNETOMETERS["lsm9ds1_magnetometer"].ranges_gauss[0],
        description="full scale, one of the part's ranges; 1 gauss is 100 µT, twice the Earth's field",
        json_schema_extra={"unit": "gauss", "allowed": in_words(MAGNETOMETERS["lsm9ds1_magnetometer"].ranges_gauss)},
    )
    mounting: MountingSection = Field(default=MountingSection(), description="how it sits on the flange")

    @field_validator("serial_number")
    @classmethod
    def as_any_other(cls, value: str) -> str:
        """Of the same kind as a gyroscope's."""
        return checked_serial_number(value)

    @field_validator("rate_hz")
    @classmethod
    def a_rate_of_the_part(cls, value: float, info: ValidationInfo) -> float:
        """Never silently another one."""
        part = MAGNETOMETERS.get(info.data.get("part", ""))
        return value if part is None else nearest_rate(value, part.rates_hz, in_words(part.rates_hz))

    @field_validator("range_gauss")
    @classmethod
    def a_range_of_the_part(cls, value: float, info: ValidationInfo) -> float:
        """As the rate."""
        part = MAGNETOMETERS.get(info.data.get("part", ""))
        return value if part is None else one_of(value, part.ranges_gauss)


class ProcedureSection(Section):
    """What every procedure's section has: its name. A procedure adds its own keys and says what else it needs."""

    name: str = Field(description="which procedure is run")

    @property
    def then_verify(self) -> bool:
        """Whether a calibration that passed is stored on the board and verified by repeating the movement."""
        return False

    @property
    def needs_reference(self) -> bool:
        """Whether calibrated readings are compared with a reference's."""
        return self.then_verify

    @property
    def accelerometer_order(self) -> AccelerometerOrder:
        """Of the accelerometer's model that the attitudes must tell; 0 where they need not tell one."""
        return 0

    @property
    def finds_earth_rate(self) -> bool:
        """Whether the Earth's rate is found from what the gyroscopes read; else it is known by the site, or unknown."""
        return False

    def problems(self, config: "RigConfig") -> Iterable[str]:
        """What of the rest of the configuration does not fit this procedure, a line each."""
        return ()


class ObservationSection(Section):
    """What an averaged revolution must satisfy to be used."""

    max_lost_fraction: float = Field(
        default=0.001, ge=0, lt=1, description="share of a sweep's samples that may be missing", json_schema_extra=RATIO
    )
    max_speed_deviation: float = Field(
        default=0.25,
        gt=0,
        lt=1,
        description="how far the joint's rate, smoothed over 50 ms, may lie from its mean, as a share of it",
        json_schema_extra=RATIO,
    )
    max_axis_deviation_deg: float = Field(
        default=20.0,
        gt=0,
        lt=45,
        description="how far the measured rotation may lie from the nominal axis of the sensor",
    )


class LimitsSection(Section):
    """The verdict's limits, for every sensor that is calibrated. There are no usual ones: state them all."""

    scale_deviation: Positive = Field(description="of a scale factor from 1, |k − 1|", json_schema_extra=RATIO)
    scale_std: Positive = Field(description="standard deviation of a scale factor", json_schema_extra=RATIO)
    bias_rad_s: Positive = Field(description="magnitude of a bias")
    bias_std_rad_s: Positive = Field(description="standard deviation of a bias")
    condition: Positive = Field(
        description="condition number of the equations: how well the sweeps tell the parameters apart",
        json_schema_extra=RATIO,
    )
    verification_rms_rad_s: Positive | None = Field(
        default=None,
        description="RMS of the calibrated reading less the reference's, sample by sample; a verification needs it",
    )
    verification_mean_rad_s: Positive | None = Field(
        default=None,
        description="the same difference averaged over each revolution, and the reference's from the arm; a "
        "verification needs it",
    )
    acceleration_scale_deviation: Positive | None = Field(
        default=None,
        description="of an accelerometer's scale factor from 1; a calibration of one needs it",
        json_schema_extra=RATIO,
    )
    acceleration_scale_std: Positive | None = Field(
        default=None, description="standard deviation of such a scale factor; needed too", json_schema_extra=RATIO
    )
    acceleration_bias_m_s2: Positive | None = Field(
        default=None, description="magnitude of an accelerometer's bias; needed too"
    )
    acceleration_bias_std_m_s2: Positive | None = Field(
        default=None, description="standard deviation of such a bias; needed too"
    )
    acceleration_verification_m_s2: Positive | None = Field(
        default=None,
        description="how far the size of a calibrated acceleration at rest may be from gravity's; needed with repeats",
    )
    bias_drift_rad_s: Positive | None = Field(
        default=None, description="change of a gyroscope's bias between any two repeats; `bias_drift` needs it"
    )
    acceleration_bias_drift_m_s2: Positive | None = Field(
        default=None, description="change of an accelerometer's bias between any two repeats; `bias_drift` needs it"
    )


class SiteSection(Section):
    """Where the arm stands. With latitude and heading the Earth's rate is taken out; the words are for certificates."""

    laboratory: Words | None = Field(default=None, description="the laboratory's name, for certificates")
    address: Words | None = Field(default=None, description="its address, in one line")
    country: Annotated[str, Field(pattern="^[A-Z]{2}$")] | None = Field(
        default=None,
        description="the country it is in, for digital certificates",
        json_schema_extra={"allowed": "two capital letters (ISO 3166-1)"},
    )
    place: Words | None = Field(default=None, description="where the arm stands, if not at that address: site, room")
    time_reference: Words | None = Field(
        default=None,
        description="what disciplines this computer's clock, such as `NTP, ptbtime1.ptb.de`; without it a certificate "
        "calls no time traceable",
    )
    ambient_temperature_c: float | None = Field(default=None, ge=-50, le=100, description="of the air, as you measured")
    ambient_humidity_percent: float | None = Field(
        default=None, ge=0, le=100, description="relative, of the air", json_schema_extra={"unit": "%"}
    )
    latitude_deg: float | None = Field(
        default=None,
        ge=-90,
        le=90,
        description="north is positive; with heading_deg, or alone where the Earth's rate is found",
    )
    heading_deg: float | None = Field(
        default=None,
        ge=-360,
        le=360,
        description="where the x axis of the arm's base points: 0 north, 90 east; with latitude_deg",
    )
    gravity_m_s2: float = Field(
        default=9.80665, gt=9.7, lt=9.9, description="acceleration of free fall", json_schema_extra={"unit": "m/s²"}
    )
    magnetic_field_ut: float | None = Field(
        default=None,
        ge=1,
        le=1000,
        description="size of the magnetic field where the magnetometer stands, as a reference there measured it: its "
        "scale factors are relative to it; without it a magnetometer is recorded, not calibrated",
    )
    magnetic_field_upwards: bool = Field(
        default=False, description="whether that field rises from the ground, as it does south of the magnetic equator"
    )
    base_up: Vector3 = Field(
        default=(0.0, 0.0, 1.0),
        description="upwards in the frame of the arm's base; 0 0 −1 under a ceiling",
        json_schema_extra=RATIO,
    )

    @field_validator("base_up")
    @classmethod
    def a_direction(cls, value: Vector3) -> Vector3:
        """Of any length."""
        if not np.linalg.norm(value) > 1e-6:
            raise ValueError("must be a direction, such as [0, 0, 1]")
        return value

    @model_validator(mode="after")
    def a_heading_has_a_latitude(self) -> Self:
        """The Earth's rate needs both where it is known."""
        if self.heading_deg is not None and self.latitude_deg is None:
            raise ValueError("needs latitude_deg and heading_deg, or neither")
        if self.heading_deg is not None and np.linalg.norm(np.cross(self.up, (1, 0, 0))) < MIN_LEVEL:
            raise ValueError("heading_deg says nothing where the x axis of the base points up or down")
        return self

    @property
    def up(self) -> Vector3:
        """Unit vector."""
        x, y, z = (np.array(self.base_up) / np.linalg.norm(self.base_up)).tolist()
        return x, y, z


class UncertaintySection(Section):
    """How far off may be what no recording shows. Half-widths: every value within is equally likely."""

    controller_clock_ppm: Positive = Field(
        default=50.0, description="the arm controller's clock, about which its maker says nothing"
    )
    computer_clock_ppm: Positive = Field(
        default=1.0, description="this computer's clock over a run, disciplined by a time server; 50 without one"
    )
    crystal_ppm: Positive = Field(default=20.0, description="the board's 32768 Hz crystal at room temperature")
    axis_deg: float = Field(
        default=0.06,
        ge=0,
        le=5,
        description="direction of each wrist's axis by the kinematics that are used: 1 mrad, as of calibrated arms of "
        "this size (Slamani, Nubiola and Bonev, 2012)",
    )
    repeatability_deg: float = Field(
        default=0.005,
        ge=0,
        le=5,
        description="how differently the arm stands when it comes back: 87 µrad, as of an arm of this size (Slamani, "
        "Nubiola and Bonev, 2012)",
    )
    sensor_offset_mm: float = Field(
        default=50.0, ge=0, le=1000, description="how far from the flange's axes the sensor sits, either way"
    )
    g_sensitivity_deg_s_g: float | None = Field(
        default=None,
        ge=0,
        description="change of a reading for 1 g, where attitudes do not tell it; left out, what is known of the part",
        json_schema_extra={"unit": "°/s/g"},
    )
    decision_rule: Literal["simple", "guard_band"] = Field(
        default="simple",
        description="what a limit is held against: `simple`, the value; `guard_band`, the value and its expanded "
        "uncertainty, so that at most one in forty is accepted wrongly",
    )


class CertificateSection(Section):
    """What a certificate says of the order and of who answers for it. Left out, it reads "not stated"."""

    customer: Words | None = Field(default=None, description="the customer's name")
    customer_address: Words | None = Field(default=None, description="the customer's address, in one line")
    received: date | None = Field(
        default=None, description="when the item was received", json_schema_extra={"allowed": "date, as 2026-11-20"}
    )
    condition: Words | None = Field(default=None, description="the item's condition, as received")
    authorised_by: Words | None = Field(
        default=None, description="who authorises the certificate; left out, there is a line to sign on"
    )
    replaces: Words | None = Field(
        default=None, description="the number of the certificate that this one amends and replaces"
    )
    issued: date | None = Field(
        default=None,
        description="when it is issued; left out, the day the result was computed",
        json_schema_extra={"allowed": "date, as 2026-11-20"},
    )


class OutputSection(Section):
    """Where results go."""

    folder: str = Field(
        default="runs", min_length=1, max_length=1000, description="where each run gets a folder of its own"
    )


class RigConfig(Section):
    """Everything the rig reads. It has no knowledge of whether the far end is simulated."""

    arm: ArmSection
    board: BoardSection | None = None
    sensors: dict[SensorName, SensorSection] = Field(min_length=1)
    magnetometers: dict[SensorName, MagnetometerSection] = Field(default={}, max_length=len(MAGNETOMETERS))
    procedure: ProcedureSection
    observation: ObservationSection = ObservationSection()
    site: SiteSection = SiteSection()
    uncertainty: UncertaintySection = UncertaintySection()
    limits: LimitsSection
    certificate: CertificateSection = CertificateSection()
    output: OutputSection = OutputSection()

    @field_validator("sensors")
    @classmethod
    def sensors_fit_together(cls, sensors: dict[str, SensorSection]) -> dict[str, SensorSection]:
        """The board has one place for each part, and a calibration one reference at most."""
        places: dict[str, str] = {}
        for name, sensor in sensors.items():
            if sensor.serial is not None:
                place, what = sensor.serial.port, f"at {sensor.serial.port}; a port is one sensor's"
            else:
                place, what = sensor.part, f"{sensor.part}; the board has one place for each part"
            if place in places:
                raise ValueError(f"{places[place]} and {name} are both {what}")
            places[place] = name
        references = [name for name, sensor in sensors.items() if sensor.role == "reference"]
        if len(references) > 1:
            raise ValueError(f"{' and '.join(references)} have role: reference; at most one sensor can")
        if len(references) == len(sensors):
            raise ValueError("at least one sensor must have role: calibrate")
        return sensors

    @field_validator("sensors")
    @classmethod
    def the_link_carries_them(cls, sensors: dict[str, SensorSection], info: ValidationInfo) -> dict[str, SensorSection]:
        """Rates for which the link is too slow would lose samples. Of what a sensor sends, the larger must fit."""
        streams = _streams(sensors)
        if "board" not in info.data or not streams:
            return sensors
        if info.data["board"] is None:
            raise ValueError(f"the board reads {' and '.join(streams)}, but there is no section board")
        _refuse_more_than_the_link_carries(info.data["board"], streams)
        return sensors

    @field_validator("magnetometers")
    @classmethod
    def magnetometers_fit_beside_them(
        cls, magnetometers: dict[str, MagnetometerSection], info: ValidationInfo
    ) -> dict[str, MagnetometerSection]:
        """A name stands for one sensor, and the link carries them too."""
        sensors = info.data.get("sensors", {})
        if both := sorted(sensors.keys() & magnetometers.keys()):
            raise ValueError(f"{', '.join(both)} is the name of one of the sensors already")
        if not magnetometers or not sensors or "board" not in info.data:
            return magnetometers
        if info.data["board"] is None:
            raise ValueError(f"the board reads {' and '.join(magnetometers)}, but there is no section board")
        fields = {name: Stream(m.rate_hz, calibrated=False, field=True) for name, m in magnetometers.items()}
        _refuse_more_than_the_link_carries(info.data["board"], _streams(sensors) | fields)
        return magnetometers

    @property
    def all_sensors(self) -> Mapping[str, SensorSection | MagnetometerSection]:
        """Every sensor by name, gyroscopes first."""
        return {**self.sensors, **self.magnetometers}

    @property
    def on_board(self) -> Mapping[str, SensorSection]:
        """The gyroscopes the board reads, by name; the others have a port of their own."""
        return {name: sensor for name, sensor in self.sensors.items() if sensor.on_board}

    @property
    def parts_on_board(self) -> Mapping[str, SensorSection | MagnetometerSection]:
        """All that the board reads, by name, gyroscopes first."""
        return {**self.on_board, **self.magnetometers}

    @property
    def to_calibrate(self) -> Mapping[str, SensorSection]:
        """The sensors a calibration is for, by name."""
        return {name: sensor for name, sensor in self.sensors.items() if sensor.role == "calibrate"}

    @property
    def reference(self) -> tuple[str, SensorSection] | None:
        """The sensor whose calibration is known, with its name, if there is one."""
        return next(((name, s) for name, s in self.sensors.items() if s.role == "reference"), None)


def _streams(sensors: Mapping[str, SensorSection]) -> dict[str, Stream]:
    return {
        name: Stream(s.rate_hz, calibrated=s.role == "calibrate", acceleration=s.acceleration is not None)
        for name, s in sensors.items()
        if s.on_board
    }


def _refuse_more_than_the_link_carries(board: BoardSection, streams: Mapping[str, Stream]) -> None:
    problem = over_budget(streams, board.baud)
    if problem is not None:
        raise ValueError(problem)
