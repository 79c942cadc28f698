"""Entries of three-axis sensors that were measured at rest, in attitudes that an arm or a file states."""

from dataclasses import dataclass
from functools import partial
from typing import Any, Generic

import numpy as np

from rig.analysis.external.attitudes import AttitudeCalibration
from rig.analysis.reference.accelerometer import AccelerometerResult
from rig.analysis.reference.magnetometer import MagnetometerResult
from rig.data.entries.accelerometer import AccelerationSolutionEntry, AccelerometerEntry, DwellEntry
from rig.data.entries.magnetometer import FieldDwellEntry, FieldSolutionEntry, MagnetometerEntry
from rig.data.entries.result_types import Entry
from rig.data.quantity import ACCELERATION, FIELD, Quantity
from rig.data.recording.motion_file import Item
from rig.data.recording.recorded_sensor import RecordedSensor
from rig.estimation.arrays import Array, scale_of
from rig.estimation.gyroscope.six_observation import PARAMETERS
from rig.estimation.reference.attitude_error import AttitudeError
from rig.estimation.reference.triaxial import TriaxialSolution
from rig.estimation.residuals import attitude_residual_std
from rig.observation.reference.dwell_acceleration import DwellReading
from rig.observation.statistics.mean import StaticReading
from rig.report.entries.budget import budget_entry
from rig.report.entry import EntryT, entry, error_entry, finite_or_none


@dataclass(frozen=True, slots=True)
class Models(Generic[EntryT]):
    """Entry classes for one quantity: of the `sensor`, of a `dwell`, and of `other` methods' solutions."""

    quantity: Quantity
    sensor: type[EntryT]
    dwell: type[Entry]
    other: type[Entry]


ACCELEROMETER_MODELS = Models(ACCELERATION, AccelerometerEntry, DwellEntry, AccelerationSolutionEntry)
MAGNETOMETER_MODELS = Models(FIELD, MagnetometerEntry, FieldDwellEntry, FieldSolutionEntry)


def triad_entry(
    models: Models[EntryT],
    result: AccelerometerResult | MagnetometerResult | AttitudeCalibration,
    sensor: RecordedSensor | Item,
    residuals: tuple[Array, Array],
    **more: Any,
) -> EntryT:
    """Return a sensor's entry: scale, bias, covariance, other methods' solutions, dwells, and the fields `more`.

    `residuals` are two arrays (N, 3): the residuals of the dwells and their expected standard deviations.
    """
    budget, dwells = result.budget, tuple[DwellReading | StaticReading, ...](result.dwells)
    return entry(
        models.sensor, result, sensor, result.triad, result.solution,
        covariance_combined=budget.covariance,
        budget=budget_entry(budget),
        covariance_order=PARAMETERS,
        covariance_units=models.quantity.parameter_units,
        **_attitude_error(result.solution.attitude_error),
        dwells=[_dwell_entry(models, *row) for row in zip(dwells, *residuals, strict=True)],
        other_methods=result.other_methods.results_by_key(partial(_other_entry, models), error_entry),
        **more,
    )  # fmt: skip


def attitudes_entry(
    models: Models[EntryT], result: MagnetometerResult | AttitudeCalibration, sensor: RecordedSensor | Item, **more: Any
) -> EntryT:
    """Return the entry of a sensor that was calibrated in attitudes alone."""
    solution = result.solution
    residuals = solution.residuals, attitude_residual_std(solution, result.measurements)
    bias = {models.quantity.file_key("bias"): solution.bias}
    return triad_entry(models, result, sensor, residuals, estimator=solution.method, **bias, **more)


def _attitude_error(error: AttitudeError | None) -> dict[str, float | None]:
    """Return the estimated error of the attitudes and its uncertainty, rad about each axis; None if not estimated."""
    if error is None:
        return {"attitude_error_rad": None, "attitude_error_std_rad": None}
    return {
        "attitude_error_rad": error.std_rad,
        "attitude_error_std_rad": finite_or_none(error.uncertainty_rad),
    }


def _other_entry(models: Models[Any], other: TriaxialSolution) -> Entry:
    """Return the entry of a solution by a method other than the chosen one."""
    return entry(models.other, other, scale=scale_of(other.matrix), **{models.quantity.file_key("bias"): other.bias})


def _dwell_entry(
    models: Models[Any], dwell: DwellReading | StaticReading, residual: Array, residual_std: Array
) -> Entry:
    """Return a dwell with its `residual` (3,) and the residual's expected standard deviation `residual_std` (3,)."""
    quantity, read = models.quantity, dwell.reading
    return entry(
        models.dwell, dwell, read,
        duration_s=dwell.window.end_s - dwell.window.start_s,
        **{
            quantity.file_key("mean"): read.mean,
            quantity.file_key("mean_std"): np.sqrt(read.variance),
            quantity.file_key("noise"): read.noise,
            quantity.file_key("residual"): residual,
            quantity.file_key("residual_std"): residual_std,
        },
    )  # fmt: skip
