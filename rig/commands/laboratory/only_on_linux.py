"""The refusal of what needs Linux: an arm, a servomotor, the simulated laboratory."""

import sys

from rig.errors import Refused

SYSTEMS = {"win32": "Windows", "darwin": "macOS"}


def refuse_unless_linux(what: str, system: str = sys.platform) -> None:
    """Raise Refused `only_on_linux` unless the system is Linux.

    Others lack prompt stops by signals, loopback addresses or pseudo-terminals.
    """
    if system != "linux":
        raise Refused(
            "only_on_linux",
            f"{what} runs on Linux, and this is {SYSTEMS.get(system, system)}",
            "Use Linux, WSL 2 or a container. Recordings, notebooks, certificates, the history, and sensors that are "
            "turned by hand work here",
        )
