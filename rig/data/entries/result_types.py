"""What the entries of `result.json` are made of."""

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
    """Such rows, unless they are no square or hold a negative variance: ValueError."""
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
    """A part of the document."""

    # What a later version has added is ignored when it is read.
    model_config = ConfigDict(frozen=True, allow_inf_nan=False, defer_build=True)


class ConditionsEntry(Entry):
    """When readings were taken, from when to when (UTC, by the arm controller's clock since the recording's start).

    `mean_utc` is the middle of the readings, `temperature_c` their mean by the sensor's own thermometer, which stayed
    between the two of `temperature_range_c`; null where it has none. A temperature without range was stated, not read.
    """

    from_utc: Utc
    to_utc: Utc
    mean_utc: Utc
    temperature_c: float | None
    temperature_range_c: tuple[float, float] | None

    @property
    def temperature_stated(self) -> bool:
        """Whether nobody read the temperature that it says."""
        return self.temperature_c is not None and self.temperature_range_c is None


class PlacementEntry(Entry):
    """How a body was laid down in attitudes that a file tells, in the unit of the readings.

    `placement_std` is by how much a placement was found to change each reading beside its attitude, null where the
    method does not ask; `rests_without_attitude` rests without an attitude have told of it too. `rows_omitted` of the
    file's rows were none, for the body moved in them. `covariance` is that of all that was found, in its order.
    """

    placement_std: float | None
    placement_uncertainty: float | None
    rests_without_attitude: int
    rows_omitted: int
    covariance: Covariance
    covariance_order: tuple[str, ...]


class DetectionLimitEntry(Entry):
    """The smallest `size` of a `fault` that the `check` detects in 95 of 100 recordings; null where it detects none.

    This is the minimal detectable bias (Baarda 1968). For a change half-way it is the complete change.
    `error_over_expanded` is the largest error of a scale factor or bias just below that size, in multiples of its
    expanded uncertainty; null where it was not computed.
    """

    fault: str
    check: str
    size: float | None
    unit: str
    error_over_expanded: float | None


class OmittedEntry(Entry):
    """What was left out of a recording: `count` of `total` `what` (rows, increments, readings), where the `first` is.

    The `reason` begins with the name of an error, where there is one. `quantity` is the one that it is missing from;
    null where it is missing from all.
    """

    quantity: str | None
    what: str
    count: int
    total: int
    reason: str
    first: str


class ErrorEntry(Entry):
    """Why an estimator that stands beside the chosen one has no solution."""

    error: str
