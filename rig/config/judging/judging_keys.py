"""The keys by which a recording is judged, apart from limits: each with its range, default and meaning.

The sections of a configuration and the recorded settings share this table; recorded settings have every key.
"""

from typing import Annotated, Any, Generic, Literal, TypeVar, get_args

from pydantic import BaseModel, ConfigDict, Field, field_validator

from rig.config.section import Positive, Ratio, refuse_boolean_number

JUDGING_MODEL = ConfigDict(frozen=True, allow_inf_nan=False, defer_build=True)
NonNegative = Annotated[float, Field(ge=0)]
DecisionRule = Literal["simple", "guard_band"]
ExternalResult = Literal[
    "g_sensitivity_deg_s_g",
    "nonlinearity_percent",
    "asymmetry_percent",
    "bias_deg_s_k",
    "scale_ppm_k",
    "bias_instability_deg_h",
    "non_orthogonality_deg",
    "acceleration_nonlinearity_percent",
    "acceleration_nonlinear_over_g",
    "acceleration_bias_mg_k",
    "acceleration_scale_ppm_k",
    "acceleration_bias_instability_ug",
]
SENSOR_KEYS: tuple[ExternalResult, ...] = get_args(ExternalResult)
# A size that a configuration states for all sensors, and a recording for each by its name.
OfSensors = TypeVar("OfSensors")


def _part_default_key(what: str) -> Any:
    """Return the field of a key whose default is the catalogue's value for the sensor's part."""
    return Field(default=None, description=f"{what}; if left out, the part's value")


class ObservationKeys(BaseModel):
    """The conditions under which a revolution is averaged: the keys of the section `observation`."""

    model_config = JUDGING_MODEL

    max_lost_fraction: Ratio = Field(
        default=0.001, ge=0, lt=1, description="fraction of a sweep's samples that may be missing"
    )
    max_speed_deviation: Ratio = Field(
        default=0.25,
        gt=0,
        lt=1,
        description="how much the joint's rate, smoothed over 50 ms, may differ from its mean, as a fraction of "
        "the mean",
    )
    max_axis_deviation_deg: float = Field(
        default=20.0,
        gt=0,
        lt=45,
        description="angle that is allowed between the measured rotation and the nominal axis of the sensor",
    )


