"""The `world:` section: what the simulated laboratory simulates. Only the world uses the values given here."""

from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Annotated, Any

from pydantic import Field, model_validator

from rig.config.models import ArmSection, TurnerSection
from rig.config.procedures.hand_sections import HandSection
from rig.config.procedures.servo_section import ServoSection
from rig.config.procedures.stage_section import StageMountSection
from rig.config.ranges import ModelName
from rig.config.section import RATIO, JointAngle, Ratio, Section, SensorName, Vector3, WholeNumber
from rig.config.world.arm_clients import SimulatedFieldbusSection, SimulatedPoseLogSection
from rig.config.world.arm_joints import Cycles, JointsKind, SimulatedDriveSection, fill_in_joints
from rig.config.world.autopilot import SimulatedAutopilotSection
from rig.config.world.by_hand import SimulatedHandSection
from rig.config.world.faulty import SimulatedFaultySection
from rig.config.world.magnetism import (
    IronSection,
    MountingError,
    NonOrthogonality,
    RowLengths,
    SimulatedFieldSection,
    SimulatedMagnetometerSection,
)
from rig.config.world.printing_device import SimulatedLinesSection
from rig.config.world.servo import SimulatedServoSection
from rig.config.world.thermal import SimulatedThermalSection

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
RATE_PER_K_UNIT: dict[str, Any] = {"unit": "rad/s/K"}
PER_RATE_UNIT: dict[str, Any] = {"unit": "1/(rad/s)"}
JointRange = Annotated[float, Field(gt=0, le=363)]
JointRanges = tuple[JointRange, JointRange, JointRange, JointRange, JointRange, JointRange]
JointSpeed = Annotated[float, Field(gt=0, le=360)]
JointSpeeds = tuple[JointSpeed, JointSpeed, JointSpeed, JointSpeed, JointSpeed, JointSpeed]
VibrationFrequency = Annotated[float, Field(ge=0.1, le=200)]
StartAngles = tuple[JointAngle, JointAngle, JointAngle, JointAngle, JointAngle, JointAngle]
PartNumber = Annotated[str, Field(pattern=r"^[ -~]+$", max_length=40)]
Gradient = Annotated[float, Field(ge=-1000, le=1000)]


class WorldSiteSection(Section):
    """The site of the simulated laboratory, and the attitude of the arm's base in it."""

    latitude_deg: float | None = Field(
        default=None, ge=-90, le=90, description="geographic latitude; without it the Earth does not turn"
    )
    heading_deg: float = Field(
        default=0.0,
        ge=-360,
        le=360,
        description="direction of the base's x axis: from north, clockwise seen from above",
    )
    base_tilt_deg: tuple[Tilt, Tilt] = Field(
        default=(0.0, 0.0), description="how the base is tilted: about its x axis, then about its y axis"
    )
    gravity_m_s2: float = Field(default=9.80665, ge=0, le=20, description="acceleration of free fall")
    magnetic_field_ut: float = Field(
        default=48.0,
        ge=0,
        le=1000,
        description="magnitude of the magnetic field at the base's origin; the Earth's own is 22 to 67 (IGRF-13)",
    )
    magnetic_dip_deg: float = Field(
        default=65.0, ge=-90, le=90, description="angle of the field below the horizon; negative above it"
    )
    magnetic_declination_deg: float = Field(
        default=0.0,
        ge=-180,
        le=180,
        description="direction of the field's horizontal part: from north, clockwise seen from above",
    )
    magnetic_gradient_ut_m: tuple[Gradient, Gradient, Gradient, Gradient, Gradient] = Field(
        default=(0.0, 0.0, 0.0, 0.0, 0.0),
        description="gradient of the field, in the base's axes: ∂Bx/∂x, ∂Bx/∂y, ∂Bx/∂z, ∂By/∂y, "
        "∂By/∂z; the others follow from these if no current flows",
    )
    magnetic_drift_ut_min: tuple[Gradient, Gradient, Gradient] = Field(
        default=(0.0, 0.0, 0.0), description="change of the field with time, along the base's axes"
    )


class CalibrationSection(Section):
    """Deviations of the arm from its nominal geometry, measured by its maker. The controller reports and uses them."""

    delta_theta_rad: Joints = Field(default=NO_ANGLES, description="added to the angle of each joint")
    delta_a_mm: Lengths = Field(default=NO_LENGTHS, description="added to the nominal length a of each link")
    delta_d_mm: Lengths = Field(default=NO_LENGTHS, description="added to the nominal offset d of each link")
    delta_alpha_rad: Joints = Field(default=NO_ANGLES, description="added to the nominal twist alpha of each link")


