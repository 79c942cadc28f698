"""The `world:` section: what the simulated laboratory simulates. Only the world uses the values given here."""

from pathlib import Path
from typing import Annotated, Any, Literal

from pydantic import Field

from rig.config.section import RATIO, Section, SensorName, Vector3
from rig.config.world_magnetism import IronSection, SimulatedFieldSection, SimulatedMagnetometerSection

Joint = Annotated[float, Field(ge=-0.1, le=0.1)]
Joints = tuple[Joint, Joint, Joint, Joint, Joint, Joint]
Length = Annotated[float, Field(ge=-50, le=50)]
Lengths = tuple[Length, Length, Length, Length, Length, Length]
NO_LENGTHS: Lengths = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
NO_ANGLES: Joints = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
Sensitivity = Annotated[float, Field(ge=-0.1, le=0.1)]
SensitivityRow = tuple[Sensitivity, Sensitivity, Sensitivity]
NO_ROW: SensitivityRow = (0.0, 0.0, 0.0)
Tilt = Annotated[float, Field(ge=-10, le=10)]
Turn = Annotated[float, Field(ge=-180, le=180)]
RATE_PER_K: dict[str, Any] = {"unit": "rad/s/K"}
PER_RATE: dict[str, Any] = {"unit": "1/(rad/s)"}
JointRange = Annotated[float, Field(gt=0, le=363)]
JointRanges = tuple[JointRange, JointRange, JointRange, JointRange, JointRange, JointRange]
JointSpeed = Annotated[float, Field(gt=0, le=360)]
JointSpeeds = tuple[JointSpeed, JointSpeed, JointSpeed, JointSpeed, JointSpeed, JointSpeed]
Cycles = Annotated[int, Field(ge=1, le=200)]
Gradient = Annotated[float, Field(ge=-1000, le=1000)]


class SiteSection(Section):
    """Where the laboratory stands, and how the arm's base stands in it."""

    latitude_deg: float | None = Field(
        default=None, ge=-90, le=90, description="geographic latitude; without it the Earth does not turn"
    )
    heading_deg: float = Field(
        default=0.0,
        ge=-360,
        le=360,
        description="where the base's x axis points: from north, clockwise seen from above",
    )
    base_tilt_deg: tuple[Tilt, Tilt] = Field(
        default=(0.0, 0.0), description="how the base is tilted: about its x axis, then about its y axis"
    )
    gravity_m_s2: float = Field(
        default=9.80665, ge=0, le=20, description="acceleration of free fall", json_schema_extra={"unit": "m/s²"}
    )
    magnetic_field_ut: float = Field(
        default=48.0,
        ge=0,
        le=1000,
        description="size of the magnetic field at the base's origin; the Earth's own is 22 to 67 (IGRF-13)",
    )
    magnetic_dip_deg: float = Field(
        default=65.0, ge=-90, le=90, description="how far it points below the horizon; above it where negative"
    )
    magnetic_declination_deg: float = Field(
        default=0.0, ge=-180, le=180, description="where its horizontal part points: from north, clockwise from above"
    )
    magnetic_gradient_ut_m: tuple[Gradient, Gradient, Gradient, Gradient, Gradient] = Field(
        default=(0.0, 0.0, 0.0, 0.0, 0.0),
        description="how it changes with place, in the base's axes: ∂Bx/∂x, ∂Bx/∂y, ∂Bx/∂z, ∂By/∂y, ∂By/∂z; the others "
        "follow where no current flows",
        json_schema_extra={"unit": "µT/m"},
    )
    magnetic_drift_ut_min: tuple[Gradient, Gradient, Gradient] = Field(
        default=(0.0, 0.0, 0.0),
        description="how it changes with time, along the base's axes",
        json_schema_extra={"unit": "µT/min"},
    )


class CalibrationSection(Section):
    """How the arm differs from its drawing as its maker measured it: the controller reports it and reckons with it."""

    delta_theta_rad: Joints = Field(default=NO_ANGLES, description="each joint's angle more than it says")
    delta_a_mm: Lengths = Field(default=NO_LENGTHS, description="each link's length a more than the drawing's")
    delta_d_mm: Lengths = Field(default=NO_LENGTHS, description="each link's offset d more than the drawing's")
    delta_alpha_rad: Joints = Field(default=NO_ANGLES, description="each link's twist alpha more than the drawing's")


