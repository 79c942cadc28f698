"""How a sensor on a port of its own says no."""

from firmware_host.serial_port import why_closed
from rig.errors import ProblemError


class SensorError(ProblemError):
    """Something such a sensor or the line to it will not or cannot do (`no_kvh`, `kvh_axes_not_identity`, …)."""


def no_port(port: str, error: OSError, *, where: str = "", named_by: str = "its name") -> SensorError:
    """The refusal `no_port` of a port that does not open; `where` is whose it is, `named_by` what says which."""
    return SensorError(
        "no_port",
        f"{where}the port {port} does not open: {why_closed(port, error)}",
        f"Check {named_by} and the cable, and that no other program has the port",
    )
