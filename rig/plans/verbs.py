"""The methods that a procedure's script calls, implemented by `rig.runner.procedure_runner.Rig`."""

from collections.abc import Callable
from typing import Protocol

from rig.motion.steps import Dwell, Plan, Rest, Sweep, Transfer


class Verbs(Protocol):
    """The methods that a script calls to move the arm and record samples; each stops the arm if it ends early."""

    @property
    def plan(self) -> Plan:
        """The steps to carry out, fewer than in the complete plan if an interrupted run is resumed."""
        ...

    def preflight(self) -> None:
        """Check all conditions for moving the arm, ask the operator, and take control."""
        ...

    def start_sampling(self) -> None:
        """Make the board stream; from now on every sample is recorded."""
        ...

    def move(self, transfer: Transfer) -> None:
        """Move the arm without measuring; as for `sweep`, the motion must be the plan's next."""
        ...

    def sweep(self, sweep: Sweep) -> None:
        """Turn one wrist through a whole revolution at constant speed."""
        ...

    def rest(self, rest: Rest) -> None:
        """Stand still."""
        ...

    def dwell(self, dwell: Dwell) -> None:
        """Stand still in an attitude and measure, once the sensors have settled."""
        ...

    def wait_for_next_temperature(self, rest: Rest) -> bool:
        """Stand still until the sensors have the next set's temperature; return False if the range is covered.

        The steps up to the next call form one set.
        """
        ...

    def end_temperature_range(self) -> None:
        """Switch the heater off. The run fails if a part of the temperature range was not covered."""
        ...

    def turn_by_hand(self) -> None:
        """Let the operator lay the item on its faces and turn it, until all moves are made or U is small enough."""
        ...

    def solve_on_board(self) -> None:
        """Let the board compute its own calibration; do nothing if the board does not calibrate."""
        ...


Script = Callable[[Verbs], None]
