"""What `result.json` says of the Earth's rate that a gyroscope has found."""

from rig.data.entries.result_types import Entry, Freedom, Matrix3, Vector3


class EarthRateEntry(Entry):
    """The Earth's rate in the frame of the arm's base, as sweeps and rests of a sensor tell it.

    - `latitude_rad` and `heading_rad` are what it says of the place: the latitude by its angle to `up`, north positive,
      and where the base's x axis points, from north over east; null where that axis points up or down.
    - `vertical_fixed` says that its vertical part was not found but held to what a given latitude makes of it, for the
      sake of the g-sensitivity; then `latitude_rad` says how well the level part found fits that latitude.
    - `birge_ratio` is the ratio of the residuals to what was expected; above 1 it has inflated `covariance_rad2_s2`.
    - `degrees_of_freedom` are those of the standard deviations; null where they have no end.
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

    def freedoms(self, count: int) -> list[Freedom]:
        """Degrees of freedom of `count` of the entry's numbers."""
        return [self.degrees_of_freedom] * count
