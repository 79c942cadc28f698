"""What the floor's feed shows, without a browser."""

import json
import time
from collections.abc import Callable
from typing import Any

from rig.page.sections import Sections


def sections(feed: Sections) -> dict[str, Any]:
    """What the floor's page is handed now."""
    found: dict[str, Any] = json.loads(feed.whole().split(b"data: ", 1)[1])
    return found


def until(feed: Sections, so: Callable[[dict[str, str]], bool], within_s: float) -> None:
    """Wait until the states of the rigs are `so`."""
    deadline_s = time.monotonic() + within_s
    while not so(states := {each["rig"]: each["state"] for each in sections(feed).get("rigs", ())}):
        assert time.monotonic() < deadline_s, states
        time.sleep(0.1)
