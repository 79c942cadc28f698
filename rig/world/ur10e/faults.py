"""What can be wrong with the simulated controller beyond its modes: a safety limit, a clock, encoders, a fieldbus."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

from rig.world.clock import TICK_S


@dataclass(frozen=True, slots=True)
class AtProgramStart:
    """What happens so long after the start of every program, as by a fieldbus adapter without its connection."""

    act: Callable[[], object]
    after_s: float

    def due(self, ticks_since_start: int) -> bool:
        """Whether it happens in the tick that is so many after a program's start."""
        return ticks_since_start == round(self.after_s / TICK_S)


@dataclass(slots=True)
class ArmFaults:
    """Each holds until it is set back.

    `safety_limit` is the fraction of the programmed speed that a limit of the safety settings leaves; `clock_step_s`
    is what the controller's clock was set forward in all; `encoder_error_rad` is added to the angle that a joint (0 to
    5) reports, and may be no number; where the `payload_stays`, none that a program sets is taken.
    """

    safety_limit: float = 1.0
    clock_step_s: float = 0.0
    encoder_error_rad: dict[int, float] = field(default_factory=dict)
    at_program_start: AtProgramStart | None = None
    payload_stays: bool = False

    def reported(self, q_rad: Sequence[float]) -> tuple[float, ...]:
        """The joints' angles as the encoders report them."""
        errors = self.encoder_error_rad
        return tuple(q + errors.get(joint, 0.0) for joint, q in enumerate(q_rad)) if errors else tuple(q_rad)
