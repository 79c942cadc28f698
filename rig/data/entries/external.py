"""Gyroscopes whose motion a file gives, in sweeps or in attitudes, in `result.json`."""

from rig.data.entries.result_types import Covariance, Entry, ErrorEntry, PositiveVector3, Vector3


class OmittedIncrementsEntry(Entry):
    """Increments that could not be made: the `error`, their number, and the start of the first one."""

    error: str
    count: int
    first_s: float


class RateSolutionEntry(Entry):
    """The solution of another method, g = K (m + b)."""

    scale: PositiveVector3
    bias_rad_s: Vector3
    rank: int
    condition: float


class IncrementsEntry(Entry):
    """Estimates in addition to scale and bias, of a gyroscope integrated from attitude to attitude.

    - window_s: length of the windows over which attitudes were averaged; attitude_std_rad: error of a mean about each
      axis; clock_offset_s: corrected offset of the attitudes' clock from the readings'.
    - angle_random_walk_rad_sqrt_s: of the gyroscope's noise; matrix_scatter, bias_scatter_rad_s: scatter of F and b
      between intervals of the recording.
    - omitted: increments that could not be made; rejected: number of increments left out as outliers.
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
    """Sweeps of a file that were solved from the angle turned from rest to rest: the numbers of their `rows`.

    `angle_std_rad`, `axis_std_rad`: largest standard deviations of a turn's end and axis, multiplied by
    `uncertainty_inflation` because the turns contradict each other.
    """

    rows: tuple[int, ...]
    angle_std_rad: float
    axis_std_rad: float
    uncertainty_inflation: float


class AttitudesEntry(Entry):
    """Results from attitudes in addition to a gyroscope's scale and bias.

    - `earth_rate_rad_s`: in the axes of the table, with standard deviations, or `earth_rate_error`: why it is missing.
    - `by_increments`: results from increments of angle between attitudes, null if the rates were exact.
    - `other_methods`: the solutions of the other methods.
    - `covariance`: of F row by row, the Earth's rate and c of m = F ω + c.
    """

    earth_rate_rad_s: Vector3 | None
    earth_rate_std_rad_s: Vector3 | None = None
    earth_rate_error: str | None
    by_increments: IncrementsEntry | None
    other_methods: dict[str, RateSolutionEntry | ErrorEntry]
    covariance: Covariance
    covariance_order: tuple[str, ...]
