"""Entries of sensors of three axes that were held still in attitudes: by an arm, or in those that a file tells."""

from dataclasses import dataclass
from functools import partial
from typing import Any, Generic

import numpy as np

from rig.analysis.external.attitudes import InAttitudes
from rig.analysis.reference.acceleration import AccelerometerResult
from rig.analysis.reference.magnetic_field import MagnetometerResult
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
from rig.observation.reference.acceleration import DwellReading
from rig.observation.statistics.mean import StaticReading
from rig.report.entries.budget import budget_entry
from rig.report.entries.error import error_entry
from rig.report.entry import EntryT, entry


@dataclass(frozen=True, slots=True)
class Models(Generic[EntryT]):
    """What is written of a kind of such sensors: the `sensor`, each `dwell`, the solution of a method `beside`."""

    quantity: Quantity
    sensor: type[EntryT]
    dwell: type[Entry]
    beside: type[Entry]


OF_ACCELEROMETERS = Models(ACCELERATION, AccelerometerEntry, DwellEntry, AccelerationSolutionEntry)
OF_MAGNETOMETERS = Models(FIELD, MagnetometerEntry, FieldDwellEntry, FieldSolutionEntry)


def triad_entry(
    models: Models[EntryT],
    result: AccelerometerResult | MagnetometerResult | InAttitudes,
    sensor: RecordedSensor | Item,
    left: tuple[Array, Array],
    **more: Any,
) -> EntryT:
    """Scale, bias and covariance, the other methods beside them, the dwells, and what `more` there is of the kind.

    `left` (N, 3) each is what the model leaves of the dwells, and what it is expected to leave.
    """
    budget, dwells = result.budget, tuple[DwellReading | StaticReading, ...](result.dwells)
    return entry(
        models.sensor, result, sensor, result.triad, result.solution,
        covariance_combined=budget.covariance,
        budget=budget_entry(budget),
        covariance_order=PARAMETERS,
        covariance_units=models.quantity.parameter_units,
        **_attitude_error(result.solution.attitude_error),
        dwells=[_dwell_entry(models, *each) for each in zip(dwells, left[0], left[1], strict=True)],
        other_methods=result.beside.by_key(partial(_beside_entry, models), error_entry),
        **more,
    )  # fmt: skip


def attitudes_entry(
    models: Models[EntryT], result: MagnetometerResult | InAttitudes, sensor: RecordedSensor | Item, **more: Any
) -> EntryT:
    """The entry of a sensor that attitudes alone tell of."""
    solution = result.solution
    left = solution.residuals, attitude_residual_std(solution, result.seen)
    bias = {models.quantity.named("bias"): solution.bias}
    return triad_entry(models, result, sensor, left, estimator=solution.method, **bias, **more)


def _attitude_error(error: AttitudeError | None) -> dict[str, float | None]:
    """How far the attitudes are off about each axis, and how well that is known; none by a method that holds them."""
    if error is None:
        return {"attitude_error_rad": None, "attitude_error_std_rad": None}
    known = error.uncertainty_rad if np.isfinite(error.uncertainty_rad) else None
    return {"attitude_error_rad": error.std_rad, "attitude_error_std_rad": known}


def _beside_entry(models: Models[Any], other: TriaxialSolution) -> Entry:
    """Return the entry of another method's solution."""
    return entry(models.beside, other, scale=scale_of(other.matrix), **{models.quantity.named("bias"): other.bias})


def _dwell_entry(
    models: Models[Any], dwell: DwellReading | StaticReading, residual: Array, residual_std: Array
) -> Entry:
    """A dwell: `residual` (3,) is what the model leaves, `residual_std` (3,) what it is expected to leave."""
    quantity, read = models.quantity, dwell.reading
    return entry(
        models.dwell, dwell, read,
        duration_s=dwell.window.end_s - dwell.window.start_s,
        **{
            quantity.named("mean"): read.mean,
            quantity.named("mean_std"): np.sqrt(read.variance),
            quantity.named("noise"): read.noise,
            quantity.named("residual"): residual,
            quantity.named("residual_std"): residual_std,
        },
    )  # fmt: skip
