"""The section of a simulated device that sends lines of text: its clock, its other lines, its losses."""

from typing import Annotated

from pydantic import Field

from rig.config.section import Ratio, Section, WholeNumber
from rig.config.sensors.lines_section import LinesSection


class SimulatedLinesSection(Section):
    """The simulated device that prints lines, apart from its gyroscope. It prints as `sensors.<name>.lines` says."""

    oscillator_ppm: float = Field(default=40.0, ge=-20_000, le=20_000, description="how much too fast its clock runs")
    uptime_s: float = Field(
        default=2.0, ge=0, le=1e6, description="how long it has been on; its time starts again at zero after its wrap"
    )
    boot_text: tuple[Annotated[str, Field(max_length=200)], ...] = Field(
        default=("ets Jul 29 2019 12:21:46", "rst:0x1 (POWERON_RESET)", "gyro ok, 1000 dps"),
        max_length=20,
        description="lines that it prints when it is switched on",
        json_schema_extra={"usual": "three lines", "allowed": "at most 20 lines"},
    )
    comment_every: WholeNumber = Field(
        default=0, ge=0, description="number of samples after which it prints a comment; `0`: never"
    )
    lost_fraction: Ratio = Field(
        default=0.0, ge=0, le=0.5, description="fraction of the samples that it does not print"
    )
    stolen: Ratio = Field(
        default=0.0, ge=0, lt=1, description="fraction of its bytes that another program with the same port reads"
    )
    bit_error_rate: Ratio = Field(default=0.0, ge=0, le=0.01, description="fraction of wrong bits on the line")
    scalars: dict[str, float] = Field(
        default=dict[str, float](),
        description="the number that it prints in a column of `lines.scalars`, by its name; if left out, 0",
        json_schema_extra={"unit": "as printed", "allowed": "a number for each name"},
    )
    trailing_separator: bool = Field(default=False, description="whether a separator follows the last column too")
    texts: tuple[Annotated[str, Field(max_length=40)], ...] = Field(
        default=(),
        max_length=40,
        description="what it prints in the columns `-`, from left to right, such as a date; if left out, 0",
        json_schema_extra={"usual": "none", "allowed": "at most 40 texts"},
    )
    colours: bool = Field(default=False, description="whether colour codes surround a line, as in ESP-IDF's log")
    temperature_text: str | None = Field(
        default=None,
        max_length=20,
        description="what it prints for its temperature, such as `nan` or `-127.00`; if left out, its temperature",
        json_schema_extra={"usual": "its temperature", "allowed": "at most 20 characters"},
    )
    time_decimals: WholeNumber = Field(
        default=6, ge=0, le=9, description="decimals of its time, where that is in seconds"
    )
    time_in_single: bool = Field(default=False, description="whether its time is a number in single precision")
    prints: LinesSection | None = Field(
        default=None, description="what it really prints, for tests of refusals; if left out, what the section states"
    )
    pty: bool = Field(default=False, description="also offer its port as a pseudo-terminal (POSIX)")
