"""The sections of a calibration by hand: the procedure, and the turner without joints."""

from collections.abc import Iterator

from pydantic import Field

from rig.config.models import ProcedureSection, RigConfig, TurnerSection
from rig.config.section import Ratio, WholeNumber

MIN_RATE_HZ = 50.0  # of readings that follow a hand, whose tremor is at 6 to 12 Hz
SELF_STAMPED_PARTS = ("lines", "mavlink")  # with a port of their own, whose device states the time of a sample


class HandSection(TurnerSection):
    """An operator's hand, which turns the item on a table. The program connects to no turner and moves nothing."""


class ByHandSection(ProcedureSection):
    """An item is laid on its faces and turned by hand, as requested by a line of text and a drawing."""

    flips: WholeNumber = Field(
        default=12,
        ge=8,
        le=96,
        description="number of moves from one face to another; twelve cover all six faces",
    )
    turns: WholeNumber = Field(
        default=3,
        ge=0,
        le=24,
        description="number of whole turns on the table, about one axis after the other",
    )
    rest_s: float = Field(
        default=1.0, ge=1.0, le=60, description="how long the item must lie at rest before the next move is requested"
    )
    squareness_deg: float = Field(
        default=0.2,
        gt=0,
        le=1.7,
        description="standard deviation of the angles between the item's faces from 90°; 0.6 for a bare board",
    )
    closure_deg: float = Field(
        default=0.3,
        gt=0,
        le=1.1,
        description="standard deviation of the angle by which a whole turn misses its start; a turn that misses it "
        "by more than three of these must be repeated",
    )
    target_scale_u: Ratio | None = Field(
        default=None,
        gt=0,
        lt=0.1,
        description="expanded uncertainty (k = 2) of the scale factors at which the session ends; without it, it ends "
        "when all moves are made",
    )

    def problems(self, config: RigConfig) -> Iterator[str]:
        """Yield the sensors that are unsuitable by their part, an unknown clock, or too low a data rate for a hand."""
        others = [name for name, sensor in config.sensors.items() if not sensor.on_board]
        if others and "crystal_ppm" not in config.uncertainty.model_fields_set:
            yield (
                f"uncertainty.crystal_ppm: state how far the clock of {' and '.join(others)} may be off, because "
                "nothing in a session by hand shows it: 50 for a crystal, 5000 for a ceramic resonator such as that "
                "of an Arduino Uno"
            )
        for name, sensor in config.sensors.items():
            if not sensor.on_board and sensor.part not in SELF_STAMPED_PARTS:
                yield f"sensors.{name}: a {sensor.part} is not calibrated by hand"
            elif sensor.lines is not None and sensor.lines.clock == "arrival":
                yield (
                    f"sensors.{name}.lines.clock: in a session by hand the device must print its time, because there "
                    "is no other clock. Let its program begin each line with micros(), or with the sample's number if "
                    "a timer starts it; then write a new file: rig lines PORT --write NEW.yaml"
                )
            elif sensor.rate_hz < MIN_RATE_HZ:
                yield f"sensors.{name}.rate_hz: {sensor.rate_hz:g} is too slow for a hand; at least {MIN_RATE_HZ:g}"
