"""Refusal of an arm, a servomotor or the simulated laboratory on other systems than Linux, which these need."""

import sys
from importlib.util import find_spec

from rig.errors import Refused

SYSTEMS = {"win32": "Windows", "darwin": "macOS"}
MODULES = ("fcntl", "termios")  # without them pyserial opens no port, not even a simulated one


def refuse_unless_linux(what: str, system: str = sys.platform) -> None:
    """Raise Refused `only_on_linux`, about `what`, unless the system is Linux.

    Other systems lack signals that stop a program at once, loopback addresses besides 127.0.0.1, or pseudo-terminals.
    """
    missing = [name for name in MODULES if find_spec(name) is None]
    if system == "linux" and not missing:
        return
    lacking = (
        "this Python lacks " + " and ".join(missing) if system == "linux" else f"this is {SYSTEMS.get(system, system)}"
    )
    raise Refused(
        "only_on_linux",
        f"{what} runs on Linux, and {lacking}",
        "Use Linux, WSL 2 or a container. Recordings, notebooks, certificates, the history, and sensors that are "
        "turned by hand work here",
    )
