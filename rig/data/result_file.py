"""The model by which `result.json` is written and read; the source of docs/result.schema.json.

SI units, the unit in every name; vectors and matrices are lists, rows first. Keys are in the order of the fields.
"""

import json
from pathlib import Path
from typing import Annotated, Any, Final, Literal, Self

from pydantic import AfterValidator, ConfigDict, Field, JsonValue, model_validator

from rig.config.files.safe_writing import write_new
from rig.config.judging.verdict_limits import Kind, Parameter
from rig.config.section import SensorName
from rig.data.entries.accelerometer import AccelerometerEntry
from rig.data.entries.bias_drift import DriftEntry
from rig.data.entries.budget import BiasProcessEntry, BudgetEntry, ClockEntry
from rig.data.entries.by_hand import ByHandEntry
from rig.data.entries.earth_rate import EarthRateEntry
from rig.data.entries.external import AnglesEntry, AttitudesEntry
from rig.data.entries.magnetometer import MagnetometerEntry
from rig.data.entries.result_types import (
    ConditionsEntry,
    DetectionLimitEntry,
    Entry,
    ErrorEntry,
    Freedom3,
    Matrix3,
    Matrix6,
    OmittedEntry,
    Positive,
    PositiveVector3,
    Role,
    Utc,
    Vector2,
    Vector3,
    Vector6,
    covariance,
)
from rig.data.entries.temperature import OverTemperatureEntry
from rig.data.installed_kinds import quantities
from rig.data.key_meanings import meaning_of
from rig.data.meaning import Meaning
from rig.data.run_folder import CONFIG, RESULT
from rig.data.validation import OfJoints, read_document
from rig.errors import Refused

SCHEMA: Final = "rig.result/1"
SIZE_MAX_BYTES = 16_000_000  # a run of six sweeps with its verification has 66,000


def _check_quantity(quantity: str) -> str:
    if quantity not in quantities():
        raise ValueError(f"is not a quantity of the rig or of a package installed here: {', '.join(quantities())}")
    return quantity


QuantityName = Annotated[str, AfterValidator(_check_quantity)]


class CheckEntry(Entry):
    """One check of the verdict; `value` is null if nothing was measured, `limit` if none was set.

    - uncertainty, coverage_factor: U of the value and its k, if any; guard_band: distance from the limit that the
      decision rule requires; false_acceptance_probability: probability that an accepted value is beyond the limit.
    - kind: conformity of a property of the item, or fitness of the measurement for use; sensor, quantity, parameter:
      the subject, if a single one; sweep: a sweep that contradicts the others; criterion: the name of the judged
      quantity, null if the package that adds the check names none.
    """

    name: str
    value: float | None
    limit: float | None
    unit: str
    passed: bool
    uncertainty: float | None = None
    guard_band: float = 0.0
    false_acceptance_probability: float | None = None
    coverage_factor: float | None = None
    kind: Kind
    sensor: str | None = None
    quantity: str | None = None
    parameter: Parameter | None = None
    sweep: int | None = None
    criterion: str | None = None

    @property
    def means(self) -> Meaning:
        """Meaning of the check."""
        return Meaning(self.kind, self.sensor, self.quantity, self.parameter, self.sweep, self.criterion)


class StoredPolynomialsEntry(Entry):
    """Changes of a stored calibration with temperature: rows for (T − `temperature_c`)ⁿ, n from 1 to 3, by axis.

    `scale_change` is added to 1 and multiplies m + b, `bias_change_rad_s` is added to b. Beyond `range_c` the values at
    its ends apply.
    """

    range_c: Vector2
    scale_change: Matrix3
    bias_change_rad_s: Matrix3


class StoredCalibrationEntry(Entry):
    """A calibration stored on the board, which corrected its readings: g = `matrix` (m + b), else K (m + b)."""

    sequence: int
    part: str
    who_am_i: int
    range_deg_s: float
    model: str
    serial_number: str
    written_utc: str
    temperature_c: float
    scale: Vector3
    bias_rad_s: Vector3
    matrix: Matrix3 | None = None
    over_temperature: StoredPolynomialsEntry | None = None


