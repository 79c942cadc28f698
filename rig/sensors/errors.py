"""How a sensor on a port of its own says no."""

from rig.errors import ProblemError


class SensorError(ProblemError):
    """Something such a sensor or the line to it will not or cannot do (`no_kvh`, `kvh_axes_not_identity`, …)."""