class ResidueSection(Section):
    """What is wrong with the arm beyond that, and its controller does not know."""

    twist_rad: Joints = Field(default=NO_ANGLES, description="each link's twist alpha more than the controller thinks")
    zero_rad: Joints = Field(default=NO_ANGLES, description="each joint's angle more than its encoder says")
    encoder_once_rad: float = Field(
        default=0.0, ge=0, le=0.01, description="amplitude of each encoder's error that comes once a turn"
    )
    encoder_twice_rad: float = Field(
        default=0.0, ge=0, le=0.01, description="the same of that which comes twice a turn"
    )
    hysteresis_rad: float = Field(
        default=0.0, ge=0, le=0.001, description="between a joint's angles when it comes from either side"
    )


class SimulatedArmSection(Section):
    """The simulated UR10e. Its ripple is locked to the joint angle: it integrates to nothing over whole turns."""

    model: Literal["ur10e", "ur5e", "ur20", "ur10"] = Field(
        default="ur10e", description="which arm its controller says it is; another than a UR10e is there to be refused"
    )

    serial_number: str = Field(
        default="20265500123",
        pattern=r"^[0-9]+$",
        max_length=24,
        description="what the controller says its number is",
        json_schema_extra={"allowed": "at most 24 digits"},
    )
    polyscope: str = Field(
        default="5.14.0.0",
        pattern=r"^[0-9]{1,5}\.[0-9]{1,5}\.[0-9]{1,5}\.[0-9]{1,5}$",
        description="version of the controller's software",
        json_schema_extra={"allowed": "four numbers with dots between them"},
    )
    dashboard: bool = Field(default=True, description="whether it has a dashboard server; a PolyScope X has none")
    primary: bool = Field(
        default=True, description="whether the primary interface, which tells the model, is open in its settings"
    )
    joint_limits_deg: JointRanges | None = Field(
        default=None,
        description="how far its safety settings let each joint turn either way; without it, as far as it can",
    )
    joint_speed_limits_deg_s: JointSpeeds | None = Field(
        default=None, description="how fast its safety settings let each joint turn; without it, as fast as it can"
    )
    remote_control: bool = Field(default=True, description="whether the pendant is switched to remote control")
    speed_slider: float = Field(
        default=1.0, gt=0, le=1, description="the pendant's speed slider, as a fraction", json_schema_extra=RATIO
    )
    tcp_rotation_deg: tuple[Turn, Turn, Turn] = Field(
        default=(0.0, 0.0, 0.0), description="rotation vector by which the tool's frame is turned in the flange's"
    )
    vibration_fraction: float = Field(
        default=0.05, ge=0, lt=0.5, description="RMS of the rate's ripple over the rate", json_schema_extra=RATIO
    )
    vibration_cycles_per_turn: tuple[Cycles, ...] = Field(
        default=(18, 31, 50), max_length=100, description="how often each part of the ripple comes in one turn"
    )
    encoder_step_rad: float = Field(default=6.0e-6, ge=0, le=1, description="resolution of the joint angles it reports")
    vibration_rms_rad_s: float = Field(
        default=0.0,
        ge=0,
        le=1,
        description="RMS of a vibration of each wrist that nothing is locked to and no encoder sees",
    )
    vibration_hz: float = Field(default=10.0, ge=0.1, le=200, description="its frequency")
    vibration_seen_rms_rad_s: float = Field(
        default=0.0,
        ge=0,
        le=1,
        description="RMS of a vibration of each wrist that nothing is locked to either, and that encoders see",
    )
    vibration_seen_hz: float = Field(default=10.0, ge=0.1, le=200, description="its frequency")
    settling_rad: float = Field(
        default=0.0,
        ge=0,
        le=0.01,
        description="amplitude with which a joint that stopped swings out, unseen by its encoder",
    )
    settling_hz: float = Field(default=10.0, ge=0.1, le=200, description="frequency of that swing")
    settling_decay_s: float = Field(default=0.1, ge=0.001, le=10, description="time in which it falls to 1/e")
    clock_ppm: float = Field(
        default=0.0, ge=-1000, le=1000, description="how much too fast the controller's clock runs, and with it the arm"
    )
    state_jitter_s: float = Field(
        default=0.0, ge=0, le=0.001, description="RMS of the time between a state's stamp and the look at the encoders"
    )
    calibration: CalibrationSection = CalibrationSection()
    iron: dict[SensorName, IronSection] = Field(default={}, max_length=20)
    residue: ResidueSection = ResidueSection()


