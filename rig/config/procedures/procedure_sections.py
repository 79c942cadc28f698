"""The `procedure:` section of each stock procedure. Other procedures bring a section like these."""

from collections.abc import Iterator, Mapping
from types import MappingProxyType
from typing import Annotated, Any, Literal, Self, get_args

import numpy as np
from pydantic import BeforeValidator, Field, field_validator, model_validator

from rig.config.models import ProcedureSection, RigConfig
from rig.config.procedures.attitude_sets import ATTITUDE_SETS
from rig.config.procedures.hand_sections import ByHandSection
from rig.config.procedures.servo_procedure import RANGE_RATIO, ServoSixObservationSection
from rig.config.procedures.stage_section import StageSection, Wrist
from rig.config.ranges import ACCELERATION_RANGE_DEG_S2, SPEED_RANGE_DEG_S
from rig.config.section import (
    DEFAULT_REST_S,
    RATIO,
    AccelerometerOrder,
    Direction,
    JointAngle,
    Ratio,
    Vector3,
    WholeNumber,
)

# At a lower speed the board cannot store a sweep's readings.
Speed = Annotated[float, Field(ge=0.5, le=SPEED_RANGE_DEG_S)]
SweptAxes = Annotated[
    Literal[3, 6],
    Field(
        description="how many axes are swept: `3`, one for each wrist; `6`, also three more of wrist 1 with "
        "wrists 2 and 3 turned, which separates the sensor's own angles from the arm's",
        json_schema_extra=RATIO,
    ),
]
Repeats = Annotated[WholeNumber, Field(ge=1, le=100, description="how many times the whole procedure is done")]
DwellTime = Annotated[float, Field(ge=0.1, le=3600, description="time at rest in each attitude")]
DEFAULT_PROCEDURE = "six_observation"
MAX_SWEEP_S = 720  # one revolution at the lowest speed
MAX_HEATED_C = 65.0  # below the part's limit, because the heater overshoots the range a little
# Required by polynomials: equals that of `rig.estimation.temperature.over_temperature`, which the world must not import
# through a section.
MIN_RANGE_C = 10.0


