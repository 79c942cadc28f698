"""The temperature that the user states for a sensor that provides none."""

from typing import Annotated

from pydantic import Field

from rig.config.section import Positive, Section

WithinK = Annotated[Positive, Field(le=60, description="… and by how much that may change in the course of a run")]


class StatedTemperatureSection(Section):
    """The temperature of a sensor whose source provides none; if nothing is stated, U allows for 20 K."""

    stated_c: float = Field(ge=-40, le=85, description="how warm the sensor is")
    stated_within_k: WithinK = 5.0
