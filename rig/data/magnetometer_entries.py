"""What `result.json` says of magnetometers."""

from typing import Literal

from rig.data.result_types import Entry, ErrorEntry, Matrix3, Matrix6, PositiveVector3, Vector3


class FieldSolutionEntry(Entry):
    """The solution of one method."""

    method: str
    scale: PositiveVector3
    bias_t: Vector3
    matrix: Matrix3
    rank: int
    condition: float


class FieldDwellEntry(Entry):
    """A dwell: the mean reading in an attitude, its standard deviation, and what the model leaves of it.

    `attitude` takes a vector of the arm's base frame into the flange's.
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


class MagnetometerEntry(Entry):
    """A calibration m = F B + b of the magnetic field B in the axes of the nominal mounting.

    - It is that of the magnetometer as it is mounted: iron and currents that turn with it are part of F and b, and
      `hard_iron_t` is F⁻¹ b. No limit of the verdict judges it.
    - `covariance` is that of scale and bias; `field_t` what the scale factors are relative to.
    - `field_base_t` is the field in the arm's base frame, `attitude_error_rad` how far the arm's attitudes are off
      about each axis, by the readings' own account.
    - `correction_matrix` is M of B = M (m − b), in the right-angled frame nearest to the magnetometer's own axes.
    """

    part: str
    serial_number: str
    range_t: float
    model: str
    estimator: Literal["attitude_weighted"]
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
    attitude_error_rad: float
    attitude_error_std_rad: float | None
    dwells: tuple[FieldDwellEntry, ...]
    rank: int
    condition: float
    correction_matrix: Matrix3
    beside: dict[str, FieldSolutionEntry | ErrorEntry]
    warnings: tuple[str, ...]
