"""What turns the sensors, as far as a run needs it; each kind (`rig.turners.kind`) has a driver in its own room."""

from collections.abc import Callable
from typing import Protocol

from rig.motion.carried import Carried
from rig.motion.state import Report, State
from rig.motion.steps import Motion


class Turner(Protocol):
    """Connected, and standing where it was found, until `take_control`; stopped again whenever it is let go.

    Its time is that of its states, and the reference of a recording. Whatever fails in it stops it before anybody is
    told: then every method raises `Fault` by name, or `Refused` while nothing has moved. `watch`, of `move` and `rest`,
    is called at least every 20 ms, and what it raises stops the turner and goes on to the caller. Whoever connects one
    hands every state, in order, to the recording, and leaves it by a `with` block that ends with it stopped.
    """

    @property
    def latest(self) -> State:
        """The newest state."""
        ...

    @property
    def missed_states(self) -> int:
        """Gaps in its states, counted in states."""
        ...

    def report(self) -> Report:
        """What it says about itself, for pre-flight; nothing moves."""
        ...

    def check(self) -> None:
        """Raise what has gone wrong meanwhile."""
        ...

    def take_control(self, carried: Carried) -> None:
        """Make it ready to move what it carries. Raises `Refused` by name."""
        ...

    def move(self, motion: Motion, watch: Callable[[], None] = ...) -> None:
        """Make one movement and return when it has arrived and stands still; a late one is stopped."""
        ...

    def rest(self, duration_s: float, watch: Callable[[], None] = ...) -> None:
        """Stand still for a time of its own clock."""
        ...
