"""The supported servos, one per row, and the units of their registers.

Source: ROBOTIS e-Manual, pages of the models: "Specifications" (stall torque, no-load speed, both at 12 V) and "Control
Table" (numbers, units).
"""

import math
from dataclasses import dataclass

MAKER = "ROBOTIS"
PULSES = 4096  # pulses per revolution; 12 bits, 0.088°
PULSE_RAD = 2 * math.pi / PULSES
MAX_PULSES = 1_048_575  # in either direction in extended position mode: 256 revolutions
SPEED_RAD_S = 0.229 * 2 * math.pi / 60  # unit of Present Velocity and Velocity Limit: 0.229 rev/min
MAX_PROFILE_MS = 32_737  # of a time-based profile
TICKS = 32_768  # Realtime Tick counts milliseconds modulo this

# Smooth motion takes at most a fifth of the stall torque: the maker's performance graphs are measured with a rising
# load and end there ("note on performance graph").
LOAD_FRACTION = 0.2


@dataclass(frozen=True, slots=True)
class ServoModel:
    """A servo model: name, number, stall torque at 12 V, no-load speed, and whether register 126 is a current."""

    name: str
    number: int
    stall_torque_nm: float
    no_load_rad_s: float
    senses_current: bool

    @property
    def title(self) -> str:
        """The name in the maker's spelling."""
        return self.name.upper().replace("_", "-")

    @property
    def load_unit(self) -> float:
        """The unit of register 126: A if the servo measures its current, otherwise a fraction of full load."""
        return 2.69e-3 if self.senses_current else 1e-3


MODELS = (
    ServoModel("xl430_w250", 1060, 1.5, 61 * 2 * math.pi / 60, senses_current=False),
    ServoModel("xm430_w350", 1020, 4.1, 46 * 2 * math.pi / 60, senses_current=True),
    ServoModel("xm430_w210", 1030, 3.0, 77 * 2 * math.pi / 60, senses_current=True),
)


def model_of(number: int) -> ServoModel | None:
    """Return the model whose register 0 has the given number; None if the number is unknown."""
    return next((model for model in MODELS if model.number == number), None)


def find_model(name: str) -> ServoModel:
    """Return the servo model called `name`. Raise StopIteration if there is none."""
    return next(model for model in MODELS if model.name == name)
