"""What the entries of `result.json` are made of."""

from typing import Annotated, Literal

from pydantic import BaseModel, ConfigDict, Field

Positive = Annotated[float, Field(gt=0)]
Vector3 = tuple[float, float, float]
Vector6 = tuple[float, float, float, float, float, float]
PositiveVector3 = tuple[Positive, Positive, Positive]
Matrix3 = tuple[Vector3, Vector3, Vector3]
Matrix6 = Annotated[tuple[Vector6, ...], Field(min_length=6, max_length=6)]
Role = Literal["calibrate", "reference"]


class Entry(BaseModel):
    """A part of the document."""

    # What a later version has added is ignored when it is read.
    model_config = ConfigDict(frozen=True, allow_inf_nan=False)


class ErrorEntry(Entry):
    """Why an estimator that stands beside the chosen one has no solution."""

    error: str