class ResidueSection(Section):
    """Further errors of the arm, which its controller does not know."""

    twist_rad: Joints = Field(
        default=NO_ANGLES, description="true twist alpha of each link minus the one that the controller knows"
    )
    zero_rad: Joints = Field(
        default=NO_ANGLES,
        description="true angle of each joint minus the one that its encoder shows: attitude errors that repeat with "
        "the pose, up to 1 mrad on a calibrated arm (Slamani, Nubiola and Bonev, 2012) and up to 40 mrad on one "
        "whose joint zeros were never calibrated (a public data set with an ABB arm)",
    )
    encoder_once_rad: float = Field(
        default=0.0, ge=0, le=0.01, description="amplitude of each encoder's error with one period per turn"
    )
    encoder_twice_rad: float = Field(
        default=0.0, ge=0, le=0.01, description="amplitude of each encoder's error with two periods per turn"
    )
    hysteresis_rad: float = Field(
        default=0.0,
        ge=0,
        le=0.001,
        description="difference between a joint's angles when it arrives from one side and from the other",
    )


class SimulatedArmSection(Section):
    """The simulated arm. Its ripple is locked to the joint angle, so it is zero in the mean over whole turns."""

    joints: JointsKind = Field(
        default="measured",
        description="how its joints move and are read: as `measured` on real arms; `rough`, with a ripple ten times "
        "as large, in proportion to the speed, and encoders without noise; or `ideal`. It sets the defaults of "
        "`drive`, `vibration_fraction` and the three keys of the encoders",
    )
    model: ModelName | None = Field(
        default=None,
        description="which arm it is; a model other than `arm.model` is for tests of the refusal",
        json_schema_extra={"usual": "as `arm.model`"},
    )

    serial_number: str = Field(
        default="20265500123",
        pattern=r"^[0-9]+$",
        max_length=24,
        description="the serial number that the controller reports",
        json_schema_extra={"allowed": "at most 24 digits"},
    )
    polyscope: str | None = Field(
        default=None,
        pattern=r"^[0-9]{1,5}\.[0-9]{1,5}\.[0-9]{1,5}\.[0-9]{1,5}$",
        description="version of the controller's software; 10 and newer are PolyScope X",
        json_schema_extra={
            "allowed": "four numbers with dots between them",
            "usual": "`5.14.0.0`, of a `ur10_cb3` `3.15.8.0`",
        },
    )
    dashboard: bool = Field(
        default=True, description="whether it has a dashboard server; a PolyScope X has none in any case"
    )
    primary: bool = Field(
        default=True, description="whether the primary interface, which reports the model, is open in its settings"
    )
    joint_limits_deg: JointRanges | None = Field(
        default=None,
        description="how far its safety settings let each joint turn in either direction; if left out, as far as "
        "the joint can",
    )
    joint_speed_limits_deg_s: JointSpeeds | None = Field(
        default=None,
        description="how fast its safety settings let each joint turn; if left out, as fast as the joint can",
    )
    start_deg: StartAngles | None = Field(
        default=None,
        description="the joint angles when the world begins",
        json_schema_extra={"usual": "as `arm.home_deg`"},
    )
    remote_control: bool = Field(default=True, description="whether the pendant is switched to remote control")
    speed_slider: Ratio = Field(default=1.0, gt=0, le=1, description="the pendant's speed slider, as a fraction")
    tcp_rotation_deg: tuple[Turn, Turn, Turn] = Field(
        default=(0.0, 0.0, 0.0),
        description="rotation of the tool's frame relative to the flange's, as a rotation vector",
    )
    drive: SimulatedDriveSection = SimulatedDriveSection()
    vibration_fraction: float = Field(
        default=0.0,
        ge=0,
        lt=0.5,
        description="RMS of a further ripple of the rate, as a fraction of the rate",
        json_schema_extra={**RATIO, "usual": "`0.0`; of `joints: rough` `0.05`"},
    )
    vibration_cycles_per_turn: tuple[Cycles, ...] = Field(
        default=(18, 31, 50), max_length=100, description="periods of each part of that ripple in one turn"
    )
    encoder_step_rad: float | None = Field(
        default=None,
        ge=0,
        le=1,
        description="resolution of the joint angles it reports; in logs of a CB3 all angles are multiples of 2π/2¹⁹, "
        "those of the e-Series are finer",
        json_schema_extra={"usual": "2π/2²⁰; for a `ur10_cb3` 2π/2¹⁹; for `joints: rough` `6e-06`"},
    )
    encoder_noise_rad: float = Field(
        default=2.4e-5,
        ge=0,
        le=0.01,
        description="white noise of the joint angles it reports; 17 to 27 µrad were measured at rest",
        json_schema_extra={"usual": "`2.4e-05`; of `joints: rough` `0.0`"},
    )
    encoder_speed_noise_rad_s: float = Field(
        default=1.5e-3,
        ge=0,
        le=0.1,
        description="noise of the speeds it reports of joints that turn; 1.2 to 2.2 mrad/s were measured at low "
        "speeds, and none at rest",
        json_schema_extra={"usual": "`0.0015`; of `joints: rough` `0.0`"},
    )
    vibration_rms_rad_s: float = Field(
        default=0.0,
        ge=0,
        le=1,
        description="RMS of a vibration of each wrist that is not locked to the turn and that no encoder sees",
    )
    vibration_hz: VibrationFrequency = Field(default=10.0, description="its frequency")
    vibration_further_hz: tuple[VibrationFrequency, ...] = Field(
        default=(), max_length=20, description="further frequencies of it, each as strong as the first"
    )
    vibration_measured_rms_rad_s: float = Field(
        default=0.0,
        ge=0,
        le=1,
        description="RMS of a vibration of each wrist that is not locked to the turn either, but that encoders see",
    )
    vibration_measured_hz: float = Field(default=10.0, ge=0.1, le=200, description="its frequency")
    settling_rad: float = Field(
        default=0.0,
        ge=0,
        le=0.01,
        description="first amplitude of the oscillation of a joint that has just stopped; its encoder does not "
        "measure it",
    )
    settling_hz: float = Field(default=10.0, ge=0.1, le=200, description="frequency of that oscillation")
    settling_decay_s: float = Field(
        default=0.1, ge=0.001, le=10, description="time in which its amplitude falls to 1/e"
    )
    clock_ppm: float = Field(
        default=0.0, ge=-1000, le=1000, description="how much too fast the controller's clock runs, and with it the arm"
    )
    state_jitter_s: float = Field(
        default=0.0,
        ge=0,
        le=0.001,
        description="RMS of the time between a state's time stamp and the reading of the encoders",
    )
    fieldbus: SimulatedFieldbusSection | None = None
    log: SimulatedPoseLogSection | None = None
    calibration: CalibrationSection = CalibrationSection()
    iron: dict[SensorName, IronSection] = Field(default=dict[SensorName, IronSection](), max_length=20)
    unmodelled: ResidueSection = ResidueSection()

    @model_validator(mode="before")
    @classmethod
    def apply_kind_of_joints(cls, data: Any) -> Any:
        """Fill in the defaults of the kind of `joints`."""
        return fill_in_joints(data) if isinstance(data, Mapping) else data


