"""A board's clock relative to the controller's: offset and drift."""

from dataclasses import dataclass, replace

import numpy as np

from rig.errors import Fault
from rig.estimation.arrays import Array

# The board's counter runs from its 32768 Hz crystal by way of a PLL, 576 ppm below the nominal rate (docs/board.md).
NOMINAL_DRIFT = 4e6 / (122 * 32768) - 1
CHECK_SENSOR = "Check that the sensor is fixed to the flange and read in the right range, then record again"


@dataclass(frozen=True, slots=True)
class TimeBase:
    """A clock: controller time = board time + `offset_s` + `drift` × (board time − `reference_s`), in seconds.

    `reference_s` is the mean board time of the data used, at which offset and drift are nearly uncorrelated.
    `covariance` (2, 2) is for (`offset_s`, `drift`). `zero_rate_rad_s` (3,) is the fitted reading at rest.
    """

    offset_s: float
    drift: float
    reference_s: float
    covariance: Array
    zero_rate_rad_s: Array

    @property
    def offset_std_s(self) -> float:
        """The standard deviation of the offset, s."""
        return float(np.sqrt(self.covariance[0, 0]))

    @property
    def drift_std(self) -> float:
        """The standard deviation of the drift."""
        return float(np.sqrt(self.covariance[1, 1]))

    def controller_time_s(self, board_time_s: Array) -> Array:
        """Return board times on the controller's clock."""
        return board_time_s + self.offset_s + self.drift * (board_time_s - self.reference_s)

    def correct(self, by_s: float, std_s: float) -> "TimeBase":
        """Return the time base with `by_s` added to the offset, and `std_s` as the offset's standard deviation."""
        covariance = np.diag([std_s**2, self.covariance[1, 1]])
        return replace(self, offset_s=self.offset_s + by_s, covariance=covariance)

    def board_time_s(self, controller_time_s: float) -> float:
        """Return a controller time on the board's clock."""
        since_reference_s = (controller_time_s - self.offset_s - self.reference_s) / (1 + self.drift)
        return self.reference_s + since_reference_s

    def move_reference(self, reference_s: float) -> "TimeBase":
        """Return the time base with its offset at another reference time; the covariance is not converted."""
        offset_s = self.offset_s + self.drift * (reference_s - self.reference_s)
        return replace(self, offset_s=float(offset_s), reference_s=float(reference_s))


def time_base_not_found(what: str, remedy: str = CHECK_SENSOR) -> Fault:
    """Return the fault of a recording whose clocks cannot be related."""
    return Fault("time_base_not_found", f"{what}, so board and arm cannot be put on one clock", remedy)
