"""What the states of an arm under control mean: which of them ends the run, and under which name. No I/O."""

from enum import Enum, auto

from rig.errors import Problem
from rig.motion.state import ArmState, RuntimeState
from rig.turners.ur.condition import FULL_SPEED_FRACTION, program_interruption, readiness, speed_limited

INTERRUPTION_S = 0.05  # a stopped program waits so long for the safety bits that explain it
LIMITED_S = 0.1  # a speed that is scaled down for so long, in a movement, is no ramp of the controller's
FIELDBUS = (
    "See that nobody uses the pendant; look whether a fieldbus (EtherNet/IP, PROFINET) without a connection is set to "
    "stop or pause programs, in the installation under Fieldbus; then start again"
)


def stopped_at_start(problem: Problem) -> Problem:
    """Name a problem of the preparation as what it is where our program was started, and has ended at once."""
    what = f"the control program on the arm was stopped right after its start ({problem.what})"
    return Problem("program_stopped", what, FIELDBUS)


class Stage(Enum):
    """How far an arm has been taken under control."""

    LOOKING = auto()
    PREPARING = auto()  # its program is being started
    TAKEN = auto()


class Supervision:
    """Judges state after state. All times are the controller's."""

    def __init__(self) -> None:
        self.stage = Stage.LOOKING
        self.moving = False
        self._played = False  # our program has been seen to run
        self._interruption: tuple[Problem, float] | None = None  # and the time of the state that showed it first
        self._limited_since_s: float | None = None

    def judge(self, state: ArmState) -> Problem | None:
        """Why the arm cannot go on. The safety bits that explain a stopped program may come a packet later than it.

        What interrupts our program ends it: one that runs again a moment later is somebody else's.
        """
        if self.stage is Stage.LOOKING:
            return None
        self._played = self._played or state.runtime_state == RuntimeState.PLAYING
        if self._played and self._interruption is None and (interruption := program_interruption(state)) is not None:
            if self.stage is Stage.PREPARING:
                interruption = interruption._replace(remedy=FIELDBUS)
            self._interruption = interruption, state.time_s
        if problem := readiness(state):
            return problem
        if self._interruption is not None:
            return self._interruption[0] if state.time_s - self._interruption[1] >= INTERRUPTION_S else None
        return self._limit(state)

    @property
    def interruption(self) -> Problem | None:
        """What has interrupted the program, also where its explanation may still come."""
        return None if self._interruption is None else self._interruption[0]

    def _limit(self, state: ArmState) -> Problem | None:
        if not self.moving or state.speed_scaling >= FULL_SPEED_FRACTION:
            self._limited_since_s = None
            return None
        self._limited_since_s = state.time_s if self._limited_since_s is None else self._limited_since_s
        return speed_limited(state) if state.time_s - self._limited_since_s >= LIMITED_S else None
