"""The supervision of an arm under control by its states, some of which end the run with a problem. No I/O."""

from enum import Enum, auto

from rig.errors import Problem
from rig.motion.turner_state import ArmState, RuntimeState
from rig.turners.ur.condition import FULL_SPEED_FRACTION, program_interruption, readiness, speed_limited

EXPLANATION_WAIT_S = 0.05  # after a program ended, for the safety bits that explain it
MIN_LIMITED_S = 0.1  # of reduced speed in a movement: a longer one is no ramp of the controller
FIELDBUS = (
    "Make sure that nobody uses the pendant; check whether a fieldbus (EtherNet/IP, PROFINET) without a connection is "
    "set to stop or pause programs, in the installation under Fieldbus; then start again"
)


def describe_early_end(problem: Problem) -> Problem:
    """Return the problem of a control program that was stopped right after its start; it quotes `problem`."""
    what = f"the control program on the arm was stopped right after its start ({problem.what})"
    return Problem("program_stopped", what, FIELDBUS)


class ControlStage(Enum):
    """The progress of taking an arm under control."""

    LOOKING = auto()
    PREPARING = auto()  # its program is being started
    CONTROLLED = auto()


class Supervision:
    """The judgement of an arm's states, one after the other. All times are the controller's."""

    def __init__(self) -> None:
        self.stage = ControlStage.LOOKING
        self.moving = False
        self._played = False  # whether a state showed our program running
        # The problem, with the time of the first state that showed it.
        self._interruption: tuple[Problem, float] | None = None
        self._limited_since_s: float | None = None

    def judge(self, state: ArmState) -> Problem | None:
        """Return why the arm cannot continue; None if it can.

        An interruption of our program is returned only after a short wait, because the safety bits that explain a stop
        may come one packet later than the stop. It also counts if a program runs again soon after, which then belongs
        to another client.
        """
        if self.stage is ControlStage.LOOKING:
            return None
        self._played = self._played or state.runtime_state == RuntimeState.PLAYING
        if self._played and self._interruption is None and (interruption := program_interruption(state)) is not None:
            if self.stage is ControlStage.PREPARING:
                interruption = interruption._replace(remedy=FIELDBUS)
            self._interruption = interruption, state.time_s
        if problem := readiness(state):
            return problem
        if self._interruption is not None:
            return self._interruption[0] if state.time_s - self._interruption[1] >= EXPLANATION_WAIT_S else None
        return self._limit(state)

    @property
    def interruption(self) -> Problem | None:
        """The interruption of the program, even while a later message may still explain it."""
        return None if self._interruption is None else self._interruption[0]

    def _limit(self, state: ArmState) -> Problem | None:
        if not self.moving or state.speed_scaling >= FULL_SPEED_FRACTION:
            self._limited_since_s = None
            return None
        self._limited_since_s = state.time_s if self._limited_since_s is None else self._limited_since_s
        return speed_limited(state) if state.time_s - self._limited_since_s >= MIN_LIMITED_S else None
