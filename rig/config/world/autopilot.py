"""The subsection of a simulated sensor about the autopilot in which the sensor is."""

from pathlib import Path
from typing import Literal

from pydantic import Field

from rig.config.section import RATIO, Ratio, Section


class SimulatedAutopilotSection(Section):
    """The simulated autopilot apart from its IMUs: its firmware, its clock, its parameters."""

    firmware: Literal["ardupilot", "px4"] = Field(default="ardupilot", description="the firmware that it simulates")
    uid: str = Field(
        default="1c003f000f51383238353439",
        pattern=r"^([0-9a-f]{2}){4,12}$",
        description="its own number",
        json_schema_extra={"allowed": "8 to 24 hexadecimal digits, small letters, two for each byte"},
    )
    clock_ppm: float = Field(default=15.0, ge=-1000, le=1000, description="how much too fast its clock runs")
    uptime_s: float = Field(
        default=30.0,
        ge=0,
        le=5e6,
        description="how long it has been on; its milliseconds start again at zero after 4294967 s",
    )
    armed: bool = Field(default=False, description="whether its motors may turn")
    parameters: dict[str, float] = Field(
        default=dict[str, float](),
        description="parameters that differ from those of a new one, by their names",
        json_schema_extra={"allowed": "parameters that it has", "usual": "`{}`", **RATIO},
    )
    parameter_file: Path | None = Field(
        default=None,
        description="file that keeps the parameters from one run to the next; without it, they are the factory's",
    )
    lost: Ratio = Field(default=0.0, ge=0, lt=1, description="fraction of messages that get lost")
    doubled: Ratio = Field(default=0.0, ge=0, lt=1, description="fraction of messages that come twice")
    stolen: Ratio = Field(
        default=0.0, ge=0, lt=1, description="fraction of its bytes that another program with the same port reads"
    )
    provides_temperature: bool = Field(
        default=True, description="whether its messages contain a temperature, or state that there is none"
    )
    mavlink_version: Literal[1, 2] = Field(
        default=2,
        description="version of the protocol that it sends; version 1 has no temperature of an IMU",
        json_schema_extra=RATIO,
    )
    slowest: Ratio = Field(
        default=1.0, gt=0, le=1, description="fraction of the messages asked for that it has time to send"
    )
    baud: int | None = Field(
        default=None, ge=1200, le=3_000_000, description="speed of its port; if left out, the configured one"
    )
    pty: bool = Field(default=False, description="also offer its port as a pseudo-terminal (POSIX)")
