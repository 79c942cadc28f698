"""The exception for errors of a sensor on a port of its own."""

from rig.errors import ProblemError


class SensorError(ProblemError):
    """An error of a sensor on its own port, or of the serial line to it (`no_kvh`, `kvh_axes_not_identity`, …)."""
