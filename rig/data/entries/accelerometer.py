"""Accelerometers in `result.json`."""

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
    Role,
    Vector3,
)


class AccelerationSolutionEntry(Entry):
    """The solution of one method from the dwells alone."""

    method: str
    scale: PositiveVector3
    bias_m_s2: Vector3
    matrix: Matrix3
    rank: int
    condition: float


class DwellEntry(Entry):
    """A dwell: the mean reading in an attitude, its standard deviation, and its residual from the model.

    `residual_std_m_s2` is the residual's expected standard deviation. `attitude` takes a vector of the arm's base frame
    into the flange's.
    """

    index: int
    name: str
    attitude: Matrix3
    mean_m_s2: Vector3
    mean_std_m_s2: Vector3
    noise_m_s2: Vector3
    residual_m_s2: Vector3
    samples: int
    duration_s: float
    temperature_c: float | None = None
    residual_std_m_s2: Vector3


class ValidationEntry(Entry):
    """The error of the specific force's norm in the last repeat of the attitudes, not used for the calibration."""

    dwells: int
    rms_m_s2: float
    max_m_s2: float


class AlignmentEntry(Entry):
    """The small rotation vector that takes the gyroscope's frame into the frame of the same device's accelerometer."""

    rotation_rad: Vector3
    std_rad: Vector3


class AccelerometerEntry(Entry):
    """A calibration of readings a = F (s + φ s²) + b of the specific force s in the flange's frame.

    - matrix, second_order_s2_m, bias_m_s2: F, φ and b.
    - covariance: of scale and bias, from the solution alone; covariance_combined: from all contributors in budget.
    - gravity_m_s2: the gravity to which the scale is relative.
    - scale, bias_m_s2: if the budget contains the nonlinearity, the scale is that between the readings at +1 g and −1
      g, and the bias is the reading at 0 g.
    - reference_m_s2: specific force at rest in the arm's base frame; attitude_error_rad: error of the arm's attitudes
      about each axis, estimated from the readings.
    - lever_arm_m: from the axis of the sweeps to the sensor, in the flange's frame; delay_s: the sensor's lag behind
      the gyroscope; both are null without sweeps.
    - detection_limits: faults during the recording, and the sizes from which they are detected.
    - conditions: times and temperature (temperature_c) of the readings for scale and bias.
    - …_degrees_of_freedom: degrees of freedom of the standard deviations of that name, null if infinite.
    - placement: errors of the placements, if a file gave the attitudes; range_m_s2 and temperature are then null.
    - correction_matrix: M of s = M (a − b), first order: with an alignment in the frame of the gyroscope's corrected
      rates (whole matrix), else in the right-angled frame nearest to the accelerometer's own axes.
    """

    part: str
    serial_number: str
    range_m_s2: float | None = None
    role: Role
    model: str
    estimator: Method
    gravity_m_s2: float
    scale: PositiveVector3
    bias_m_s2: Vector3
    covariance: Matrix6
    covariance_order: tuple[str, ...]
    covariance_units: tuple[str, ...]
    matrix: Matrix3
    non_orthogonality_rad: Vector3
    non_orthogonality_std_rad: Vector3
    second_order_s2_m: Vector3 | None
    second_order_std_s2_m: Vector3 | None
    reference_m_s2: Vector3
    attitude_error_rad: float | None
    attitude_error_std_rad: float | None
    lever_arm_m: Vector3 | None
    lever_arm_std_m: Vector3 | None
    delay_s: float | None
    delay_std_s: float | None
    alignment: AlignmentEntry | None
    dwells: tuple[DwellEntry, ...]
    sweeps: int
    rank: int
    condition: float
    temperature_c: float | None
    correction_matrix: Matrix3
    other_methods: dict[str, AccelerationSolutionEntry | ErrorEntry]
    validation: ValidationEntry | None
    warnings: tuple[str, ...]
    covariance_combined: Matrix6
    budget: BudgetEntry
    conditions: ConditionsEntry | None = None
    non_orthogonality_degrees_of_freedom: Freedom3 | None = None
    second_order_degrees_of_freedom: Freedom3 | None = None
    detection_limits: tuple[DetectionLimitEntry, ...] = ()
    placement: PlacementEntry | None = None
