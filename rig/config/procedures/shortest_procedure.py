"""`procedure: {name: shortest, target_uncertainty: …}`: six observations, repeated until U reaches a target."""

from collections.abc import Mapping
from typing import Any, Literal, Self

from pydantic import Field, model_validator

from rig.config.section import Ratio, Section

SHORTEST = "shortest"
CARRIED_OUT = "six_observation"
MAX_REPEATS = 16  # if the section states none
PLAN_REMEDY = "`rig plan CONFIG --target-uncertainty scale=U --write FILE` writes the shortest run for the target"
# Procedures that do not end after a repeat, by the kind of turner, and the procedure that the message suggests.
UNREPEATED_PROCEDURES: Mapping[str, tuple[str, str]] = {
    "servo": ("with a servo the repeats are made in each mounting, so no run ends early", "servo_six_observation"),
    "hand": ("nothing turns whole revolutions by hand", "by_hand"),
}


class TargetUncertaintySection(Section):
    """The expanded uncertainties at which the run ends; at least one of them."""

    scale: Ratio | None = Field(
        default=None, gt=0, lt=0.1, description="of the scale factors, as `target_scale_u` of six_observation"
    )
    bias: float | None = Field(
        default=None,
        gt=0,
        lt=1,
        description="of the biases, as `target_bias_u_rad_s`",
        json_schema_extra={"unit": "rad/s"},
    )

    @model_validator(mode="after")
    def require_target(self) -> Self:
        """Refuse a section without any target, which could not end the run early."""
        if self.scale is None and self.bias is None:
            raise ValueError("state the expanded uncertainty at which the run ends, such as {scale: 1e-3, bias: 1e-4}")
        return self


class ShortestSection(Section):
    """Repeats of six_observation, with all its keys, until U reaches the target; at most `repeats`, 16 if left out."""

    name: Literal["shortest"] = Field(description="this procedure")
    target_uncertainty: TargetUncertaintySection


def alternative_procedure(document: Mapping[str, Any]) -> str | None:
    """Return the procedure to recommend for a turner that is not an arm; None for an arm."""
    turner = document.get("turner")
    kind = str(turner.get("kind")) if isinstance(turner, dict) else ""
    if kind not in UNREPEATED_PROCEDURES:
        return None
    why, name = UNREPEATED_PROCEDURES[kind]
    return f"{SHORTEST}: {why}; set name: {name}, and {PLAN_REMEDY}"


def expand_procedure(section: Mapping[str, Any], wanted: TargetUncertaintySection) -> dict[str, Any]:
    """Return the section of the procedure to carry out: all keys remain except the name and the target."""
    rest = {key: value for key, value in section.items() if key != "target_uncertainty"}
    ends = {"target_scale_u": wanted.scale, "target_bias_u_rad_s": wanted.bias}
    return {"repeats": MAX_REPEATS, **ends, **rest, "name": CARRIED_OUT}