class SimulatedBoardSection(Section):
    """The emulated board: its crystal, its memory and its time of power-up."""

    unique_id: str = Field(
        default="0123456789abcdef01234567",
        pattern=r"^[0-9a-f]{24}$",
        description="the microcontroller's own number",
        json_schema_extra={"allowed": "24 hexadecimal digits, small letters"},
    )
    crystal: bool = Field(
        default=True, description="whether its 32768 Hz crystal works; if it does, the board's clock follows it"
    )
    crystal_ppm: float = Field(
        default=12.0,
        ge=-25_000,
        le=25_000,
        description="how much too fast its clock runs; without its crystal it may be up to 2 % off",
    )
    boot_time_s: float = Field(default=0.137, ge=0, le=10, description="time from power-on to the start of the board")
    flash_file: Path | None = Field(
        default=None,
        description="file that keeps the board's flash from one run to the next; without it, the flash is empty "
        "in each run",
    )
    pty: bool = Field(default=False, description="also offer the serial port as a pseudo-terminal (POSIX)")


# For a gyroscope and for an accelerometer.
Bandwidth = Annotated[
    float | None,
    Field(
        ge=1,
        le=10_000,
        description="bandwidth of the sensor's own low-pass filter of first order; without it, there is no filter",
    ),
]
Delay = Annotated[
    float,
    Field(
        ge=0, le=50, description="delay of its readings, in addition to the filter's", json_schema_extra={"unit": "ms"}
    ),
]
ScalePerK = Annotated[
    Vector3,
    Field(description="relative change of each axis' scale factor with temperature", json_schema_extra={"unit": "1/K"}),
]
ScalePerK2 = Annotated[
    Vector3, Field(description="the same with the square of the temperature", json_schema_extra={"unit": "1/K²"})
]
BiasPerK = Annotated[Vector3, Field(description="change of b of each axis with temperature")]
BiasPerK2 = Annotated[Vector3, Field(description="change of b of each axis with the square of the temperature")]
Flicker = Annotated[float, Field(ge=0, le=0.1, description="flicker of the bias: the floor of its Allan deviation")]


