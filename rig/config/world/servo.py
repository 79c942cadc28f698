"""The `world.servo:` section: the simulated servo's true properties."""

from typing import Annotated, Any

from pydantic import Field

from rig.config.procedures.servo_section import ServoName
from rig.config.section import Ratio, Section, WholeNumber

MILLISECOND_UNIT: dict[str, Any] = {"unit": "ms"}
Error = Annotated[float, Field(ge=0, le=10)]


class SimulatedServoSection(Section):
    """The simulated servo: its encoder, its gear, its line. It runs in real time."""

    model: ServoName | None = Field(
        default=None,
        description="which servo it is; a model other than `turner.model` is for tests of the refusal",
        json_schema_extra={"usual": "as `turner.model`"},
    )
    firmware: WholeNumber = Field(default=48, ge=1, le=255, description="version of its firmware")
    start_deg: float = Field(default=150.0, ge=0, lt=360, description="initial angle of its shaft")
    encoder_once_deg: Error = Field(
        default=1.0, description="amplitude of the encoder's error with one period per turn"
    )
    encoder_twice_deg: Error = Field(
        default=0.3, description="amplitude of the encoder's error with two periods per turn"
    )
    encoder_noise_deg: Error = Field(default=0.06, description="standard deviation of one reading")
    backlash_deg: Error = Field(default=0.25, description="play of the gear")
    ripple_fraction: Ratio = Field(
        default=0.07, ge=0, lt=0.5, description="amplitude of the gear's ripple over the rate"
    )
    ripple_per_turn: WholeNumber = Field(default=20, ge=1, le=200, description="periods of the ripple in one turn")
    lag_ms: float = Field(default=15.0, ge=0, le=200, description="delay of the shaft")
    tick_ppm: float = Field(default=3000.0, ge=-20_000, le=20_000, description="how much too fast its own clock runs")
    fall_deg_s: float = Field(
        default=0.0, ge=-360, le=360, description="how fast the shaft falls with torque off; 0 if it is balanced"
    )
    latency_ms: float = Field(
        default=0.0, ge=0, le=50, description="interval at which the adapter passes on what it has received; 0: at once"
    )