class SimulatedBoardSection(Section):
    """The emulated board: its crystal, its memory and its moment of power-up."""

    unique_id: str = Field(
        default="0123456789abcdef01234567",
        pattern=r"^[0-9a-f]{24}$",
        description="the microcontroller's own number",
        json_schema_extra={"allowed": "24 hexadecimal digits, small letters"},
    )
    crystal: bool = Field(default=True, description="whether its 32768 Hz crystal swings, which its clock then follows")
    crystal_ppm: float = Field(
        default=12.0,
        ge=-25_000,
        le=25_000,
        description="how much too fast its clock runs; without its crystal up to 2 % off",
    )
    boot_time_s: float = Field(default=0.137, ge=0, le=10, description="how long after it gets power the board starts")
    flash_file: Path | None = Field(
        default=None,
        description="file that keeps the board's flash from one run to the next; without it, it is fresh each time",
    )
    pty: bool = Field(default=False, description="also offer the serial port as a pseudo-terminal (POSIX)")


# Of a gyroscope and an accelerometer alike.
Bandwidth = Annotated[
    float | None, Field(ge=1, le=10_000, description="of its own low-pass of first order; without it, it has none")
]
Delay = Annotated[
    float,
    Field(ge=0, le=50, description="by how much its readings are late beside that", json_schema_extra={"unit": "ms"}),
]
ScalePerK = Annotated[
    Vector3,
    Field(
        description="by which fraction the scale factor of each axis grows with temperature",
        json_schema_extra={"unit": "1/K"},
    ),
]


class SimulatedAccelerometerSection(Section):
    """The truth of one accelerometer, a = F (s + φ s²) + b of the specific force s; as warm as its gyroscope."""

    scale: Vector3 = Field(
        default=(1.0, 1.0, 1.0),
        description="scale factor of each axis: what the length of a row of F is 1 over",
        json_schema_extra=RATIO,
    )
    bias_m_s2: Vector3 = Field(default=NO_ROW, description="bias b of each axis, part of the reading")
    noise_m_s2: float = Field(default=0.01, ge=0, description="standard deviation of a sample's noise")
    non_orthogonality_deg: Vector3 = Field(
        default=NO_ROW, description="by how much the angles between its axes x y, x z, y z are off 90°"
    )
    second_order_s2_m: Vector3 = Field(default=NO_ROW, description="φ of each axis", json_schema_extra={"unit": "s²/m"})
    bandwidth_hz: Bandwidth = None
    delay_ms: Delay = 0.0
    bias_m_s2_per_k: Vector3 = Field(
        default=NO_ROW,
        description="by how much b of each axis grows with temperature",
        json_schema_extra={"unit": "m/s²/K"},
    )
    scale_per_k: ScalePerK = NO_ROW
    bias_instability_m_s2: float = Field(
        default=0.0, ge=0, le=0.1, description="flicker of the bias: the floor of its Allan deviation"
    )


class SimulatedKvhSection(Section):
    """The simulated KVH 1775 around its gyroscope: its clock, and what its last user left in its memory."""

    serial_number: str | None = Field(
        default=None, max_length=24, description="what it says its number is; left out, what the configuration expects"
    )
    oscillator_ppm: float = Field(default=-8.0, ge=-1000, le=1000, description="how much too fast its clock runs")
    on_for_s: float = Field(
        default=3.0, ge=0, le=1e6, description="how long it has been on; its microseconds wrap after 4295 s"
    )
    settings: dict[str, str] = Field(
        default={},
        description="what is not as its maker delivers it, as its commands have it: `{DR: '250', OUTPUTFMT: B}`",
        json_schema_extra={"allowed": "settings of its commands", "usual": "`{}`"},
    )
    pty: bool = Field(default=False, description="also offer its port as a pseudo-terminal (POSIX)")