class SixSweepsSection(ProcedureSection):
    """The movement of SIX, Section III: which wrists, in what order, how fast, how often."""

    axes: SweptAxes = 3
    order: tuple[Wrist, ...] | None = Field(
        default=None,
        min_length=1,
        description="order in which the wrists turn, each once; if left out, the order in which a steady drift of "
        "the bias causes the smallest error",
    )
    directions: tuple[Direction, ...] | None = Field(
        default=None,
        min_length=1,
        description="direction in which each wrist turns first, and then second; if left out, the directions in "
        "which a steady drift of the bias causes the smallest error",
    )
    repeats: Repeats = 1
    speed_deg_s: Speed = Field(
        default=60.0,
        description=f"constant speed of a sweep; every sensor's range must be at least {RANGE_RATIO} times as large",
    )
    speeds_deg_s: tuple[Speed, ...] | None = Field(
        default=None,
        min_length=1,
        max_length=8,
        description="several speeds in place of `speed_deg_s`: every sweep is made at each speed, which shows the "
        "nonlinearity of the sensor",
    )
    arc_deg: float = Field(
        default=360.0,
        ge=30,
        le=3600,
        description="angle of a sweep at constant speed, centred on `arm.home_deg`; 360 and its multiples are whole "
        "turns, whose angle is known because the circle closes; the encoders measure any other angle, with the error "
        "`uncertainty.angle_std_deg`",
    )
    acceleration_deg_s2: float = Field(
        default=240.0,
        ge=0.1,
        le=ACCELERATION_RANGE_DEG_S2,
        description="acceleration of every motion; the ramps of a sweep are outside the revolution that is averaged",
    )
    rest_s: float = Field(default=DEFAULT_REST_S, ge=0, le=3600, description="time at rest after each sweep")
    margin_deg: float = Field(
        default=2.0, gt=0, le=90, description="angle of constant speed before the revolution begins, and after it ends"
    )

    @model_validator(mode="after")
    def require_every_direction(self) -> Self:
        """Refuse an order that lacks one of the six directions (paper SIX, section II-B), and a speed named twice."""
        order, directions = self.order or get_args(Wrist), self.directions or ("cw", "ccw")
        if len(set(order)) < 3 or len(order) > 3 or set(directions) != {"cw", "ccw"}:
            raise ValueError("order must name wrist_1, wrist_2 and wrist_3 once each, and directions both cw and ccw")
        if len(set(self.speeds)) < len(self.speeds):
            raise ValueError("speeds_deg_s must name each speed once; repeats says how often everything is done")
        return self

    earth_rate: Literal["known", "find"] = Field(
        default="known",
        description="`known`: subtracted if `site` gives latitude and heading, else part of the uncertainty; `find`: "
        "found from the readings of a gyroscope that is good enough; this needs rests in many attitudes (`imu`)",
    )

    @property
    def finds_earth_rate(self) -> bool:
        """Whether the file asks for the Earth's rate."""
        return self.earth_rate == "find"

    @property
    def arcs(self) -> bool:
        """Whether sweeps are arcs instead of whole turns."""
        return self.arc_deg % 360 != 0

    @property
    def mountings(self) -> tuple[StageSection, ...]:
        """The stages with their mountings of the item; empty if the item is mounted once."""
        return ()

    @property
    def speeds(self) -> tuple[float, ...]:
        """The speeds at which every sweep is made, °/s."""
        return self.speeds_deg_s or (self.speed_deg_s,)

    def problems(self, config: RigConfig) -> Iterator[str]:
        """Yield sweeps beyond a sensor's range, unfit arcs, an incomplete site, a verification that cannot pass."""
        for name, sensor in config.sensors.items():
            if max(self.speeds) * RANGE_RATIO > sensor.range_deg_s:
                key = "speeds_deg_s" if self.speeds_deg_s else "speed_deg_s"
                yield (
                    f"procedure.{key} {max(self.speeds):g} is too fast for sensors.{name}.range_deg_s "
                    f"{sensor.range_deg_s:g}: the range must be at least {RANGE_RATIO} times the speed"
                )
        yield from self._arc_problems(config)
        if config.site.latitude_deg is not None and config.site.heading_deg is None and not self.finds_earth_rate:
            yield "site needs latitude_deg and heading_deg, or neither; procedure.earth_rate: find needs no heading"
        if self.needs_reference:
            yield from verification_problems(config)

    def _arc_problems(self, config: RigConfig) -> Iterator[str]:
        """Yield a problem for an arc whose angle is too uncertain, or that exceeds the board's memory."""
        if self.arcs and config.uncertainty.angle_std_deg is None:
            yield (
                f"procedure.arc_deg {self.arc_deg:g} is not a whole turn, so the encoders measure the angle of a "
                "sweep: give uncertainty.angle_std_deg, the standard deviation of a joint's angle about that of its "
                "encoder"
            )
        if self.arcs and self.finds_earth_rate:
            yield f"procedure.earth_rate: find needs whole turns, but procedure.arc_deg is {self.arc_deg:g}"
        slowest = min(self.speeds)
        if self.arc_deg / slowest > MAX_SWEEP_S:
            yield (
                f"procedure.arc_deg {self.arc_deg:g} takes {self.arc_deg / slowest:.0f} s at {slowest:g} °/s: the "
                f"board keeps the readings of {MAX_SWEEP_S} s"
            )