class UncertaintyKeys(BaseModel, Generic[OfSensors]):
    """The stated sizes of errors: the keys of the section `uncertainty`.

    Sizes of a sensor's errors have the type `OfSensors`: one number in a configuration, one by sensor in a recording.
    """

    model_config = JUDGING_MODEL

    controller_clock_ppm: Positive = Field(
        default=50.0, description="error of the arm controller's clock, which its maker does not state"
    )
    computer_clock_ppm: Positive = Field(
        default=1.0,
        description="error of this computer's clock during a run if a time server corrects it; set "
        "50 without a time server",
    )
    crystal_ppm: Positive = Field(
        default=20.0,
        description="error of the board's 32768 Hz crystal at room temperature; in a session by hand also that of "
        "the clock of an autopilot or of a device that prints lines, for which it must be stated",
    )
    axis_deg: float = Field(
        default=0.06,
        ge=0,
        le=5,
        description="error of the direction of each wrist's axis in the kinematics that are used; the usual value "
        "is 1 mrad, as for calibrated arms of this size (Slamani, Nubiola and Bonev, 2012)",
    )
    repeatability_deg: float = Field(
        default=0.005,
        ge=0,
        le=5,
        description="repeatability of a joint's angle; the default is 87 µrad, as for an arm of this size (Slamani, "
        "Nubiola and Bonev, 2012)",
    )
    thermometer_gradient_k: float = Field(
        default=0.1,
        ge=0,
        le=20,
        description="for a calibration over temperature: how much the temperature difference between a part's "
        "thermometer and its sensing element may change between run and use; a typical value, as no data sheet "
        "states it",
    )
    angle_std_deg: float | None = Field(
        default=None,
        ge=0,
        le=5,
        description="standard deviation of a joint's angle about the angle of its encoder, for sweeps that are not "
        "whole turns. There is no default because no maker of these arms states it",
    )
    mount_deg: float = Field(
        default=1.0,
        ge=0,
        le=10,
        description="how far the item may sit off the mounting that each of `procedure.stages` states, about each axis",
    )
    sensor_offset_mm: float = Field(
        default=50.0,
        ge=0,
        le=1000,
        description="how far the sensor may be from the flange's centre, or from the end of `arm.extension_mm`, "
        "along each axis, in either direction",
    )
    acceleration_lag_ms: float = Field(
        default=5.0,
        ge=0,
        le=100,
        description="largest delay of an accelerometer's own filter; it reduces the wave of a sweep by half the "
        "square of the angle (in rad) that the arm turns in this time",
    )
    g_sensitivity_deg_s_g: OfSensors = _part_default_key(
        "change of a reading for 1 g, if attitudes do not determine it"
    )
    nonlinearity_percent: OfSensors = _part_default_key(
        "largest distance of a gyroscope's curve from the best straight line, in per cent of full scale, for the "
        "odd part of the curve and for the even part; used if there is only one speed"
    )
    asymmetry_percent: OfSensors = _part_default_key(
        "even part of a gyroscope's curve, in per cent of full scale, that is allowed although one scale factor is"
        " stated for both directions; more of it fails the check `cw_against_ccw`"
    )
    bias_deg_s_k: OfSensors = _part_default_key("change of a gyroscope's bias for 1 K")
    scale_ppm_k: OfSensors = _part_default_key("change of a gyroscope's scale factor for 1 K")
    bias_instability_deg_h: OfSensors = _part_default_key(
        "smallest Allan deviation of a gyroscope at rest (in-run bias stability): how much its bias drifts, even "
        "with the longest average"
    )
    non_orthogonality_deg: OfSensors = _part_default_key(
        "how much the angle between two axes of a gyroscope may differ from 90°"
    )
    acceleration_nonlinearity_percent: OfSensors = _part_default_key(
        "largest distance of an accelerometer's curve from the best straight line, in per cent of "
        "`acceleration_nonlinear_over_g`"
    )
    acceleration_nonlinear_over_g: OfSensors = _part_default_key(
        "acceleration in either direction for which this nonlinearity is stated; 0 means the range that is set"
    )
    acceleration_bias_mg_k: OfSensors = _part_default_key("change of an accelerometer's bias for 1 K")
    acceleration_scale_ppm_k: OfSensors = _part_default_key("change of an accelerometer's scale factor for 1 K")
    acceleration_bias_instability_ug: OfSensors = _part_default_key(
        "smallest Allan deviation of an accelerometer at rest"
    )
    decision_rule: DecisionRule = Field(
        default="simple",
        description="what is compared with a limit: `simple`, the value alone; `guard_band`, the value together "
        "with its expanded uncertainty, so that at most one in forty is accepted wrongly",
    )


class ObservationSection(ObservationKeys, extra="forbid"):
    """The conditions under which a revolution is averaged."""

    _numbers = field_validator("*", mode="before")(classmethod(refuse_boolean_number))


class UncertaintySection(UncertaintyKeys[NonNegative | None], extra="forbid"):
    """Sizes of errors that no recording shows: half-widths, except `angle_std_deg` and both bias instabilities."""

    _numbers = field_validator("*", mode="before")(classmethod(refuse_boolean_number))


def refuse_missing_keys(cls: type[BaseModel], document: Any) -> Any:
    """Return a recording's keys unchanged. Raise ValueError naming missing ones."""
    if isinstance(document, dict) and (missing := cls.model_fields.keys() - document.keys()):
        raise ValueError(f"lacks {', '.join(sorted(missing))}")
    return document