class SimulatedSensorSection(Section):
    """The truth of one simulated gyroscope, in the model g = K (m + b)."""

    scale: Vector3 = Field(description="scale factor of each axis, the diagonal of K", json_schema_extra=RATIO)
    bias_rad_s: Vector3 = Field(description="bias b of each axis")
    noise_rad_s: float = Field(default=0.035, ge=0, description="standard deviation of a sample's noise")
    mounting_error_deg: Vector3 = Field(
        default=(0.0, 0.0, 0.0), description="rotation vector by which it sits off its nominal mounting"
    )
    non_orthogonality_deg: Vector3 = Field(
        default=(0.0, 0.0, 0.0), description="by how much the angles between its axes x y, x z, y z are off 90°"
    )
    temperature_c: float = Field(
        default=22.0, ge=-40, le=85, description="what its thermometer says once warm; scale and bias are those of then"
    )
    start_temperature_c: float | None = Field(
        default=None, ge=-40, le=85, description="the same when it gets power; without it, it is warm at once"
    )
    warm_up_s: float = Field(default=300.0, ge=1, le=100_000, description="time constant of its warming")
    bias_rad_s_per_k: Vector3 = Field(
        default=NO_ROW, description="by how much b of each axis grows with temperature", json_schema_extra=RATE_PER_K
    )
    scale_per_k: ScalePerK = NO_ROW
    bias_instability_rad_s: float = Field(
        default=0.0, ge=0, le=0.1, description="flicker of the bias: the floor of its Allan deviation"
    )
    bias_instability_time_s: float = Field(
        default=100.0, ge=10, le=10_000, description="averaging time around which that floor lies"
    )
    bias_random_walk_rad_s_per_sqrt_s: float = Field(
        default=0.0,
        ge=0,
        le=0.1,
        description="random walk of the bias: the standard deviation of what a second adds",
        json_schema_extra={"unit": "rad/s/√s"},
    )
    g_sensitivity_rad_s_per_g: tuple[SensitivityRow, SensitivityRow, SensitivityRow] = Field(
        default=(NO_ROW, NO_ROW, NO_ROW),
        description="what a reading of x, y, z gains by specific force along x, y, z: a row for each reading",
        json_schema_extra={"unit": "rad/s/g", "allowed": "3 rows of 3 numbers, each -0.1 to 0.1"},
    )
    offset_mm: Vector3 = Field(
        default=NO_ROW,
        description="where it sits, x y z from the flange's centre in the flange's frame; left out, at the end of "
        "`arm.extension_mm`",
    )
    nonlinearity_even_per_rad_s: float = Field(
        default=0.0,
        ge=-0.1,
        le=0.1,
        description="by which fraction a reading grows with its rate",
        json_schema_extra=PER_RATE,
    )
    nonlinearity_odd_per_rad_s: float = Field(
        default=0.0,
        ge=-0.1,
        le=0.1,
        description="by which fraction a reading grows with its rate's magnitude",
        json_schema_extra=PER_RATE,
    )
    bandwidth_hz: Bandwidth = None
    delay_ms: Delay = 0.0
    accelerometer: SimulatedAccelerometerSection = Field(
        default=SimulatedAccelerometerSection(),
        description="the accelerometer beside it, of a sensor that has `acceleration`",
    )
    magnetometer: SimulatedFieldSection = Field(
        default=SimulatedFieldSection(), description="the magnetometer beside it, of a `kvh1775` that sends format C"
    )
    kvh1775: SimulatedKvhSection | None = Field(default=None, description="the instrument it is in, of a `kvh1775`")


class WorldSection(Section):
    """The simulated laboratory."""

    seed: int = Field(
        default=1, ge=0, description="of all that is random: the same seed, the same run", json_schema_extra=RATIO
    )
    time_scale: float = Field(
        default=1.0, gt=0, description="at most so many simulated seconds in a second", json_schema_extra=RATIO
    )
    control_port: int = Field(
        default=7322, ge=1, le=65535, description="TCP port on which tests cause faults", json_schema_extra=RATIO
    )
    site: SiteSection = SiteSection()
    arm: SimulatedArmSection = SimulatedArmSection()
    board: SimulatedBoardSection = SimulatedBoardSection()
    sensors: dict[SensorName, SimulatedSensorSection] = Field(min_length=1)
    magnetometers: dict[SensorName, SimulatedMagnetometerSection] = Field(default={})
