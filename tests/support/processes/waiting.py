"""Waiting for events in other processes or threads, never for a fixed time."""

import subprocess
import time
from collections.abc import Callable
from typing import Any, TypeVar

PATIENCE_S = 900.0  # of wall time, after which the event has failed: no busy computer takes as long
LOOK_S = 0.005  # until the second look: each takes longer than the one before …
LONGEST_LOOK_S, LONGER = 0.02, 1.25  # … as it may take a processor from those who are waited for

Error = TypeVar("Error", bound=Exception)


def wait_for(
    condition: Callable[[], Any],
    what: str,
    limit_s: float = PATIENCE_S,
    *,
    meanwhile: Callable[[], object] = lambda: None,
) -> Any:
    """Wait until `condition` is true, and return its value; `what` names it in the error after `limit_s`.

    `meanwhile` is called repeatedly; it raises an error that makes waiting futile.
    """
    end_s, look_s = time.monotonic() + limit_s, LOOK_S
    while not (answer := condition()):
        meanwhile()
        assert time.monotonic() < end_s, f"waited {limit_s} s for: {what}"
        time.sleep(look_s)
        look_s = min(LONGER * look_s, LONGEST_LOOK_S)
    return answer


def wait_for_error(kind: type[Error], act: Callable[[], object], limit_s: float = PATIENCE_S) -> Error:
    """Call `act` repeatedly until it raises an error of that kind, and return the error."""

    def raised() -> Error | None:
        try:
            act()
        except kind as error:
            return error
        return None

    error: Error = wait_for(raised, kind.__name__, limit_s)
    return error


def alive(process: "subprocess.Popen[Any]") -> Callable[[], None]:
    """Return a `meanwhile` for `wait_for` that fails the test with a process' output once it has ended."""

    def check() -> None:
        assert process.poll() is None, process.communicate()

    return check
