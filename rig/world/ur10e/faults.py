"""Faults of the simulated controller beyond its modes: a safety limit, a clock, encoders, a fieldbus."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

from rig.world.clock import TICK_S


@dataclass(frozen=True, slots=True)
class AtProgramStart:
    """An action at a fixed time after each program's start, like that of a fieldbus adapter without a connection."""

    act: Callable[[], object]
    after_s: float

    def is_due(self, ticks_since_start: int) -> bool:
        """Return whether to act in the tick that is `ticks_since_start` after a program's start."""
        return ticks_since_start == round(self.after_s / TICK_S)


@dataclass(slots=True)
class ArmFaults:
    """Faults of the arm; each lasts until it is set again. `payload_stays`: programs cannot change the payload.

    `safety_limit`: the fraction of the programmed speed that a safety limit permits. `clock_step_s`: the sum of all
    steps of the controller's clock. `encoder_error_rad`: errors of reported angles by joint (0 to 5), possibly NaN.
    """

    safety_limit: float = 1.0
    clock_step_s: float = 0.0
    encoder_error_rad: dict[int, float] = field(default_factory=dict)
    at_program_start: AtProgramStart | None = None
    payload_stays: bool = False

    def report_angles(self, q_rad: Sequence[float]) -> tuple[float, ...]:
        """Return the joint angles that the encoders report, rad."""
        errors = self.encoder_error_rad
        return tuple(q + errors.get(joint, 0.0) for joint, q in enumerate(q_rad)) if errors else tuple(q_rad)
