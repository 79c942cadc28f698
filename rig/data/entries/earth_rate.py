"""The Earth's rate, measured by a gyroscope, in `result.json`."""

from rig.data.entries.result_types import Entry, Freedom, Matrix3, Vector3


class EarthRateEntry(Entry):
    """The Earth's rate in the frame of the arm's base, from the sweeps and rests of a sensor.

    - `latitude_rad`: from the rate's angle to `up`, north positive.
    - `heading_rad`: direction of the base's x axis, clockwise from north; null if that axis is vertical.
    - `vertical_fixed`: whether a given latitude fixed the vertical part, to identify the g-sensitivity; `latitude_rad`
      is then from the horizontal part alone.
    - `birge_ratio`: of the residuals; if above 1, it has inflated `covariance_rad2_s2`.
    - `degrees_of_freedom`: of the standard deviations; null if infinite.
    """

    rate_rad_s: Vector3
    covariance_rad2_s2: Matrix3
    norm_rad_s: float
    norm_std_rad_s: float
    latitude_rad: float
    latitude_std_rad: float
    heading_rad: float | None
    heading_std_rad: float | None
    up: Vector3
    vertical_fixed: bool
    birge_ratio: float
    degrees_of_freedom: Freedom

    def dofs(self, count: int) -> list[Freedom]:
        """Return the degrees of freedom of the entry's `count` numbers."""
        return [self.degrees_of_freedom] * count
