"""Waiting for what another process or thread does."""

import time
from collections.abc import Callable
from typing import Any


def wait_for(condition: Callable[[], Any], what: str, limit_s: float = 60.0) -> Any:
    """Wait until `condition` is true; the wait is wall time, as a client's would be."""
    end = time.monotonic() + limit_s
    while not (answer := condition()):
        assert time.monotonic() < end, f"waited {limit_s} s for: {what}"
        time.sleep(0.005)
    return answer
