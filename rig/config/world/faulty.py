"""The section about errors of the electronics of a simulated sensor with its own port."""

from typing import Literal

from pydantic import Field

from rig.config.section import Ratio, Section, WholeNumber


class SimulatedFaultySection(Section):
    """Faults of the electronics in a sensor with a port of its own, which change its rates."""

    frozen_axis: Literal["x", "y", "z"] | None = Field(
        default=None, description="axis whose rate freezes at its last value; none if left out"
    )
    frozen_from_s: float = Field(default=0.0, ge=0, le=1e6, description="time of the world at which it freezes")
    repeated: Ratio = Field(
        default=0.0, ge=0, lt=1, description="fraction of the samples that repeat rates sent before"
    )
    repeated_length: WholeNumber = Field(default=1, ge=1, le=1000, description="how many samples come again in a row")