class KinematicsEntry(Entry):
    """The Denavit–Hartenberg parameters of the turner, joint 0 at the ground, as used in the calculation."""

    theta_rad: OfJoints
    a_m: OfJoints
    d_m: OfJoints
    alpha_rad: OfJoints


class FileEntry(Entry):
    """An input file: its name, and its SHA-256 in hexadecimal."""

    name: str
    sha256: str


class ProvenanceEntry(Entry):
    """The provenance of a result. Later versions may add to it.

    `readings_file` and `motion_file` are the files of external readings, which have no arm and no board.
    """

    model_config = ConfigDict(frozen=True, extra="allow", defer_build=True)
    # Pydantic's own way to type the extra keys; it is None in models without any.
    __pydantic_extra__: dict[str, JsonValue] = Field(init=False)  # pyrefly: ignore[bad-override]

    started_utc: Utc
    rig_version: str
    python_version: str
    package_versions: dict[str, str]
    configuration_sha256: str
    arm_serial_number: str
    arm_software: str
    board_unique_id: str
    firmware_version: str
    sensor_serial_numbers: dict[str, str]
    stored_calibrations: dict[str, StoredCalibrationEntry]
    resumed_utc: tuple[Utc, ...]
    verified_utc: tuple[Utc, ...]
    solved_utc: Utc
    arm_kinematics: KinematicsEntry | None = None
    tcp_offset: Vector6 | None = None
    arm_maker: str | None = None
    arm_model: str | None = None
    turner_kind: str | None = None
    board_follows_crystal: bool | None = None
    readings_file: FileEntry | None = None
    motion_file: FileEntry | None = None


class EstimateEntry(Entry):
    """One estimator's solution; `covariance` in the order kx ky kz bx by bz, its units 1 and rad/s."""

    estimator: str
    iterations: int
    scale: PositiveVector3
    bias_rad_s: Vector3
    covariance: Matrix6
    observations_used: int
    rank: int
    condition: float


class VectorEntry(Entry):
    """The vector model's solution: the six parameters, and the directions of the three axes.

    - residuals_std_rad_s: expected standard deviation of each residual.
    - …_degrees_of_freedom: those of the standard deviations with the same beginning of the name, null if infinite.
    - The residuals' deviations and all degrees of freedom are absent without a budget, as for a file of sweeps.
    """

    model: str
    estimator: str
    iterations: int
    scale: PositiveVector3
    bias_rad_s: Vector3
    covariance: Matrix6
    observations_used: int
    rank: int
    condition: float
    matrix: Matrix3
    matrix_covariance: Annotated[tuple[tuple[float, ...], ...], Field(min_length=9), AfterValidator(covariance)]
    matrix_covariance_order: tuple[str, ...]
    non_orthogonality_rad: Vector3
    non_orthogonality_std_rad: Vector3
    non_orthogonality_order: tuple[str, str, str]
    mounting: Matrix3
    mounting_std_rad: Vector3
    g_sensitivity_rad_s_per_m_s2: Matrix3 | None = None
    g_sensitivity_std_rad_s_per_m_s2: Matrix3 | None = None
    residuals_rad_s: tuple[Vector3, ...]
    warnings: tuple[str, ...]
    residuals_std_rad_s: tuple[Vector3, ...] | None = None
    non_orthogonality_degrees_of_freedom: Freedom3 | None = None
    mounting_degrees_of_freedom: Freedom3 | None = None
    g_sensitivity_degrees_of_freedom: tuple[Freedom3, Freedom3, Freedom3] | None = None


