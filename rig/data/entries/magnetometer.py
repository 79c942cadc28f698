"""Magnetometers in `result.json`."""

import json
from pathlib import Path
from typing import Final, Literal

from pydantic import Field

from rig.data.entries.budget import BudgetEntry
from rig.data.entries.result_types import (
    ConditionsEntry,
    DetectionLimitEntry,
    Entry,
    ErrorEntry,
    Freedom3,
    Matrix3,
    Matrix6,
    Method,
    PlacementEntry,
    PositiveVector3,
    Utc,
    Vector3,
)
from rig.data.validation import read_document

REVERSAL_MAX_BYTES: Final = 4_000_000  # a file of two runs has 4,000


class FieldSolutionEntry(Entry):
    """The solution of one method."""

    method: str
    scale: PositiveVector3
    bias_t: Vector3
    matrix: Matrix3
    rank: int
    condition: float


class FieldDwellEntry(Entry):
    """A dwell: the mean reading in an attitude, its standard deviation, and its residual from the model.

    `residual_std_t` is the residual's expected standard deviation. `attitude` takes a vector of the arm's base frame
    into the flange's.
    """

    index: int
    name: str
    attitude: Matrix3
    mean_t: Vector3
    mean_std_t: Vector3
    noise_t: Vector3
    residual_t: Vector3
    samples: int
    duration_s: float
    residual_std_t: Vector3


class UniformityEntry(Entry):
    """A test that the field is the same in all attitudes: χ² of the residuals, with its critical value.

    `attitude_error_rad` is the error of the attitudes about each axis that the test allows for: an upper bound (2σ)
    from an accelerometer.
    """

    chi_square: float
    degrees_of_freedom: int
    limit: float
    attitude_error_rad: float


class FieldDriftEntry(Entry):
    """The largest change of the readings between two tests in one attitude, its σ, its χ² and the critical value."""

    change_t: Vector3
    std_t: Vector3
    chi_square: float
    limit: float


class MagnetometerEntry(Entry):
    """A calibration m = F B + b of the magnetic field B in the axes of the nominal mounting.

    - Iron and currents that turn with the magnetometer are part of F and b, so no limits judge them; hard_iron_t is
      F⁻¹ b.
    - arm_field_in_bias: whether the bias contains the arm's own field that turns with the flange, which no residual
      shows; a run with the sensor turned over separates the two (`rig reversal`).
    - extension_m: the magnetometer's position on the flange; uniformity: test that the field was the same in all
      attitudes; drift: test that it remained the same, null without tests.
    - covariance: of scale and bias, from the solution alone; covariance_combined: from all contributors in budget.
      field_t: the norm of the field to which the scale is relative.
    - field_base_t: the field in the arm's base frame; attitude_error_rad: error of the arm's attitudes about each axis,
      estimated from the readings.
    - detection_limits: faults during the recording, and the sizes from which they are detected.
    - conditions: times of the readings; non_orthogonality_degrees_of_freedom: null if infinite.
    - placement: errors of the placements, if a file gave the attitudes; range_t is then null.
    - correction_matrix: M of B = M (m − b), in the right-angled frame nearest to the magnetometer's own axes.
    """

    part: str
    serial_number: str
    range_t: float | None = None
    model: str
    estimator: Method
    arm_field_in_bias: bool
    extension_m: Vector3 = (0.0, 0.0, 0.0)
    uniformity: UniformityEntry | None = None
    drift: FieldDriftEntry | None = None
    field_t: float
    scale: PositiveVector3
    bias_t: Vector3
    covariance: Matrix6
    covariance_order: tuple[str, ...]
    covariance_units: tuple[str, ...]
    matrix: Matrix3
    hard_iron_t: Vector3
    non_orthogonality_rad: Vector3
    non_orthogonality_std_rad: Vector3
    field_base_t: Vector3
    attitude_error_rad: float | None
    attitude_error_std_rad: float | None
    dwells: tuple[FieldDwellEntry, ...]
    rank: int
    condition: float
    correction_matrix: Matrix3
    other_methods: dict[str, FieldSolutionEntry | ErrorEntry]
    warnings: tuple[str, ...]
    covariance_combined: Matrix6
    budget: BudgetEntry
    conditions: ConditionsEntry | None = None
    non_orthogonality_degrees_of_freedom: Freedom3 | None = None
    detection_limits: tuple[DetectionLimitEntry, ...] = ()
    placement: PlacementEntry | None = None


class AsMountedEntry(Entry):
    """One run of a reversal: the sensor's mounting, and its bias, which includes the arm's field."""

    run: str
    started_utc: Utc
    mounting: Matrix3
    bias_t: Vector3
    bias_std_t: Vector3
    field_base_t: Vector3


class ReversalEntry(Entry):
    """A magnetometer's bias and the arm's field, separated by turning the sensor over.

    - bias_t: the sensor's own bias; on an axis that was never turned over (arm_field_in_bias) the bias as mounted.
    - arm_field_t: the arm's field in the sensor's axes as it was mounted in the first run; 0 on such an axis.
    - covariance: of bias and arm's field; chi_square: agreement of the runs on their common parameters.
    - scale, correction_matrix: means over the runs. …_degrees_of_freedom: of the standard deviation of that name, null
      if infinite.
    """

    part: str
    serial_number: str
    scale: PositiveVector3
    scale_std: Vector3
    bias_t: Vector3
    bias_std_t: Vector3
    arm_field_in_bias: tuple[bool, bool, bool]
    arm_field_t: Vector3
    arm_field_std_t: Vector3
    covariance: Matrix6
    correction_matrix: Matrix3
    chi_square: float
    degrees_of_freedom: int
    limit: float
    runs: tuple[AsMountedEntry, ...]
    scale_degrees_of_freedom: Freedom3
    bias_degrees_of_freedom: Freedom3
    arm_field_degrees_of_freedom: Freedom3


class ReversalDocument(Entry):
    """The result of `rig reversal`, by magnetometer, of schema "rig.reversal/1"."""

    schema_name: Literal["rig.reversal/1"] = Field(alias="schema")
    magnetometers: dict[str, ReversalEntry]

    def text(self) -> str:
        """Return the document as JSON."""
        return json.dumps(self.model_dump(by_alias=True), indent=2, allow_nan=False)


def read_reversal(path: Path) -> ReversalDocument:
    """Return the document that `rig reversal … --out` wrote. Raise Refused `no_result`, `not_a_result`."""
    remedy = "Give the file of `rig reversal RUN RUN --out FILE`"
    return read_document(ReversalDocument, path, REVERSAL_MAX_BYTES, what="a reversal", remedy=remedy)
