"""The verdict's limits, a row each: key, quantity, unit, name of the check, and what needs the limit.

The sections of a configuration, the recorded settings, and the checks of the verdict share this table.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, Any, Literal

from pydantic import BaseModel, ConfigDict, Field, GetJsonSchemaHandler, field_validator
from pydantic_core import CoreSchema

from rig.config.section import Positive, refuse_boolean_number

Kind = Literal["conformity", "fitness"]
Parameter = Literal["scale", "bias", "bias_drift"]
Need = Literal["verification", "accelerometer", "repeated attitudes", "bias drift"]


@dataclass(frozen=True, slots=True)
class Limit:
    """A limit for a sensor's `quantity`; `what` names the check, and `unit` is the unit of value and limit.

    A "conformity" limit judges a property of the item, a "fitness" limit the measurement's fitness for use. `parameter`
    is the judged parameter of the calibration, None if it is not a parameter. `needed_by`: the kind of run that cannot
    pass without the limit; None if every configuration states the limit.
    """

    quantity: str
    what: str
    unit: str
    kind: Kind
    parameter: Parameter | None = None
    needed_by: Need | None = None

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        """Return the schema of the limit's key, with the unit."""
        return {**handler(schema), "unit": self.unit}


class Limits(BaseModel):
    """The verdict's limits, None for those not needed."""

    # Limits that a later version adds are ignored when a recording is read.
    model_config = ConfigDict(frozen=True, allow_inf_nan=False, defer_build=True)

    scale_deviation: Annotated[Positive, Limit("rate", "scale_deviation", "1", "conformity", "scale")] = Field(
        description="largest difference of a scale factor from 1, |k − 1|"
    )
    scale_std: Annotated[Positive, Limit("rate", "scale_std", "1", "fitness", "scale")] = Field(
        description="largest standard uncertainty of a scale factor"
    )
    bias_rad_s: Annotated[Positive, Limit("rate", "bias", "rad/s", "conformity", "bias")] = Field(
        description="largest magnitude of a bias"
    )
    bias_std_rad_s: Annotated[Positive, Limit("rate", "bias_std", "rad/s", "fitness", "bias")] = Field(
        description="largest standard uncertainty of a bias"
    )
    scale_u: Annotated[Positive | None, Limit("rate", "scale_u", "1", "fitness", "scale")] = Field(
        default=None,
        description="largest expanded uncertainty of a scale factor; the default is `procedure.target_scale_u` of "
        "six_observation, if that is given",
    )
    bias_u_rad_s: Annotated[Positive | None, Limit("rate", "bias_u", "rad/s", "fitness", "bias")] = Field(
        default=None,
        description="largest expanded uncertainty of a bias; the default is `procedure.target_bias_u_rad_s`, if that "
        "is given",
    )
    condition: Annotated[Positive, Limit("rate", "condition", "1", "fitness")] = Field(
        description="largest condition number of the equations: how well the sweeps separate the parameters (1 is best)"
    )
    verification_rms_rad_s: Annotated[
        Positive | None, Limit("rate", "verification_rms", "rad/s", "conformity", needed_by="verification")
    ] = Field(
        default=None,
        description="RMS of the difference between the corrected reading and the reference's, sample by sample; a "
        "verification needs this limit",
    )
    verification_mean_rad_s: Annotated[
        Positive | None, Limit("rate", "verification_mean", "rad/s", "conformity", needed_by="verification")
    ] = Field(
        default=None,
        description="the same difference, averaged over each revolution; also the difference between the "
        "reference and the arm; a verification needs this limit",
    )
    acceleration_scale_deviation: Annotated[
        Positive | None, Limit("acceleration", "scale_deviation", "1", "conformity", "scale", "accelerometer")
    ] = Field(
        default=None,
        description="largest difference of an accelerometer's scale factor from 1; the calibration of an "
        "accelerometer needs this limit",
    )
    acceleration_scale_std: Annotated[
        Positive | None, Limit("acceleration", "scale_std", "1", "fitness", "scale", "accelerometer")
    ] = Field(default=None, description="largest standard uncertainty of an accelerometer's scale factor; needed too")
    acceleration_bias_m_s2: Annotated[
        Positive | None, Limit("acceleration", "bias", "m/s²", "conformity", "bias", "accelerometer")
    ] = Field(default=None, description="largest magnitude of an accelerometer's bias; needed too")
    acceleration_bias_std_m_s2: Annotated[
        Positive | None, Limit("acceleration", "bias_std", "m/s²", "fitness", "bias", "accelerometer")
    ] = Field(default=None, description="largest standard uncertainty of an accelerometer's bias; needed too")
    acceleration_verification_m_s2: Annotated[
        Positive | None, Limit("acceleration", "verification", "m/s²", "conformity", needed_by="repeated attitudes")
    ] = Field(
        default=None,
        description="largest difference between the magnitude of a corrected acceleration at rest and gravity; "
        "needed with repeats",
    )
    bias_drift_rad_s: Annotated[
        Positive | None, Limit("rate", "bias_drift", "rad/s", "conformity", "bias_drift", "bias drift")
    ] = Field(
        default=None,
        description="largest change of a gyroscope's bias between any two repeats; `bias_drift` needs this limit",
    )
    acceleration_bias_drift_m_s2: Annotated[
        Positive | None, Limit("acceleration", "bias_drift", "m/s²", "conformity", "bias_drift", "bias drift")
    ] = Field(
        default=None,
        description="largest change of an accelerometer's bias between any two repeats; `bias_drift` needs this limit",
    )

    def lacking(self, need: Need) -> list[str]:
        """Return the configuration paths of limits that are required and not set."""
        return [f"limits.{key}" for key, row in LIMITS.items() if row.needed_by == need and getattr(self, key) is None]


LIMITS: Mapping[str, Limit] = {
    key: row for key, field in Limits.model_fields.items() for row in field.metadata if isinstance(row, Limit)
}
_KEYS: Mapping[tuple[str, str], str] = {(row.quantity, row.what): key for key, row in LIMITS.items()}


def key_of(quantity: str | None, what: str | None) -> str | None:
    """Return the key of the limit for a check of the given quantity; None if no configuration has one."""
    return _KEYS.get((quantity or "", what or ""))


def limit_of(limits: Limits | None, quantity: str, what: str) -> tuple[Limit, float | None]:
    """Return the `Limit` of a quantity's check `what`, and its value, None if not set. Raise KeyError if unknown."""
    key = _KEYS[quantity, what]
    limit: float | None = getattr(limits, key, None)
    return LIMITS[key], limit


class LimitsSection(Limits, extra="forbid"):
    """The limits of the verdict, for every sensor that is calibrated. They have no defaults: state them all."""

    _numbers = field_validator("*", mode="before")(classmethod(refuse_boolean_number))