class SimulatedAccelerometerSection(Section):
    """The truth of one accelerometer at the gyroscope's temperature. A specific force s reads a = F (s + φ s²) + b."""

    scale: RowLengths = (1.0, 1.0, 1.0)
    bias_m_s2: Vector3 = Field(default=NO_ROW, description="bias b of each axis, part of the reading")
    noise_m_s2: float = Field(default=0.01, ge=0, description="standard deviation of a sample's noise")
    non_orthogonality_deg: NonOrthogonality = NO_ROW
    second_order_s2_m: Vector3 = Field(default=NO_ROW, description="φ of each axis")
    bandwidth_hz: Bandwidth = None
    delay_ms: Delay = 0.0
    bias_m_s2_per_k: BiasPerK = NO_ROW
    scale_per_k: ScalePerK = NO_ROW
    bias_m_s2_per_k2: BiasPerK2 = NO_ROW
    scale_per_k2: ScalePerK2 = NO_ROW
    bias_hysteresis_m_s2: Vector3 = Field(
        default=NO_ROW, description="how much larger b of each axis is after warming, and smaller after cooling"
    )
    bias_instability_m_s2: Flicker = 0.0


class SimulatedKvhSection(Section):
    """The simulated KVH 1775 apart from its gyroscope: its clock, and the settings that its last user stored."""

    serial_number: str | None = Field(
        default=None,
        max_length=24,
        description="the serial number that it reports; if left out, the one that the configuration expects",
    )
    oscillator_ppm: float = Field(default=-8.0, ge=-1000, le=1000, description="how much too fast its clock runs")
    uptime_s: float = Field(
        default=3.0,
        ge=0,
        le=1e6,
        description="how long it has been on; its microseconds start again at zero after 4295 s",
    )
    settings: dict[str, str] = Field(
        default=dict[str, str](),
        description="settings that differ from those of delivery, in the words of its commands: `{DR: '250', "
        "OUTPUTFMT: B}`",
        json_schema_extra={"allowed": "settings of its commands", "usual": "`{}`"},
    )
    pty: bool = Field(default=False, description="also offer its port as a pseudo-terminal (POSIX)")


class SimulatedSensorSection(Section):
    """The truth of one simulated gyroscope, in the model g = K (m + b)."""

    scale: Vector3 = Field(description="scale factor of each axis, the diagonal of K", json_schema_extra=RATIO)
    bias_rad_s: Vector3 = Field(description="bias b of each axis")
    noise_rad_s: float = Field(default=0.035, ge=0, description="standard deviation of a sample's noise")
    mounting_error_deg: MountingError = NO_ROW
    non_orthogonality_deg: NonOrthogonality = NO_ROW
    temperature_c: float = Field(
        default=22.0,
        ge=-40,
        le=85,
        description="reading of its thermometer when it is warm; scale and bias are those at this temperature",
    )
    start_temperature_c: float | None = Field(
        default=None,
        ge=-40,
        le=85,
        description="reading of its thermometer when it is switched on; without it, the sensor is warm at once",
    )
    warm_up_s: float = Field(default=300.0, ge=1, le=100_000, description="time constant of its warm-up")
    bias_rad_s_per_k: BiasPerK = NO_ROW
    scale_per_k: ScalePerK = NO_ROW
    bias_rad_s_per_k2: BiasPerK2 = NO_ROW
    scale_per_k2: ScalePerK2 = NO_ROW
    bias_hysteresis_rad_s: Vector3 = Field(
        default=NO_ROW,
        description="how much larger b of each axis is after warming, and smaller after cooling, in `world.thermal`",
    )
    bias_instability_rad_s: Flicker = 0.0
    bias_instability_time_s: float = Field(
        default=100.0, ge=10, le=10_000, description="averaging time at which that minimum occurs"
    )
    bias_random_walk_rad_s_per_sqrt_s: float = Field(
        default=0.0,
        ge=0,
        le=0.1,
        description="random walk of the bias: the standard deviation of its change in one second",
    )
    g_sensitivity_rad_s_per_g: tuple[SensitivityRow, SensitivityRow, SensitivityRow] = Field(
        default=(NO_ROW, NO_ROW, NO_ROW),
        description="change of the readings x, y, z by a specific force along x, y, z: one row for each reading",
        json_schema_extra={"unit": "rad/s/g", "allowed": "3 rows of 3 numbers, each -0.1 to 0.1"},
    )
    offset_mm: Vector3 = Field(
        default=NO_ROW,
        description="position of the sensor, x y z from the flange's centre in the flange's frame; if left out, the "
        "end of `arm.extension_mm`",
    )
    nonlinearity_even_per_rad_s: float = Field(
        default=0.0, ge=-0.1, le=0.1, description="relative change of a reading with its rate"
    )
    nonlinearity_odd_per_rad_s: float = Field(
        default=0.0, ge=-0.1, le=0.1, description="relative change of a reading with the magnitude of its rate"
    )
    bandwidth_hz: Bandwidth = None
    delay_ms: Delay = 0.0
    data_rate_ppm: float = Field(
        default=0.0,
        ge=-100_000,
        le=100_000,
        description="for a part on the board: how much too fast its own oscillator makes its data rate",
    )
    accelerometer: SimulatedAccelerometerSection = Field(
        default=SimulatedAccelerometerSection(),
        description="the accelerometer of the same device, for a sensor with `acceleration`",
    )
    magnetometer: SimulatedFieldSection = Field(
        default=SimulatedFieldSection(),
        description="the magnetometer of the same device, for a `kvh1775` that sends format C",
    )
    kvh1775: SimulatedKvhSection | None = Field(
        default=None, description="for a `kvh1775`: the instrument that it is in"
    )
    autopilot: SimulatedAutopilotSection | None = Field(
        default=None,
        description="for a `mavlink`: the autopilot that it is in; for several at one port, the first one's is used",
    )
    lines: SimulatedLinesSection | None = Field(default=None, description="for `part: lines`: the device that it is in")
    faulty: SimulatedFaultySection = SimulatedFaultySection()


