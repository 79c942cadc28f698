"""The models of a configuration file.

Keys carry their units. Degrees occur only here, at the edge; the rig works in SI units. docs/configuration.md is made
of the keys' descriptions.
"""

from collections.abc import Iterable, Mapping
from typing import Any, Literal

from pydantic import Field, ValidationInfo, field_validator, model_validator

from rig.config.judging.judging_keys import ObservationSection, UncertaintySection
from rig.config.judging.judging_sections import CertificateSection, HistorySection, SiteSection
from rig.config.judging.station_section import StationSection
from rig.config.judging.verdict_limits import LimitsSection
from rig.config.ranges import PAYLOAD_RANGE_KG, SPEED_RANGE_DEG_S, ModelName
from rig.config.section import (
    AccelerometerOrder,
    JointAngle,
    Offset,
    Port,
    Section,
    SensorName,
    Vector3,
    WholeNumber,
    check_host,
)
from rig.config.sensors.link_budget import LinkLoad, over_budget
from rig.config.sensors.mavlink_section import autopilots_over_budget
from rig.config.sensors.sensor_catalogue import MAGNETOMETERS
from rig.config.sensors.sensor_sections import ConfiguredSensor, MagnetometerSection, SensorSection

HOME_POSES = "`[0, -90, 90, -90, -90, 0]`, of a `ur3e` `[0, -90, 90, -90, -60, 0]`"


class TurnerSection(Section):
    """The base class of all turners' sections, which share no key. A kind of turner adds its own keys."""

    @property
    def address(self) -> str:
        """The turner's address, a host or a port; empty if it needs no connection."""
        return ""

    @property
    def address_key(self) -> str:
        """The key in this section whose value is the address; empty if the turner needs no connection."""
        return ""

    @property
    def extension_m(self) -> Vector3:
        """The end of the extension that carries the sensors, x y z, m, in the frame of the body that turns."""
        return (0.0, 0.0, 0.0)

    @property
    def simulated_at(self) -> str | None:
        """The host of a simulated turner; None if this kind cannot be simulated."""
        return None

    def override_host(self, host: str) -> Mapping[str, str]:
        """Return the keys and values that move a simulated turner to another host."""
        return {}


class ArmSection(TurnerSection):
    """The robot arm and what it carries."""

    host: str = Field(min_length=1, max_length=253, description="name or address of the arm's controller")
    model: ModelName = Field(
        default="ur10e",
        description="which arm it is: its lengths, limits and free room are used, and its controller must agree; "
        "`ur10_cb3` is the UR10 of the CB3 series",
    )
    payload_kg: float = Field(
        ge=0,
        le=PAYLOAD_RANGE_KG,
        description="mass of all that the flange carries: fixture, board, cable; at most what the model can carry",
    )
    payload_centre_mm: tuple[Offset, Offset, Offset] = Field(
        default=(0.0, 0.0, 0.0), description="centre of mass of all this, x y z in the flange's frame"
    )
    extension_mm: tuple[Offset, Offset, Offset] = Field(
        default=(0.0, 0.0, 0.0),
        description="end of a non-magnetic extension on which the sensors are mounted, x y z in the flange's "
        "frame; the plan keeps it, and everything between it and the flange, away from the arm",
    )
    home_deg: tuple[JointAngle, JointAngle, JointAngle, JointAngle, JointAngle, JointAngle] | None = Field(
        default=None,
        description="joint angles, base to wrist 3, of the home pose, around which the wrists turn; wrist 2 must be "
        "near ±90°, so that the axes of the three wrists point in three different directions",
        json_schema_extra={"usual": HOME_POSES},
    )
    transfer_speed_deg_s: float = Field(
        default=120.0, ge=0.1, le=SPEED_RANGE_DEG_S, description="speed of the movements between sweeps"
    )
    state_rate_hz: float = Field(
        default=125.0,
        ge=125,
        le=500,
        description="how many states the arm sends per second; a `ur10_cb3` sends 125 at most",
    )
    robot_api_port: WholeNumber = Field(
        default=80,
        ge=1,
        le=65535,
        description="TCP port of a PolyScope X's Robot API; a simulator may use another",
    )
    kinematics: Literal["controller", "nominal"] = Field(
        default="controller",
        description="source of the arm's geometry: `controller`, as the factory measured this arm; "
        "`nominal`, the same for every arm of its model (the controller must still say that it drives one)",
    )

    @field_validator("host")
    @classmethod
    def check_looked_up_name(cls, value: str) -> str:
        """Refuse a name that no name server can resolve."""
        return check_host(value)

    @property
    def address(self) -> str:
        """The controller's name or address."""
        return self.host

    @property
    def address_key(self) -> str:
        """The key in this section whose value is the address."""
        return "host"

    @property
    def simulated_at(self) -> str | None:
        """The host of the simulated controller."""
        return self.host

    def override_host(self, host: str) -> Mapping[str, str]:
        """Return the section's key of the controller's host, with the new value `host`."""
        return {"host": host}

    @property
    def extension_m(self) -> Vector3:
        """The end of the extension, x y z in the flange's frame, m."""
        x, y, z = (length_mm / 1000 for length_mm in self.extension_mm)
        return x, y, z


