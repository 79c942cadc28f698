"""The section of a series of parts: permitted serial numbers, and the parts' sensors."""

import re

from pydantic import Field, field_validator

from rig.config.section import Section, SensorName, WholeNumber, Words


class StationSection(Section):
    """A station, at which one part follows the other (`rig station`). A single run does not use it."""

    serial_pattern: str = Field(
        default=r"[A-Za-z0-9][A-Za-z0-9._-]*",
        min_length=1,
        max_length=200,
        description="pattern that a part's whole serial number matches, as a regular expression of Python",
    )
    parts: tuple[Words, ...] = Field(
        default=(),
        max_length=10_000,
        description="serial numbers of the existing parts; the station asks about any other. Empty: it accepts every "
        "number that matches",
    )
    sensors: tuple[SensorName, ...] = Field(
        default=(),
        max_length=20,
        description="names of the sensors that have the part's serial number. Empty: all that are calibrated",
    )
    own_board: bool = Field(
        default=True,
        description="whether each part brings its own board, so that the same board twice is the same part twice; "
        "`false`: one board stays at the rig, and the parts on it are changed",
    )
    repeats: WholeNumber = Field(
        default=1, ge=0, le=5, description="how often refused sweeps are repeated at once before the verdict is final"
    )

    @field_validator("serial_pattern")
    @classmethod
    def check_pattern(cls, value: str) -> str:
        """Refuse a text that is not a regular expression."""
        try:
            re.compile(value, re.ASCII)
        except re.error as error:
            raise ValueError(f"is not a regular expression: {error}") from None
        return value
