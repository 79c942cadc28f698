"""What `result.json` says of a gyroscope whose motion a file tells, in sweeps or in attitudes."""

from rig.data.entries.result_types import Covariance, Entry, ErrorEntry, PositiveVector3, Vector3


class OmittedIncrementsEntry(Entry):
    """Increments that could not be made: the `error`, how many, and when the first of them began."""

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
    """What was found beside scale and bias of a gyroscope that was followed from attitude to attitude.

    - `window_s` is how long the windows are over which attitudes were averaged; their attitudes are off by
      `attitude_std_rad` about each axis, and their clock is `clock_offset_s` off the readings', which is allowed for.
    - `angle_random_walk_rad_sqrt_s` is the gyroscope's own; intervals of the recording differ by `matrix_scatter` in F,
      by `bias_scatter_rad_s` in b.
    - `omitted` are increments that could not be made, `rejected` how many contradicted all others.
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
    """Sweeps of a file that were solved by how far the body turned from rest to rest: the numbers of their `rows`.

    A turn ends within `angle_std_rad` of what is said of it, its axis leans by `axis_std_rad`, the largest of all; they
    count as `uncertainty_inflation` times as uncertain, for they contradict each other.
    """

    rows: tuple[int, ...]
    angle_std_rad: float
    axis_std_rad: float
    uncertainty_inflation: float


class AttitudesEntry(Entry):
    """What attitudes tell of a gyroscope beside scale and bias.

    `earth_rate_rad_s` is the Earth's rate in the axes of the table, with its standard deviations, or `earth_rate_error`
    why it was not found.
    `by_increments` has what increments of angle between attitudes add; it is null where the rates were exact.
    `other_methods` are the solutions of the other methods. `covariance` is that of F row by row, the Earth's rate and
    c of m = F ω + c.
    """

    earth_rate_rad_s: Vector3 | None
    earth_rate_std_rad_s: Vector3 | None = None
    earth_rate_error: str | None
    by_increments: IncrementsEntry | None
    other_methods: dict[str, RateSolutionEntry | ErrorEntry]
    covariance: Covariance
    covariance_order: tuple[str, ...]