class NonlinearityEntry(Entry):
    """Nonlinearity of each axis: a rate g along it, in rad/s, reads (g + odd |g| g + even g²) / scale − bias."""

    odd_per_rad_s: Vector3
    odd_std_per_rad_s: Vector3
    even_per_rad_s: Vector3
    even_std_per_rad_s: Vector3


class AverageEntry(Entry):
    """A rest: the mean reading, and the standard deviations of the mean and of one sample."""

    mean_rad_s: Vector3
    mean_std_rad_s: Vector3
    noise_rad_s: Vector3
    samples: int
    duration_s: float
    temperature_c: float | None = None


class ObservationEntry(Entry):
    """One revolution, its mean reading, and its joint if an arm made it.

    `angle_rad` is the angle turned: a multiple of 2π, or an arc as the encoders measure it; null for a file of speeds.
    """

    sweep: int
    joint: str | None = None
    direction: str | None = None
    axis: Literal["x", "y", "z"]
    sign: Literal[1, -1]
    axis_flange: Vector3
    speed_rad_s: float
    angle_rad: float | None = None
    speed_std_rad_s: float
    lost_samples: int
    mean_rad_s: Vector3
    mean_std_rad_s: Vector3
    noise_rad_s: Vector3
    samples: int
    duration_s: float
    temperature_c: float | None = None


class TimeBaseEntry(Entry):
    """The board's clock: controller time = board time + offset + drift × (board time − reference)."""

    offset_s: float
    offset_std_s: float
    drift: float
    drift_std: float
    reference_board_s: float


class BoardSolutionEntry(Entry):
    """The board's solution by one method, in single precision."""

    sensor: str
    method: str
    status: str
    observations: int
    iterations: int
    scale: Vector3
    bias_rad_s: Vector3


class BoardEntry(Entry):
    """The board's own solutions, by method, and the host's solution, computed in double precision for comparison.

    `scale_difference` and `bias_difference_rad_s` are the largest differences, on any axis, between the host's solution
    and the board's solution in closed form.
    """

    solutions: dict[str, BoardSolutionEntry]
    not_observed: tuple[str, ...]
    host_scale: Vector3 | None
    host_bias_rad_s: Vector3 | None
    scale_difference: float | None
    bias_difference_rad_s: float | None


class GyroscopeEntry(Entry):
    """A sensor's calibration by the chosen estimator, its observations, and the solutions of the other estimators.

    - covariance: due to noise and bias random walk; covariance_combined: due to all contributors in the budget.
    - correction_matrix: M of g = M (m + b), by which the board and the C header correct readings.
    - speeds_rad_s: the speeds of the sweeps. Sweeps at one speed do not show the nonlinearity, so the calibration is
      then valid only at that speed, in both directions. axis_rate_ranges_rad_s: smallest and largest rate along each of
      the sensor's axes in the sweeps that determine its scale factor.
    - temperature_c: mean over the samples of all sweeps. scale_conditions: times and temperatures of the sweeps, from
      which the scale factors come. bias_conditions: those of sweeps and rests, from which the biases come.
    - board: the board's own solutions; null for a reference sensor, for which the board does not solve.
    - earth_rate: the Earth's rate, or the reason why it is missing; null if it was not requested.
    - detection_limits: faults during the recording, and the sizes from which they are detected.
    - in_attitudes: the solution in attitudes, only if a file gave these; range and temperature are then null.
    - by_angles: only if a file's sweeps were solved from the angle turned. by_hand: only if a hand turned the sensor.
    """

    part: str
    serial_number: str
    range_rad_s: Positive | None = None
    role: Role
    model: str
    estimator: str
    iterations: int
    scale: PositiveVector3
    bias_rad_s: Vector3
    covariance: Matrix6
    observations_used: int
    rank: int
    condition: float
    covariance_order: tuple[str, ...]
    covariance_units: tuple[str, ...]
    temperature_c: float | None
    observations: tuple[ObservationEntry, ...]
    rests: tuple[AverageEntry, ...]
    time_bases: tuple[TimeBaseEntry, ...]
    vector_model: VectorEntry | ErrorEntry
    six_observation: EstimateEntry | ErrorEntry
    algorithm_1: EstimateEntry | ErrorEntry
    board: BoardEntry | None = None
    covariance_combined: Matrix6 | None = None
    budget: BudgetEntry | None = None
    bias_process: BiasProcessEntry | None = None
    speeds_rad_s: tuple[float, ...] = ()
    nonlinearity: NonlinearityEntry | None = None
    correction: Literal["matrix", "diagonal"]
    correction_matrix: Matrix3
    earth_rate: EarthRateEntry | ErrorEntry | None = None
    scale_conditions: ConditionsEntry | None = None
    bias_conditions: ConditionsEntry | None = None
    axis_rate_ranges_rad_s: tuple[Vector2, Vector2, Vector2] | None = None
    detection_limits: tuple[DetectionLimitEntry, ...] = ()
    in_attitudes: AttitudesEntry | None = None
    by_angles: AnglesEntry | None = None
    by_hand: ByHandEntry | None = None