class SixObservationSection(SixSweepsSection):
    """Six sweeps that calibrate; with `verify` the same movement again, to verify."""

    name: Literal["six_observation"] = Field(default="six_observation", description="this procedure")
    verify: bool = Field(
        default=False,
        description="if the calibration passes, store it on the board, then repeat the movement with readings "
        "that the board corrects, and compare them with the reference's",
    )
    stages: tuple[StageSection, ...] = Field(
        default=(), max_length=12, description="mountings of the item, one after the other"
    )
    target_scale_u: Ratio | None = Field(
        default=None,
        gt=0,
        lt=0.1,
        description="expanded uncertainty of the scale factors at which the run ends: it ends after a repeat, with "
        "the arm at home; without this and `target_bias_u_rad_s`, it ends when all repeats are made; a run that does "
        "not reach it fails the check `scale_u`",
    )
    target_bias_u_rad_s: float | None = Field(
        default=None,
        gt=0,
        lt=1,
        description="the same for the biases, with the check `bias_u`; if both are given, both must be reached",
    )

    @property
    def has_target(self) -> bool:
        """Whether a run of several repeats ends at a target uncertainty."""
        return self.target_scale_u is not None or self.target_bias_u_rad_s is not None

    @property
    def then_verify(self) -> bool:
        """Whether the file asks for a verification after the calibration."""
        return self.verify

    @property
    def mountings(self) -> tuple[StageSection, ...]:
        """The mountings of the item, one per entry of `procedure.stages`."""
        return self.stages

    def problems(self, config: RigConfig) -> Iterator[str]:
        """Yield the problems of sweeps, then each setting that stages exclude: a target, a verification, magnetometers.

        Arcs exclude magnetometers too: with stages or arcs a magnetometer could be recorded but not calibrated, and
        only the run's end would show this.
        """
        yield from SixSweepsSection.problems(self, config)
        if self.stages and (self.target_scale_u or self.target_bias_u_rad_s):
            yield (
                "procedure.target_scale_u and target_bias_u_rad_s (or name: shortest) end a run after a repeat, but "
                "procedure.stages makes all repeats in each mounting: leave out one or the other"
            )
        if self.stages and self.verify:
            yield (
                "procedure.verify repeats one movement with one mounting, but stages have several: leave out "
                "procedure.stages, or calibrate in stages first and run procedure.name: verify afterwards"
            )
        beyond = "procedure.stages" if self.stages else f"procedure.arc_deg {self.arc_deg:g}" if self.arcs else None
        if beyond is not None and config.magnetometers:
            yield (
                f"magnetometers.{', '.join(config.magnetometers)} cannot be calibrated with {beyond}: that takes "
                "attitudes, in one mounting and with whole turns (imu, static_attitudes); leave it out, or "
                f"{beyond.partition(' ')[0]}"
            )


class VerifySection(SixSweepsSection):
    """Six sweeps with corrected readings, which are compared with a reference's."""

    name: Literal["verify"] = Field(default="verify", description="this procedure")
    verify: bool = Field(
        default=False,
        description="no effect here; allowed, so that one file can be used for a calibration and for its verification",
    )

    @property
    def needs_reference(self) -> bool:
        """Whether a reference gyroscope is needed: always."""
        return True


def look_up_attitude_set(value: Any) -> Any:
    """Return the attitudes of a named set; a list is returned unchanged."""
    if not isinstance(value, str):
        return value
    if value not in ATTITUDE_SETS:
        raise ValueError(f"is not a set of attitudes; allowed: {', '.join(ATTITUDE_SETS)}, or a list of them")
    return ATTITUDE_SETS[value]


Attitudes = tuple[tuple[JointAngle, JointAngle, JointAngle], ...]
AsWritten = Literal["eighteen", "faces", "magnetic"] | Attitudes  # the names are those of ATTITUDE_SETS