class BoardSection(Section):
    """The microcontroller board. Leave it out if every sensor has a port of its own."""

    port: Port = Field(
        min_length=1,
        max_length=255,
        description="serial port, such as `/dev/ttyACM0` or `COM3`, or `socket://host:port`",
    )
    baud: Literal[115200, 230400, 460800, 921600] = Field(default=921600, description="speed of the serial line")


class ProcedureSection(Section):
    """The base class of all procedures' sections. A procedure adds its own keys and states what else it needs."""

    name: str = Field(description="which procedure is run")

    @model_validator(mode="before")
    @classmethod
    def refuse_meaningless_stages(cls, data: Any) -> Any:
        """Refuse `stages` for attitudes and verifications, which have one mounting."""
        if isinstance(data, dict) and "stages" in data and "stages" not in cls.model_fields:
            raise ValueError(
                "stages belong to six_observation and servo_six_observation, which calibrate gyroscopes: "
                "accelerometers and magnetometers are turned against gravity and field in one mounting, and a "
                "verification repeats one movement; leave out stages, or use six_observation"
            )
        return data

    @property
    def then_verify(self) -> bool:
        """Whether a passed calibration is stored on the board and verified by repeating the movement."""
        return False

    @property
    def needs_reference(self) -> bool:
        """Whether calibrated readings are compared with those of a reference."""
        return self.then_verify

    @property
    def accelerometer_order(self) -> AccelerometerOrder:
        """The order of the accelerometer's model that the attitudes must determine; 0 without a model."""
        return 0

    @property
    def finds_earth_rate(self) -> bool:
        """Whether the Earth's rate is estimated from the readings; otherwise the site states it, or it is unknown."""
        return False

    def problems(self, config: "RigConfig") -> Iterable[str]:
        """Yield a line for every part of the configuration that does not fit this procedure."""
        return ()


class OutputSection(Section):
    """The output of results."""

    folder: str = Field(
        default="runs", min_length=1, max_length=1000, description="folder that contains a folder for each run"
    )


class StatementConfig(Section):
    """The sections on a laboratory and a customer's order."""

    site: SiteSection = SiteSection()
    certificate: CertificateSection = CertificateSection()