class RotationEntry(Entry):
    """The rotation between two sensors: `matrix` takes a vector of the reference's frame into the sensor's."""

    matrix: Matrix3
    vector_rad: Vector3
    from_nominal_rad: Vector3
    std_rad: Vector3
    residuals_rad_s: tuple[Vector3, ...]


class DeviationEntry(Entry):
    """Reading minus reference over several samples, axis by axis."""

    samples: int
    mean_rad_s: Vector3
    rms_rad_s: Vector3
    mse_rad2_s2: Vector3
    max_rad_s: Vector3


class RevolutionErrorEntry(Entry):
    """The error of one revolution or arc: mean reading minus mean reference.

    `angle_rad` is the angle turned. `gravity_rad_s` is the part of the error that gravity and the centripetal
    acceleration cause; null if no calibration determines it.
    """

    sweep: int
    joint: str
    direction: str
    error_rad_s: Vector3
    std_rad_s: Vector3
    gravity_rad_s: Vector3 | None = None
    angle_rad: float


class ComparisonEntry(Entry):
    """A sensor's readings compared with the reference's, over all movements, over sweeps, and by revolution.

    `noise_rad_s` is the standard deviation of their difference at rest, null without rests. `delay_s` is the delay of
    the sensor behind the reference in each recording.
    """

    movement: DeviationEntry
    sweeps: DeviationEntry
    noise_rad_s: Vector3 | None
    revolutions: tuple[RevolutionErrorEntry, ...]
    delay_s: tuple[float, ...]
    delay_std_s: tuple[float, ...]

    @model_validator(mode="after")
    def _one_each(self) -> Self:
        if len(self.delay_s) != len(self.delay_std_s):
            raise ValueError("delay_s and delay_std_s must be as many")
        return self


class VerificationEntry(Entry):
    """A sensor compared with its reference, in the sensor's frame, before and after calibration.

    `before` is null if only calibrated readings were recorded.
    """

    reference: str
    reference_scale: Vector3
    reference_bias_rad_s: Vector3
    reference_error_rad_s: float
    rotation: RotationEntry
    before: ComparisonEntry | None
    after: ComparisonEntry


class MountEntry(Entry):
    """The error of the item's mounting in a stage (counted from 1): its rotation from the nominal mounting.

    The mounting in the first stage counts as exact. `rotation_rad` is a rotation vector in the item's frame, `std_rad`
    has the standard deviations of its components.
    """

    stage: int
    rotation_rad: Vector3
    std_rad: Vector3