class AttitudesSection(ProcedureSection):
    """Attitudes in which the arm is at rest: which, how long, how often."""

    attitudes: Annotated[Attitudes, BeforeValidator(look_up_attitude_set, json_schema_input_type=AsWritten)] = Field(
        default=ATTITUDE_SETS["eighteen"],
        min_length=1,
        max_length=100,
        description="`eighteen`: the best for an arm whose attitudes are good to 1 mrad; `faces`: twelve that are the "
        "best for exact attitudes; `magnetic`: the eighteen, and eight more for magnetometers; or a list of your own, "
        "with the angles of wrists 1, 2 and 3 for each attitude; base, shoulder and elbow stay as in `arm.home_deg`",
        json_schema_extra={
            "unit": "°",
            "allowed": f"{', '.join(f'`{name}`' for name in ATTITUDE_SETS)} or a list of 3 numbers each",
            "usual": "`eighteen`",
        },
    )
    dwell_s: DwellTime = DEFAULT_REST_S
    settle_s: float = Field(
        default=5.0,
        gt=0,
        le=5,
        description="how long the sensors may take to settle before each attitude; if they take longer, the run ends",
    )
    second_order: bool = Field(
        default=False,
        description="whether the attitudes must also determine an accelerometer's second-order terms; this "
        "triples the uncertainty of its bias",
    )
    field_test_s: float = Field(
        default=0.0,
        ge=0,
        le=600,
        description="time at rest at home before the attitudes and after them, which shows whether the "
        "magnetic field drifted; `0`: no such test",
    )
    repeats: Repeats = 1
    acceleration_deg_s2: float = Field(
        default=240.0, ge=0.1, le=ACCELERATION_RANGE_DEG_S2, description="acceleration of every motion"
    )

    @field_validator("attitudes")
    @classmethod
    def refuse_repeated_attitudes(cls, value: tuple[Vector3, ...]) -> tuple[Vector3, ...]:
        """Refuse a repeated attitude, which adds no information because the arm repeats its error too."""
        listed: set[tuple[float, ...]] = set()
        for attitude in value:
            angles_deg = tuple(np.mod(attitude, 360).tolist())
            if angles_deg in listed:
                raise ValueError(f"{list(attitude)} is listed twice; repeats says how often everything is done")
            listed.add(angles_deg)
        return value

    @property
    def accelerometer_order(self) -> AccelerometerOrder:
        """Order of the accelerometer's model, as the file states it."""
        return 2 if self.second_order else 1

    def problems(self, config: RigConfig) -> Iterator[str]:
        """Yield what is missing for the calibration of an accelerometer."""
        if not any(sensor.acceleration for sensor in config.to_calibrate.values()):
            yield "attitudes calibrate accelerometers: give a sensor with role: calibrate its section acceleration"
        lacking = config.limits.lacking("accelerometer")
        if self.repeats > 1:
            lacking += config.limits.lacking("repeated attitudes")  # it is verified by the last repeat
        if lacking:
            yield f"an accelerometer's calibration needs {', '.join(lacking)}"


class StaticAttitudesSection(AttitudesSection):
    """The arm rests in attitudes that determine an accelerometer's scale, angles and bias."""

    name: Literal["static_attitudes"] = Field(default="static_attitudes", description="this procedure")


class BiasDriftSection(AttitudesSection):
    """Repeated visits of the attitudes, which show the drift of the bias; by default for ten hours, as in TRIAX."""

    name: Literal["bias_drift"] = Field(default="bias_drift", description="this procedure")
    dwell_s: DwellTime = 200.0
    repeats: WholeNumber = Field(default=10, ge=2, le=100, description="how many times the arm visits all attitudes")

    def problems(self, config: RigConfig) -> Iterator[str]:
        """Yield what is missing for the calibration of an accelerometer, and for limits of the drift."""
        yield from AttitudesSection.problems(self, config)
        if lacking := config.limits.lacking("bias drift"):
            yield f"the bias drift needs {', '.join(lacking)}"


class ImuSection(SixSweepsSection, AttitudesSection):
    """Sweeps, then attitudes: gyroscope and accelerometer in one run."""

    def problems(self, config: RigConfig) -> Iterator[str]:
        """Yield the problems of sweeps and attitudes."""
        yield from SixSweepsSection.problems(self, config)
        yield from AttitudesSection.problems(self, config)
        if self.arc_deg != 360:
            yield (
                f"procedure.arc_deg {self.arc_deg:g} cannot be used with imu, which fits an accelerometer's wave over "
                "one whole turn of each sweep; leave it at 360, or use six_observation"
            )

    name: Literal["imu"] = Field(default="imu", description="this procedure")
    axes: SweptAxes = 6


