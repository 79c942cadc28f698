"""The connection of a turner before the run that uses it, while the operator mounts the part. Nothing moves.

A run stops its turner for good, so each run needs its own connection, which takes seconds.
"""

import threading
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, ExitStack, contextmanager
from pathlib import Path

from rig.errors import RigError
from rig.motion.turner_state import State
from rig.turners.turner import Turner
from rig.turners.turner_kind import OnState

Connecting = Callable[[OnState, Path], AbstractContextManager[Turner]]


class EarlyConnection:
    """The connection of the next run's turner, made before this run begins.

    `connect` makes it, with `log` as the file for the output of a maker's client. If the connection fails or is lost,
    the run connects by itself and reports the error.
    """

    def __init__(self, connect: Connecting, log: Path) -> None:
        self._connect, self._log = connect, log
        self._next: _Connection | None = None

    def begin(self) -> None:
        """Begin to connect the next turner in a thread, unless one is connected already."""
        if self._next is None:
            self._next = _Connection(self._connect, self._log)

    @contextmanager
    def connect_turner(self, on_state: OnState, log: Path) -> Iterator[Turner]:
        """Provide the turner of a run: the one connected early or, without one, a newly connected one.

        `on_state` receives every state from now on.
        """
        connection, self._next = self._next, None
        with ExitStack() as stack:
            turner = None if connection is None else connection.hand_over(stack, on_state)
            yield turner or stack.enter_context(self._connect(on_state, log))

    def close(self) -> None:
        """Close a connection that no run has used."""
        if self._next is not None:
            self._next.close()
            self._next = None


class _Connection:
    """A turner that a thread connects and passes to the run."""

    def __init__(self, connect: Connecting, log: Path) -> None:
        self._on_state: OnState = _forget
        self._context = connect(self._pass_on, log)
        self._turner: Turner | None = None
        self._thread = threading.Thread(target=self._work, name="ahead", daemon=True)
        self._thread.start()

    def _work(self) -> None:
        try:
            self._turner = self._context.__enter__()
        except (RigError, OSError):
            return  # the run connects itself, and meets the same error

    def _pass_on(self, state: State) -> None:
        self._on_state(state)

    def hand_over(self, stack: ExitStack, on_state: OnState) -> Turner | None:
        """Return the turner if it is connected without fault, else None. It is disconnected when `stack` closes."""
        self._thread.join()
        if self._turner is None:
            return None
        try:
            self._turner.check()
            # Otherwise the run would report states that were missed before it began.
            well = self._turner.missed_states == 0
        except RigError:
            well = False
        if not well:
            self.close()
            return None
        stack.callback(self._let_go)
        stack.push(self._context)
        self._on_state = on_state
        return self._turner

    def _let_go(self) -> None:
        """Drop the references to the run, which would keep all of its readings in memory."""
        self._on_state, self._turner = _forget, None

    def close(self) -> None:
        """Close the connection."""
        self._thread.join()
        if self._turner is not None:
            self._context.__exit__(None, None, None)


def _forget(state: State) -> None:
    """Drop a state that arrives before a run has begun."""
