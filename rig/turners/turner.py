"""The protocol of a turner in a run; each kind (`rig.turners.turner_kind`) has a driver in its own package."""

from collections.abc import Callable
from typing import Protocol

from rig.motion.carried import FlangeLoad
from rig.motion.steps import Motion
from rig.motion.turner_state import Report, State


def watch_nothing() -> None:
    """Do nothing: the default for `watch`."""


class Turner(Protocol):
    """A connected turner, at rest until `take_control`, and stopped again at the end of its `with` block.

    The time of its states is the reference of a recording, which gets every state in order. A failure first stops the
    turner; then every method raises a Fault that names the failure, or Refused if nothing has moved. `move` and `rest`
    call `watch` at least every 20 ms; an exception of `watch` stops the turner and is passed to the caller.
    """

    @property
    def latest(self) -> State:
        """The newest state."""
        ...

    @property
    def missed_states(self) -> int:
        """The number of states missing from the stream."""
        ...

    def report(self) -> Report:
        """Return what the turner reports about itself, for the pre-flight check; nothing moves."""
        ...

    def check(self) -> None:
        """Raise the problem that has occurred since the last call, if any."""
        ...

    def take_control(self, carried: FlangeLoad) -> None:
        """Make the turner ready to move its payload. Raise Refused if the turner is not ready or refuses."""
        ...

    def move(self, motion: Motion, watch: Callable[[], None] = ...) -> None:
        """Make one movement, and return when the turner is at rest at the end; stop a movement that takes too long."""
        ...

    def rest(self, duration_s: float, watch: Callable[[], None] = ...) -> None:
        """Stand still for `duration_s` of its own clock."""
        ...
