"""The section `world: hand:`: the simulated operator's handling of an item, and mistakes."""

from typing import Annotated, Literal, get_args

from pydantic import Field

from rig.config.section import Section

Seconds = Annotated[float, Field(ge=0, le=60)]
Probability = Annotated[float, Field(ge=0, le=1)]
MistakenUnit = Literal[
    "short", "two_turns", "other_way", "wrong_face", "skipped", "crumb", "table_pushed", "held", "dropped", "left",
    "lifted", "too_fast",
]  # fmt: skip


class SimulatedHandSection(Section):
    """The simulated operator, who follows each instruction after a reaction time and sometimes makes mistakes."""

    peak_deg_s: float = Field(default=250.0, ge=30, le=1500, description="peak rate of a push")
    wobble_deg: float = Field(
        default=1.5, ge=0, le=20, description="amplitude of the oscillation of the axis of a move"
    )
    tremor_deg: float = Field(default=0.15, ge=0, le=2, description="tremor of 6 to 12 Hz while it is touched")
    tilt_mrad: float = Field(
        default=0.3,
        ge=0,
        le=20,
        description="scatter of the attitude on a face from one time to the next; 2 for a bare board",
    )
    closure_mrad: float = Field(default=3.0, ge=0, le=50, description="angle by which a whole turn misses the rule")
    faces_mrad: float = Field(
        default=2.0, ge=0, le=50, description="deviation of the angles between the item's faces from 90°"
    )
    table_mrad: float = Field(default=5.0, ge=0, le=50, description="tilt of the table")
    reaction_time_s: tuple[Seconds, Seconds] = Field(
        default=(0.5, 2.0), description="shortest and longest time from an instruction to the first touch"
    )
    mistakes: dict[MistakenUnit, Probability] = Field(
        default=dict[MistakenUnit, Probability](),
        description="probability of this mistake in an action: "
        + ", ".join(f"`{mistake}`" for mistake in get_args(MistakenUnit)),
        json_schema_extra={"unit": "1", "allowed": "mistakes with a number 0 to 1 each", "usual": "`{}`"},
    )