class ThermalSection(SixSweepsSection, AttitudesSection):
    """Sweeps, and attitudes for accelerometers, in sets that are repeated while the sensors warm and cool."""

    name: Literal["thermal"] = Field(default="thermal", description="this procedure")
    from_c: float = Field(
        ge=-40, le=85, description="lower end of the range of temperatures, by the part's thermometer"
    )
    to_c: float = Field(ge=-40, le=85, description="upper end of the range")
    max_step_k: float = Field(
        default=5.0, gt=0, le=50, description="largest difference in temperature between neighbouring sets"
    )
    max_rate_k_per_min: float = Field(
        default=2.0,
        gt=0,
        le=100,
        description="how fast the temperature may change; if it changes faster, the run ends (`too_fast`)",
    )
    reference_c: float = Field(
        default=25.0, ge=-40, le=85, description="temperature at which scale factors and biases are stated"
    )
    heater_power: Ratio = Field(
        default=0.0,
        ge=0,
        le=1,
        description="largest power of the heater on the board's pin, as a fraction of its full power; `0`: the "
        "operator, or the board's own warm-up, changes the temperature",
    )
    both_directions: bool = Field(
        default=True,
        description="whether the range must be covered while the sensors warm and again while they cool, which shows "
        "their hysteresis",
    )
    with_attitudes: bool = Field(
        default=False, description="whether each set has the attitudes too, which calibrate accelerometers"
    )
    max_temperature_c: float = Field(
        default=70.0,
        ge=0,
        le=105,
        description="temperature above which the run ends (`overheated`); the board switches its heater off at 70 "
        "in any case",
    )
    timeout_min: float = Field(
        default=20.0,
        gt=0,
        le=1000,
        description="longest wait for the next temperature; after it the run ends (`range_not_reached`)",
    )
    repeats: WholeNumber = Field(
        default=40,
        ge=2,
        le=100,
        description="largest number of sets; if the range is not covered then, the run ends (`range_not_reached`)",
    )

    @model_validator(mode="after")
    def check_temperature_range(self) -> Self:
        """Refuse a range too narrow for polynomials, a reference near its ends, and a temperature limit within it."""
        gaps, other = (2, "") if self.both_directions else (3, " with both_directions: false")
        if self.to_c - self.from_c < gaps * self.max_step_k:
            raise ValueError(
                f"from_c and to_c must be at least {gaps} gaps apart{other}: a line through two points shows nothing"
            )
        least_k = MIN_RANGE_C + self.max_step_k
        if self.to_c - self.from_c < least_k:
            raise ValueError(f"from_c and to_c must be at least {MIN_RANGE_C:g} K and a gap apart: {least_k:g} K")
        if not self.max_step_k / 2 <= self.reference_c - self.from_c <= self.to_c - self.from_c - self.max_step_k / 2:
            raise ValueError("reference_c must lie between from_c and to_c, at least half a gap from each")
        if self.max_temperature_c <= self.to_c:
            raise ValueError("max_temperature_c must lie above to_c")
        return self

    @property
    def accelerometer_order(self) -> AccelerometerOrder:
        """The order of the accelerometer's model if attitudes are visited at each temperature; else 0."""
        return (2 if self.second_order else 1) if self.with_attitudes else 0

    def problems(self, config: RigConfig) -> Iterator[str]:
        """Yield the problems of sweeps, attitudes and heater, and of sensors without a board."""
        yield from SixSweepsSection.problems(self, config)
        if self.with_attitudes:  # each set is one temperature: no repeat of the attitudes is held out
            yield from AttitudesSection.problems(self.model_copy(update={"repeats": 1}), config)
        if self.arc_deg != 360:
            yield f"procedure.arc_deg {self.arc_deg:g} cannot be used with thermal: leave it at 360"
        if self.finds_earth_rate:
            yield "procedure.earth_rate: find cannot be used with thermal, as biases change; give site.heading_deg"
        if config.magnetometers:
            yield f"magnetometers.{', '.join(config.magnetometers)} cannot be calibrated over temperature; leave it out"
        if self.heater_power > 0 and not config.on_board:
            yield "procedure.heater_power: the heater is on the board, but no sensor is on a board"
        if self.heater_power > 0 and self.to_c > MAX_HEATED_C:
            yield (
                f"procedure.to_c {self.to_c:g} is too hot for the heater, which the board switches off at 70: at most "
                f"{MAX_HEATED_C:g}"
            )


# By the names of the procedures. The procedures state their sections too, but are in a higher layer: a file is read
# without them.
STOCK_SECTIONS: Mapping[str, type[ProcedureSection]] = MappingProxyType(
    {
        "six_observation": SixObservationSection,
        "verify": VerifySection,
        "static_attitudes": StaticAttitudesSection,
        "imu": ImuSection,
        "bias_drift": BiasDriftSection,
        "by_hand": ByHandSection,
        "servo_six_observation": ServoSixObservationSection,
        "thermal": ThermalSection,
    }
)


def verification_problems(config: RigConfig) -> Iterator[str]:
    """Yield what is missing for a verification to pass: a reference, limits."""
    lacking = []
    if config.reference is None:
        lacking.append("a sensor with role: reference to compare with")
    if limits := config.limits.lacking("verification"):
        lacking.append(" and ".join(limits))
    if lacking:
        yield f"a verification needs {', and '.join(lacking)}"
