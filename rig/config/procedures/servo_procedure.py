"""The `procedure:` section of the six observations with a servo: mountings, and a turn in either direction in each."""

from collections.abc import Iterator
from typing import Literal, Self

import numpy as np
from pydantic import Field, model_validator

from rig.config.models import ProcedureSection, RigConfig
from rig.config.procedures.servo_section import MAX_SPEED_DEG_S
from rig.config.procedures.stage_section import Instruction, StageMountSection, mount_matrix
from rig.config.ranges import ACCELERATION_RANGE_DEG_S2
from rig.config.section import DEFAULT_REST_S, Direction, Section, WholeNumber

RANGE_RATIO = 1.5  # to the speed: scale error, bias, ripple and noise add to a sweep's speed
MIN_AXES_SPAN = 0.5  # least singular value of the directions of the sweeps; 1 if they are orthogonal
MOUNT = "switch the servo's supply off with a hand on the item, screw it on with its {axis} axis along the shaft, away "
MOUNT_END = "from the servo, and switch the supply on"


class ServoStageSection(Section):
    """One mounting of the item on the shaft."""

    instruction: Instruction = Field(
        description="what the operator is to do before this stage; hands are safe only with the servo's supply off"
    )
    mount: StageMountSection = Field(
        default=StageMountSection(),
        description="how the item is mounted in this stage, nominally; the shaft is the flange's z axis, away from the "
        "servo",
    )


def _shaft_along(axis: str, mount: StageMountSection) -> ServoStageSection:
    return ServoStageSection(instruction=MOUNT.format(axis=axis) + MOUNT_END, mount=mount)


THREE_MOUNTINGS = (
    _shaft_along("x", StageMountSection(x="+z", y="+x", z="+y")),
    _shaft_along("y", StageMountSection(x="+y", y="+z", z="+x")),
    _shaft_along("z", StageMountSection()),
)


class ServoSixObservationSection(ProcedureSection):
    """Three mountings; in each, the shaft turns once in either direction. The speeds determine scale and bias."""

    name: Literal["servo_six_observation"] = Field(default="servo_six_observation", description="this procedure")
    stages: tuple[ServoStageSection, ...] = Field(
        default=THREE_MOUNTINGS,
        min_length=1,
        max_length=12,
        description="mountings of the item, one after the other; the shaft must point along three "
        "different directions of the item",
        json_schema_extra={"usual": "x, y and z along the shaft"},
    )
    directions: tuple[Direction, Direction] = Field(
        default=("ccw", "cw"), description="direction of the first turn and of the second; ccw as seen on the horn"
    )
    repeats: WholeNumber = Field(
        default=1, ge=1, le=100, description="how many times both turns are made in each mounting"
    )
    speed_deg_s: float = Field(
        default=60.0,
        ge=10,
        le=MAX_SPEED_DEG_S,
        description=f"constant speed of a turn; every sensor's range must be at least {RANGE_RATIO} times as large",
    )
    acceleration_deg_s2: float = Field(
        default=240.0, ge=10, le=ACCELERATION_RANGE_DEG_S2, description="acceleration of every motion"
    )
    rest_s: float = Field(
        default=DEFAULT_REST_S, gt=0.5, le=3600, description="time at rest before and after each turn"
    )
    overtravel_deg: float = Field(
        default=90.0,
        ge=30,
        le=360,
        description="angle of constant speed beyond the whole turn: there the encoder repeats its readings of one turn "
        "earlier, so the duration of the turn is known",
    )

    @model_validator(mode="after")
    def require_six_directions(self) -> Self:
        """Refuse turns in fewer directions than six parameters need: both directions about three axes."""
        if set(self.directions) != {"cw", "ccw"}:
            raise ValueError("directions must name both cw and ccw")
        shaft_axes = np.array([mount_matrix(stage.mount)[:, 2] for stage in self.stages])
        if len(shaft_axes) < 3 or np.linalg.svd(shaft_axes, compute_uv=False)[2] < MIN_AXES_SPAN:
            raise ValueError("stages must mount the item with the shaft along three independent directions of it")
        return self

    def problems(self, config: RigConfig) -> Iterator[str]:
        """Yield turns beyond a sensor's range, sensors that a servo disturbs, and a site without a heading."""
        for name, sensor in config.sensors.items():
            if self.speed_deg_s * RANGE_RATIO > sensor.range_deg_s:
                yield (
                    f"procedure.speed_deg_s {self.speed_deg_s:g} is too fast for sensors.{name}.range_deg_s "
                    f"{sensor.range_deg_s:g}: the range must be at least {RANGE_RATIO} times the speed"
                )
        if config.magnetometers:
            yield "magnetometers cannot be calibrated near a servo's motor: leave them out"
        if config.site.latitude_deg is not None and config.site.heading_deg is None:
            yield "site needs latitude_deg and heading_deg, or neither"
