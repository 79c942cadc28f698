"""A magnetometer's entry in `result.json`."""

from typing import Any

import numpy as np

from rig.analysis.freedom_beside import of_field_angles
from rig.analysis.magnetic_field import ESTIMATOR, MagnetometerResult
from rig.data.magnetometer_entries import (
    FieldDriftEntry,
    FieldDwellEntry,
    FieldSolutionEntry,
    MagnetometerEntry,
    UniformityEntry,
)
from rig.data.quantity import FIELD
from rig.data.result_types import ErrorEntry
from rig.errors import Fault
from rig.estimation.arrays import scale_of
from rig.estimation.magnetometer import MODEL, MagnetometerSolution
from rig.estimation.residuals import attitude_residual_std
from rig.report.axes import PARAMETERS, dwell_entry
from rig.report.budget_entry import budget_entry
from rig.report.entry import counted, entry


def magnetometer_entry(result: MagnetometerResult, **more: Any) -> MagnetometerEntry:
    """Scale, bias and covariance, beside them the other methods, and what `more` there is."""
    solution, error = result.solution, result.solution.fit.attitude_error
    assert error is not None, "the method finds it"
    expected = attitude_residual_std(solution.fit, result.seen)
    return entry(
        MagnetometerEntry, result, result.sensor, solution, solution.fit,
        model=MODEL,
        range_t=result.sensor.channel(FIELD).range,
        estimator=ESTIMATOR,
        covariance_combined=result.budget.covariance,
        budget=budget_entry(result.budget),
        covariance_order=PARAMETERS,
        covariance_units=FIELD.parameter_units,
        arm_field_in_bias=True,
        uniformity=entry(UniformityEntry, result.uniformity),
        drift=None if result.drift is None else entry(FieldDriftEntry, result.drift),
        field_base_t=solution.field_table_t,
        non_orthogonality_freedom=counted(of_field_angles(result)),
        attitude_error_rad=error.std_rad,
        attitude_error_std_rad=error.uncertainty_rad if np.isfinite(error.uncertainty_rad) else None,
        dwells=[
            dwell_entry(FieldDwellEntry, FIELD, *each)
            for each in zip(result.dwells, solution.fit.residuals, expected, strict=True)
        ],
        beside={method: _beside(found) for method, found in result.beside.items()},
        **more,
    )  # fmt: skip


def _beside(solution: MagnetometerSolution | Fault) -> FieldSolutionEntry | ErrorEntry:
    if isinstance(solution, Fault):
        return ErrorEntry(error=str(solution))
    return entry(FieldSolutionEntry, solution, solution.fit, scale=scale_of(solution.matrix))