class ResultDocument(Entry):
    """The result of a run, of schema "rig.result/1".

    - gyroscopes: empty for a verification of stored calibrations, and without sweeps; accelerometers, magnetometers:
      the calibrations, or the reasons why recorded sensors have none.
    - bias_drift: biases by repeat of a run of that procedure, by sensor, then by "rate" and "acceleration".
    - over_temperature: calibrations over temperature, keyed in the same way; all other results then refer to their
      reference temperature.
    - unsolved: why a quantity has no solution, by sensor, then by the quantity's name.
    - omitted: parts left out of external readings; notes: remarks on how they were read.
    - others: results of kinds that packages add, by the kind's key, in the package's own format.
    - mounts: the error of the item's mounting in each stage of a run except the first.

    Sensors' names follow the rules of a configuration, because they become names of files.
    """

    schema_name: Literal["rig.result/1"] = Field(alias="schema")  # as SCHEMA
    verdict: Literal["pass", "fail"]
    checks: tuple[CheckEntry, ...]
    provenance: ProvenanceEntry
    clock: ClockEntry | None = None
    gyroscopes: dict[SensorName, GyroscopeEntry]
    verification: dict[SensorName, VerificationEntry]
    accelerometers: dict[SensorName, AccelerometerEntry] = Field(default_factory=dict)
    magnetometers: dict[SensorName, MagnetometerEntry | ErrorEntry] = Field(default_factory=dict)
    bias_drift: dict[SensorName, dict[QuantityName, DriftEntry]] = Field(default_factory=dict)
    over_temperature: dict[SensorName, dict[QuantityName, OverTemperatureEntry]] = Field(default_factory=dict)
    unsolved: dict[SensorName, dict[str, ErrorEntry]] = Field(default_factory=dict)
    omitted: dict[SensorName, tuple[OmittedEntry, ...]] = Field(default_factory=dict)
    notes: dict[SensorName, tuple[str, ...]] = Field(default_factory=dict)
    others: dict[str, dict[SensorName, JsonValue]] = Field(default_factory=dict)
    mounts: tuple[MountEntry, ...] = ()

    def text(self) -> str:
        """Return the result as JSON, without unset fields."""
        return json.dumps(self.model_dump(by_alias=True, exclude_unset=True), indent=2, allow_nan=False)


def schema_text() -> str:
    """Return the JSON schema of `result.json`, as in docs/result.schema.json."""
    schema: dict[str, Any] = {
        "$schema": "https://json-schema.org/draft/2020-12/schema",
        **ResultDocument.model_json_schema(),
    }
    for name, entry in {"ResultDocument": schema, **schema["$defs"]}.items():
        for key, described in entry.get("properties", {}).items():
            described["description"] = meaning_of(name.removesuffix("Entry"), key)
    return json.dumps(schema, indent=2, ensure_ascii=False) + "\n"


def write_result(document: ResultDocument, folder: Path) -> None:
    """Write `result.json`, which ends the run, into a run folder, completely or not at all."""
    write_new(folder / RESULT, document.text() + "\n")


def read_result(path: Path) -> ResultDocument:
    """Return the `result.json` of a run folder, or at `path` itself. Raise Refused `no_result`, `not_a_result`."""
    remedy = "Give a run folder, its result.json, or latest"
    if (path / CONFIG).is_file() and not (path / RESULT).exists():
        remedy = "The run was not finished: go on with rig resume RUN, or solve what was recorded with rig solve RUN"
    return read_document(ResultDocument, _file(path), SIZE_MAX_BYTES, what="a run", remedy=remedy)


def read_passed_result(path: Path) -> ResultDocument:
    """Return a result whose verdict is a pass. Raise Refused `no_result`, `not_a_result`, `verdict_failed`."""
    result = read_result(path)
    if result.verdict != "pass":
        failed = ", ".join(check.name for check in result.checks if not check.passed)
        raise Refused(
            "verdict_failed",
            f"the run in {_file(path)} failed its verdict ({failed})",
            "Remove the cause and calibrate again",
        )
    return result


def _file(path: Path) -> Path:
    return path / RESULT if path.is_dir() else path


if __name__ == "__main__":
    print(schema_text(), end="")
