"""Gyroscopes whose motion a file gives, in sweeps or in attitudes, in `result.json`."""

from rig.data.entries.result_types import Covariance, Entry, ErrorEntry, PositiveVector3, Vector3


class OmittedIncrementsEntry(Entry):
    """Increments of angle that could not be computed: the `error`, their number, and the start of the first one."""

    error: str
    count: int
    first_s: float


class RateSolutionEntry(Entry):
    """The solution of a method that was not chosen: K and b of the model true rate = K (reading + b)."""

    scale: PositiveVector3
    bias_rad_s: Vector3
    rank: int
    condition: float


class IncrementsEntry(Entry):
    """Estimates, other than scale and bias, of a gyroscope whose readings were integrated from attitude to attitude.

    - window_s: length of the windows over which attitudes were averaged; attitude_std_rad: standard deviation of a mean
      attitude about each axis.
    - clock_offset_s: offset of the attitudes' clock from the readings' clock, which was corrected.
    - angle_random_walk_rad_sqrt_s: of the gyroscope's noise; matrix_scatter, bias_scatter_rad_s: scatter of F and b
      between intervals of the recording.
    - omitted: increments that could not be computed; rejected: number of increments left out as outliers.
    """

    increments: int
    window_s: float
    clock_offset_s: float
    clock_offset_std_s: float
    attitude_std_rad: float
    angle_random_walk_rad_sqrt_s: float
    matrix_scatter: float
    bias_scatter_rad_s: float
    residual_rms_rad: float
    omitted: tuple[OmittedIncrementsEntry, ...]
    rejected: int


class AnglesEntry(Entry):
    """Sweeps of a file that were solved from the angle turned between two rests; `rows` are their numbers in the file.

    `angle_std_rad`, `axis_std_rad`: largest standard deviations of a turn's end and axis, multiplied by
    `uncertainty_inflation` because the turns contradict each other.
    """

    rows: tuple[int, ...]
    angle_std_rad: float
    axis_std_rad: float
    uncertainty_inflation: float


class AttitudesEntry(Entry):
    """Results from attitudes in addition to a gyroscope's scale and bias.

    - `earth_rate_rad_s`: the Earth's rate in the axes of the table; `earth_rate_error`: why it is missing, if it is.
    - `by_increments`: results from increments of angle between attitudes, null if the rates were exact.
    - `other_methods`: the solutions of the methods that were not chosen.
    - `covariance`: that of the model m = F ω + c: of F row by row, of the Earth's rate, and of c.
    """

    earth_rate_rad_s: Vector3 | None
    earth_rate_std_rad_s: Vector3 | None = None
    earth_rate_error: str | None
    by_increments: IncrementsEntry | None
    other_methods: dict[str, RateSolutionEntry | ErrorEntry]
    covariance: Covariance
    covariance_order: tuple[str, ...]
