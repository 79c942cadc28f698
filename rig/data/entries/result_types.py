"""The types of which the entries of `result.json` are made."""

from datetime import datetime
from typing import Annotated, Literal

from pydantic import AfterValidator, BaseModel, ConfigDict, Field

Positive = Annotated[float, Field(gt=0)]
Vector2 = tuple[float, float]
Vector3 = tuple[float, float, float]
Vector6 = tuple[float, float, float, float, float, float]
PositiveVector3 = tuple[Positive, Positive, Positive]
Matrix3 = tuple[Vector3, Vector3, Vector3]


def covariance(rows: tuple[tuple[float, ...], ...]) -> tuple[tuple[float, ...], ...]:
    """Return the rows unchanged. Raise ValueError if they are not square or hold a negative variance."""
    if any(len(row) != len(rows) for row in rows):
        raise ValueError("must have as many columns as rows")
    if any(row[i] < 0 for i, row in enumerate(rows)):
        raise ValueError("holds a variance below 0")
    return rows


def _iso(text: str) -> str:
    datetime.fromisoformat(text)
    return text


Utc = Annotated[str, AfterValidator(_iso)]
Covariance = Annotated[tuple[tuple[float, ...], ...], AfterValidator(covariance)]
Matrix6 = Annotated[tuple[Vector6, ...], Field(min_length=6, max_length=6), AfterValidator(covariance)]
# Degrees of freedom; infinite ones are null.
Freedom = float | None
Freedom3 = tuple[Freedom, Freedom, Freedom]
Role = Literal["calibrate", "reference"]
Method = Literal["attitude_weighted", "maximum_likelihood", "as_published"]


class Entry(BaseModel):
    """A part of `result.json`, or of another document."""

    # Keys that a later version adds are ignored on reading.
    model_config = ConfigDict(frozen=True, allow_inf_nan=False, defer_build=True)


class ConditionsEntry(Entry):
    """The first, last and mean time (UTC) of readings, and their temperature.

    Times are the recording's start plus the time since then on the arm controller's clock. `temperature_c` and
    `temperature_range_c` are mean and range from the sensor's own thermometer, null without one; a temperature without
    range was stated.
    """

    from_utc: Utc
    to_utc: Utc
    mean_utc: Utc
    temperature_c: float | None
    temperature_range_c: tuple[float, float] | None

    @property
    def temperature_stated(self) -> bool:
        """Whether the temperature was stated instead of read."""
        return self.temperature_c is not None and self.temperature_range_c is None


class PlacementEntry(Entry):
    """The repeatability of a body's placements in the attitudes that a file gives, in the unit of the readings.

    - `placement_std`: standard deviation of the readings from placement to placement that attitude errors do not
      explain; null if the method does not estimate it.
    - `rests_without_attitude`: number of rests in unknown attitudes that contributed to it.
    - `rows_omitted`: number of rows left out because the body moved.
    - `covariance`: of all estimates, in `covariance_order`.
    """

    placement_std: float | None
    placement_uncertainty: float | None
    rests_without_attitude: int
    rows_omitted: int
    covariance: Covariance
    covariance_order: tuple[str, ...]


class DetectionLimitEntry(Entry):
    """The smallest `size` of a `fault` that the `check` detects in 95 of 100 recordings; null if it detects none.

    This is the minimal detectable bias (Baarda 1968); for a change half-way through the recording, `size` is the
    complete change. `error_over_expanded` is the largest error of scale factor or bias just below that size, in
    multiples of its expanded uncertainty; null if not computed.
    """

    fault: str
    check: str
    size: float | None
    unit: str
    error_over_expanded: float | None


class OmittedEntry(Entry):
    """Parts that the solution leaves out of a recording, and the reason.

    `what` names the parts, such as rows or increments: `count` of `total` are left out. `first` is the position of the
    first one. The `reason` may begin with an error's name. `quantity` is the only quantity that is solved without them,
    null if all are.
    """

    quantity: str | None
    what: str
    count: int
    total: int
    reason: str
    first: str


class ErrorEntry(Entry):
    """The reason why a solution is missing."""

    error: str
