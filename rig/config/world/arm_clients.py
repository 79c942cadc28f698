"""Sections of other devices at the simulated controller: a fieldbus adapter, a logger of its poses."""

from pathlib import Path
from typing import Any, Literal

from pydantic import Field

from rig.config.section import Section

MILLISECOND_UNIT: dict[str, Any] = {"unit": "ms"}


class SimulatedFieldbusSection(Section):
    """A fieldbus adapter that has lost its connection, and stops every program soon after its start."""

    stop: Literal["program", "protective"] = Field(
        default="protective", description="what it does: it stops the program, or makes a protective stop"
    )
    after_s: float = Field(default=0.1, ge=0, le=60, description="time from a program's start to that stop")


class SimulatedPoseLogSection(Section):
    """The tool's attitudes as a logger writes them, for `rig solve --attitudes`; `unmodelled` has their errors."""

    path: Path = Field(description="the CSV file, which is replaced")
    rate_hz: float = Field(default=14.0, gt=0, le=500, description="rows a second")
    latency_ms: float = Field(
        default=80.0,
        ge=-1000,
        le=1000,
        description="how much later than its attitude a row's time is, in the mean; negative: earlier",
    )
    jitter_ms: float = Field(default=2.5, ge=0, le=100, description="standard deviation of that delay")
