"""A turner that is connected before the run that will use it, while somebody mounts the part. Nothing moves by that.

A run ends with its turner stopped for good, so every run needs one of its own; to connect it takes seconds.
"""

import threading
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, ExitStack, contextmanager
from pathlib import Path

from rig.errors import RigError
from rig.motion.state import State
from rig.turners.kind import OnState
from rig.turners.turner import Turner

Connecting = Callable[[OnState, Path], AbstractContextManager[Turner]]


class Ahead:
    """Connects by `connect`, into the file `log`, when told to `begin`; the next run gets what was connected.

    Where that has failed, or has gone meanwhile, the run connects by itself and says what is wrong.
    """

    def __init__(self, connect: Connecting, log: Path) -> None:
        self._connect, self._log = connect, log
        self._next: _Connection | None = None

    def begin(self) -> None:
        """Connect the next one, in a thread; nothing where one is connected already."""
        if self._next is None:
            self._next = _Connection(self._connect, self._log)

    @contextmanager
    def connected(self, on_state: OnState, log: Path) -> Iterator[Turner]:
        """The turner of a run, as its kind connects it; every state from now on goes to `on_state`."""
        taken, self._next = self._next, None
        with ExitStack() as stack:
            turner = None if taken is None else taken.handed_over(stack, on_state)
            yield turner or stack.enter_context(self._connect(on_state, log))

    def close(self) -> None:
        """Let one go that no run has used."""
        if self._next is not None:
            self._next.close()
            self._next = None


class _Connection:
    """One turner, from the thread that connects it to the run that takes it."""

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
            return  # the run connects by itself, and meets the same

    def _pass_on(self, state: State) -> None:
        self._on_state(state)

    def handed_over(self, stack: ExitStack, on_state: OnState) -> Turner | None:
        """The turner, if it is there and well; `stack` leaves it then."""
        self._thread.join()
        if self._turner is None:
            return None
        try:
            self._turner.check()
            well = self._turner.missed_states == 0  # it would be told of the run
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
        """Forget the run: this refers to itself by its turner, and all that the run has read would stay with it."""
        self._on_state, self._turner = _forget, None

    def close(self) -> None:
        """Let it go."""
        self._thread.join()
        if self._turner is not None:
            self._context.__exit__(None, None, None)


def _forget(state: State) -> None:
    """Nobody wants a state yet."""
