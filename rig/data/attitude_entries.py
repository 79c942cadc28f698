"""What `result.json` says of a gyroscope whose motion a file tells, in sweeps or in attitudes."""

from rig.data.result_types import Covariance, Entry, ErrorEntry, PositiveVector3, Vector3


class LeftOutEntry(Entry):
    """Increments that could not be made: the `error`, how many, and when the first of them began."""

    error: str
    count: int
    first_s: float


class BesideEntry(Entry):
    """The solution of another method, g = K (m + b)."""

    scale: PositiveVector3
    bias_rad_s: Vector3
    rank: int
    condition: float


class FollowedEntry(Entry):
    """What was found beside scale and bias of a gyroscope that was followed from attitude to attitude.

    - `window_s` is how long the windows are over which attitudes were averaged; their attitudes are off by
      `fix_std_rad` about each axis, and their clock is `clock_s` off the readings', which is allowed for.
    - `random_walk_rad_sqrt_s` is the gyroscope's own; stretches of the recording differ by `matrix_scatter` in F, by
      `bias_scatter_rad_s` in b.
    - `left_out` are increments that could not be made, `set_aside` how many contradicted all others.
    """

    increments: int
    window_s: float
    clock_s: float
    clock_std_s: float
    fix_std_rad: float
    random_walk_rad_sqrt_s: float
    matrix_scatter: float
    bias_scatter_rad_s: float
    residual_rms_rad: float
    left_out: tuple[LeftOutEntry, ...]
    set_aside: int


class TurnedEntry(Entry):
    """Sweeps of a file that were solved by how far the body turned from rest to rest: the numbers of their `rows`.

    A turn ends within `angle_std_rad` of what is said of it, its axis leans by `axis_std_rad`, the largest of all; they
    count as `widened` times as uncertain, for they contradict each other.
    """

    rows: tuple[int, ...]
    angle_std_rad: float
    axis_std_rad: float
    widened: float


class InAttitudesRatesEntry(Entry):
    """What attitudes tell of a gyroscope beside scale and bias.

    `earth_rate_rad_s` is the Earth's rate in the axes of the table, with its standard deviations, or `earth_rate_error`
    why it was not found.
    `followed` where it was found by how far the body turned between attitudes, null where by rates that were exact.
    `beside` are the other methods. `covariance` is that of F row by row, the Earth's rate and c of m = F ω + c.
    """

    earth_rate_rad_s: Vector3 | None
    earth_rate_std_rad_s: Vector3 | None = None
    earth_rate_error: str | None
    followed: FollowedEntry | None
    beside: dict[str, BesideEntry | ErrorEntry]
    covariance: Covariance
    covariance_order: tuple[str, ...]
