"""The motion of a table with a file of attitudes, for the clock of what was recorded on it."""

import numpy as np
from numpy.typing import NDArray

from rig.errors import Fault
from rig.estimation.arrays import Array
from rig.estimation.cubic_spline import CubicSpline
from rig.observation.motion.reference_motion import MIN_RATE_RAD_S, closely_followed

MAX_STEP_S = 0.05  # between rows that still show how the table turned
MIN_ROWS = 20


class TableMotion:
    """A `KnownMotion` from rows that follow each other closely, each of which holds for its middle.

    `middles_s` (n,) in any order, on the table's clock; `attitudes` (n, 3, 3) take body to table coordinates;
    `rates_rad_s` (n, 3) in body coordinates, None if only the attitudes are known. Raise Fault `time_base_not_found`.
    """

    def __init__(self, middles_s: Array, attitudes: Array, rates_rad_s: Array | None) -> None:
        order = np.argsort(middles_s)
        self.time_s = middles_s[order]
        close = np.diff(self.time_s) <= MAX_STEP_S
        if close.sum() < MIN_ROWS:
            raise _not_found(
                f"of {len(close) + 1} rows {int(close.sum())} follow another within {MAX_STEP_S:g} s: they do not show "
                "how the table turned"
            )
        self._close = close
        if rates_rad_s is None:
            between_s, rates = _differentiate(self.time_s, attitudes[order])
            self._rate = CubicSpline(between_s, rates)
        else:
            rates = rates_rad_s[order]
            self._rate = CubicSpline(self.time_s, rates)
        if not np.linalg.norm(rates, axis=1).max() > MIN_RATE_RAD_S:
            raise _not_found("the table stands still in the whole file")

    def rate(self, time_s: Array, derivative: int = 0, /) -> Array:
        """Return the table's rate (n, 3), or its derivative, as `KnownMotion` defines it."""
        rate: Array = self._rate(time_s, derivative)
        return rate

    def covered(self, time_s: Array) -> NDArray[np.bool_]:
        """Return whether the table's motion is recorded at times (n,), as `KnownMotion` defines it."""
        return closely_followed(self.time_s, self._close, time_s)


def _differentiate(time_s: Array, attitudes: Array) -> tuple[Array, Array]:
    """Return mean rates (n − 1, 3) in body coordinates from each row to the next, and the times (n − 1,) between."""
    from scipy.spatial.transform import Rotation

    rotations = Rotation.from_matrix(attitudes)
    steps = (rotations[:-1].inv() * rotations[1:]).as_rotvec()
    interval_s = np.diff(time_s)
    return time_s[:-1] + interval_s / 2, steps / interval_s[:, None]


def _not_found(what: str) -> Fault:
    return Fault(
        "time_base_not_found",
        f"{what}, and the sensor cannot be put on its clock",
        "Let the table write a row every twentieth of a second or more often while it turns, or use one clock",
    )