class SensorsConfig(Section):
    """The part of a configuration that reading sensors needs; sections about turning and judging may be left out."""

    turner: Any = None
    board: BoardSection | None = None
    sensors: dict[SensorName, SensorSection] = Field(min_length=1)
    magnetometers: dict[SensorName, MagnetometerSection] = Field(
        default=dict[SensorName, MagnetometerSection](), max_length=len(MAGNETOMETERS)
    )
    procedure: Any = None
    observation: ObservationSection = ObservationSection()
    site: SiteSection = SiteSection()
    uncertainty: UncertaintySection = UncertaintySection()
    limits: LimitsSection | None = None
    certificate: CertificateSection = CertificateSection()
    history: HistorySection = HistorySection()
    output: OutputSection = OutputSection()
    station: StationSection = StationSection()

    @property
    def ports(self) -> dict[str, str]:
        """The ports of board and sensors, by their keys in the file."""
        ports = {f"sensors.{name}.{s.own_port[0]}": s.own_port[1] for name, s in self.sensors.items() if s.own_port}
        return ports if self.board is None else {"board.port": self.board.port} | ports

    @field_validator("sensors")
    @classmethod
    def match_sensors(cls, sensors: dict[str, SensorSection]) -> dict[str, SensorSection]:
        """Refuse sensors that share a source or a name, an overloaded port, and more than one reference.

        The source of a sensor is its part on the board, its own port, or an IMU of an autopilot. Also refuse sensors
        of which none is to be calibrated.
        """
        sensor_at: dict[str, str] = {}
        for name, sensor in sensors.items():
            if sensor.mavlink is not None:
                source, what = f"{sensor.mavlink.port} {sensor.mavlink.instance}", f"IMU {sensor.mavlink.instance}"
                what += f" of the autopilot at {sensor.mavlink.port}"
            elif sensor.own_port is not None:
                _, source = sensor.own_port
                what = f"at {source}; a port can serve one sensor only"
            else:
                source, what = sensor.part, f"{sensor.part}; the board has one place for each part"
            if source in sensor_at:
                raise ValueError(f"{sensor_at[source]} and {name} are both {what}")
            sensor_at[source] = name
        bundled = _device_sensor_names(sensors)
        if both := sorted({name for name in bundled if name in sensors or bundled.count(name) > 1}):
            raise ValueError(f"{', '.join(both)} is already the name of a sensor at another sensor's port")
        if problem := autopilots_over_budget({name: (s.mavlink, s.rate_hz) for name, s in sensors.items()}):
            raise ValueError(problem)
        references = [name for name, sensor in sensors.items() if sensor.role == "reference"]
        if len(references) > 1:
            raise ValueError(f"{' and '.join(references)} have role: reference; at most one sensor can")
        if len(references) == len(sensors):
            raise ValueError("at least one sensor must have role: calibrate")
        return sensors

    @field_validator("sensors")
    @classmethod
    def check_link_rate(cls, sensors: dict[str, SensorSection], info: ValidationInfo) -> dict[str, SensorSection]:
        """Refuse sensors on a missing board, and data rates beyond the link's capacity.

        The board sends raw readings of a sensor to calibrate, and later corrected ones; the larger messages count.
        """
        streams = _streams(sensors)
        if "board" not in info.data or not streams:
            return sensors
        if info.data["board"] is None:
            raise ValueError(f"the board reads {' and '.join(streams)}, but there is no section board")
        _refuse_more_than_the_link_carries(info.data["board"], streams)
        return sensors

    @field_validator("magnetometers")
    @classmethod
    def match_magnetometers(
        cls, magnetometers: dict[str, MagnetometerSection], info: ValidationInfo
    ) -> dict[str, MagnetometerSection]:
        """Refuse a magnetometer with a sensor's name or without a board, and rates that exceed the link's capacity."""
        sensors = info.data.get("sensors", {})
        if both := sorted({*sensors, *_device_sensor_names(sensors)} & magnetometers.keys()):
            raise ValueError(f"{', '.join(both)} is the name of one of the sensors already")
        if not magnetometers or not sensors or "board" not in info.data:
            return magnetometers
        if info.data["board"] is None:
            raise ValueError(f"the board reads {' and '.join(magnetometers)}, but there is no section board")
        fields = {name: LinkLoad(m.rate_hz, calibrated=False, field=True) for name, m in magnetometers.items()}
        _refuse_more_than_the_link_carries(info.data["board"], _streams(sensors) | fields)
        return magnetometers

    @property
    def all_sensors(self) -> Mapping[str, ConfiguredSensor]:
        """Every sensor by name, gyroscopes first."""
        return {**self.sensors, **self.magnetometers}

    @property
    def on_board(self) -> Mapping[str, SensorSection]:
        """The gyroscopes that the board reads, by name; others have a port of their own."""
        return {name: sensor for name, sensor in self.sensors.items() if sensor.on_board}

    @property
    def parts_on_board(self) -> Mapping[str, ConfiguredSensor]:
        """All sensors that the board reads, by name, gyroscopes first."""
        return {**self.on_board, **self.magnetometers}

    @property
    def to_calibrate(self) -> Mapping[str, SensorSection]:
        """The sensors to calibrate, by name."""
        return {name: sensor for name, sensor in self.sensors.items() if sensor.role == "calibrate"}

    @property
    def reference(self) -> tuple[str, SensorSection] | None:
        """The name and the section of the reference sensor, whose calibration is stated; None without a reference."""
        return next(((name, s) for name, s in self.sensors.items() if s.role == "reference"), None)


class RigConfig(SensorsConfig):
    """The complete configuration of a rig, without the `world:` section of a simulated laboratory.

    `turner` turns the sensors. A file states it under `turner`, with its kind, or under `arm` if it is an arm.
    """

    turner: TurnerSection
    procedure: ProcedureSection
    limits: LimitsSection

    @property
    def arm(self) -> ArmSection:
        """The robot arm that turns the sensors. Raise TypeError if another turner does."""
        if not isinstance(self.turner, ArmSection):
            raise TypeError(f"no arm turns the sensors: the configuration has a {type(self.turner).__name__}")
        return self.turner


def _device_sensor_names(sensors: Mapping[str, SensorSection]) -> list[str]:
    """Return the names of the sensors that the devices of `sensors` contain in addition to gyroscopes.

    These are magnetometers, and sensors of quantities without axes.
    """
    return [bundled for name, sensor in sensors.items() for bundled in sensor.brings(name)]


def _streams(sensors: Mapping[str, SensorSection]) -> dict[str, LinkLoad]:
    return {
        name: LinkLoad(s.rate_hz, calibrated=s.role == "calibrate", acceleration=s.acceleration is not None)
        for name, s in sensors.items()
        if s.on_board
    }


def _refuse_more_than_the_link_carries(board: BoardSection, streams: Mapping[str, LinkLoad]) -> None:
    problem = over_budget(streams, board.baud)
    if problem is not None:
        raise ValueError(problem)
