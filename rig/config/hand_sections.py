"""The sections of a calibration by hand: the procedure, and the turner that has no joints."""

from collections.abc import Iterator

from pydantic import Field

from rig.config.models import ProcedureSection, RigConfig, TurnerSection
from rig.config.section import RATIO

LEAST_RATE_HZ = 50.0  # of readings that follow a hand; its tremor is at 6 to 12 Hz


class HandSection(TurnerSection):
    """An operator's hand, on a table: nothing is connected to, and nothing moves by itself."""


class ByHandSection(ProcedureSection):
    """An item is laid on its faces and turned by hand, as a line of text and a drawing ask for."""

    flips: int = Field(
        default=12,
        ge=8,
        le=96,
        description="how many moves from one face to another are asked for; twelve go over all six faces",
        json_schema_extra=RATIO,
    )
    turns: int = Field(
        default=3,
        ge=0,
        le=24,
        description="how many whole turns on the table are asked for, about one axis after the other",
        json_schema_extra=RATIO,
    )
    rest_s: float = Field(
        default=1.0, ge=1.0, le=60, description="how long the item has to lie at rest before the next move is asked for"
    )
    box_deg: float = Field(
        default=0.2,
        gt=0,
        le=1.7,
        description="how far the faces of the item may be from right angles, a standard deviation; 0.6 of a bare board",
    )
    closure_deg: float = Field(
        default=0.3,
        gt=0,
        le=1.1,
        description="how well a whole turn ends where it began, a standard deviation; one that misses by more than "
        "three of these is asked for again",
    )
    wanted_scale_u: float | None = Field(
        default=None,
        gt=0,
        lt=0.1,
        description="expanded uncertainty (k = 2) of the scale factors at which the session ends; without it, it ends "
        "when all moves are made",
        json_schema_extra=RATIO,
    )

    def problems(self, config: RigConfig) -> Iterator[str]:
        """The board's sensors alone are read, often enough to follow a hand."""
        for name, sensor in config.sensors.items():
            if not sensor.on_board:
                yield f"sensors.{name}: only sensors on the board are calibrated by hand"
            elif sensor.rate_hz < LEAST_RATE_HZ:
                yield f"sensors.{name}.rate_hz: {sensor.rate_hz:g} is too slow for a hand; at least {LEAST_RATE_HZ:g}"
