"""The `world.thermal` section: the temperature of the simulated board and of its sensors."""

from itertools import pairwise
from typing import Annotated

from pydantic import Field, field_validator

from rig.config.section import Section

Celsius = Annotated[float, Field(ge=-60, le=150)]


class SimulatedThermalSection(Section):
    """One body with a heater on it, in air whose temperature the operator changes. Its sensors follow it."""

    start_c: Celsius = Field(default=22.0, description="temperature of the body when the laboratory starts")
    air_c: tuple[tuple[Annotated[float, Field(ge=0)], Celsius], ...] = Field(
        default=((0.0, 22.0),),
        min_length=1,
        max_length=1000,
        description="temperature of the air, as pairs of a time and a temperature with straight lines between: what "
        "a heat gun, an ice pack or a chamber does in the operator's hand",
        json_schema_extra={"unit": "s, °C", "allowed": "pairs of 2 numbers, times rising", "usual": "`[[0, 22]]`"},
    )
    capacity_j_k: float = Field(default=20.0, gt=0, le=1e5, description="heat that warms the body by one kelvin")
    loss_w_k: float = Field(
        default=0.05, gt=0, le=1e3, description="power lost to the air per kelvin between body and air"
    )
    own_w: float = Field(
        default=0.1, ge=0, le=1e3, description="power of the board itself while it has its supply: its own warm-up"
    )
    heater_w: float = Field(default=0.0, ge=0, le=1e4, description="power of the heater at its pin")
    thermometer_lag_s: float = Field(
        default=0.5, gt=0, le=1e4, description="time constant with which a part's thermometer lags behind the body"
    )
    element_lag_s: float = Field(
        default=0.5,
        gt=0,
        le=1e4,
        description="time constant with which a part's sensing element lags behind its thermometer",
    )
    gradient_k_w: float = Field(
        default=0.0,
        ge=-100,
        le=100,
        description="temperature of a part's sensing element above that of its thermometer, for each watt of the "
        "heater",
    )
    hysteresis_k: float = Field(
        default=2.0,
        gt=0,
        le=100,
        description="how far a part must cool after it was warmed until its hysteresis has reversed completely",
    )

    @field_validator("air_c")
    @classmethod
    def require_rising_times(cls, value: tuple[tuple[float, float], ...]) -> tuple[tuple[float, float], ...]:
        """Refuse pairs whose times do not increase."""
        times = [time_s for time_s, _ in value]
        if any(after <= before for before, after in pairwise(times)):
            raise ValueError("the times must rise from pair to pair")
        return value