class SimulatedPartSection(Section):
    """A part of a series as it lies on the simulated operator's tray."""

    unique_id: str | None = Field(
        default=None,
        pattern=r"^[0-9a-f]{24}$",
        description="its microcontroller's own number; if left out, one that is made of its serial number",
        json_schema_extra={"allowed": "24 hexadecimal digits, small letters"},
    )
    plugged_in: bool = Field(
        default=True, description="whether its board is plugged in when it is mounted for the first time"
    )


class WorldSection(Section):
    """The simulated laboratory."""

    seed: WholeNumber = Field(
        default=1, ge=0, description="seed of all random numbers: the same seed gives the same run"
    )
    time_scale: Ratio = Field(
        default=1.0, gt=0, description="how many simulated seconds may pass in one real second, at most"
    )
    control_port: WholeNumber = Field(default=7322, ge=1, le=65535, description="TCP port on which tests cause faults")
    site: WorldSiteSection = WorldSiteSection()
    arm: SimulatedArmSection = SimulatedArmSection()
    hand: SimulatedHandSection = Field(
        default=SimulatedHandSection(), description="the simulated operator, where a hand turns the item"
    )
    servo: SimulatedServoSection = SimulatedServoSection()
    board: SimulatedBoardSection = SimulatedBoardSection()
    thermal: SimulatedThermalSection | None = Field(
        default=None,
        description="how warm board and parts are; without it, each sensor of the board warms up by itself",
    )
    sensors: dict[SensorName, SimulatedSensorSection] = Field(min_length=1)
    magnetometers: dict[SensorName, SimulatedMagnetometerSection] = Field(
        default=dict[SensorName, SimulatedMagnetometerSection]()
    )
    mounts: tuple[StageMountSection, ...] = Field(
        default=(),
        max_length=12,
        description="how the simulated operator truly mounts the item for each of `procedure.stages`",
    )
    tray: dict[PartNumber, SimulatedPartSection] = Field(
        default=dict[PartNumber, SimulatedPartSection](),
        max_length=10_000,
        description="peculiarities of parts of a series, by serial number",
    )

    def misfits(self, turner: TurnerSection) -> Iterator[str]:
        """Yield a line for every part of the section that contradicts the turner."""
        kinds: dict[str, type[TurnerSection]] = {"arm": ArmSection, "servo": ServoSection, "hand": HandSection}
        for name, kind in kinds.items():
            if getattr(self, name) != type(self).model_fields[name].default and not isinstance(turner, kind):
                yield f"world.{name}: there is none; another kind of turner turns the sensors"
        if isinstance(turner, ServoSection) and self.time_scale != 1.0:
            yield (
                f"world.time_scale: {self.time_scale:g}: must be 1 with a servo, because its driver measures time by "
                "this computer's clock"
            )
