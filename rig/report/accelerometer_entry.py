"""An accelerometer's entry in `result.json`."""

from typing import Any

import numpy as np

from rig.analysis.acceleration import AccelerometerResult, HeldOut
from rig.analysis.freedom_beside import of_acceleration_angles, of_second_order
from rig.data.accelerometer_entries import (
    AccelerometerEntry,
    AlignmentEntry,
    DwellEntry,
    HeldOutEntry,
    InAttitudesEntry,
)
from rig.data.quantity import ACCELERATION
from rig.data.result_types import ErrorEntry
from rig.errors import Fault
from rig.estimation.accelerometer_model import DELAY, SECOND
from rig.estimation.arrays import scale_of
from rig.estimation.imu import MODEL
from rig.estimation.residuals import dwell_residual_std_m_s2
from rig.estimation.triads import Alignment
from rig.estimation.triaxial import TriaxialSolution
from rig.report.axes import PARAMETERS, dwell_entry
from rig.report.budget_entry import budget_entry
from rig.report.entry import counted, entry


def accelerometer_entry(result: AccelerometerResult, **more: Any) -> AccelerometerEntry:
    """Scale, bias and covariance; beside them the other methods from the attitudes alone, and what `more` there is."""
    solution = result.solution
    std, expected = np.sqrt(np.diag(solution.covariance)), dwell_residual_std_m_s2(solution, result.movement)
    return entry(
        AccelerometerEntry, result, result.sensor, solution,
        role="calibrate",
        range_m_s2=result.sensor.channel(ACCELERATION).range,
        model=MODEL,
        estimator="attitude_weighted",
        covariance_combined=None if result.budget is None else result.budget.covariance,
        budget=None if result.budget is None else budget_entry(result.budget),
        covariance_order=PARAMETERS,
        covariance_units=ACCELERATION.parameter_units,
        second_order_std_s2_m=None if solution.second_order_s2_m is None else std[SECOND],
        attitude_error_rad=solution.attitude_error.std_rad,
        attitude_error_std_rad=solution.attitude_error.uncertainty_rad,
        lever_arm_m=result.lever_arm_m,
        lever_arm_std_m=result.lever_arm_std_m,
        delay_std_s=None if solution.delay_s is None else float(std[DELAY]),
        alignment=None if result.alignment is None else _alignment(result.alignment),
        dwells=[
            dwell_entry(DwellEntry, ACCELERATION, *each)
            for each in zip(result.dwells, solution.dwell_residuals_m_s2, expected, strict=True)
        ],
        beside={name: _beside(found) for name, found in result.beside.items()},
        non_orthogonality_freedom=counted(of_acceleration_angles(result)),
        second_order_freedom=counted(of_second_order(result)),
        held_out=None if result.held_out is None else _held_out(result.held_out),
        **more,
    )  # fmt: skip


def _alignment(alignment: Alignment) -> AlignmentEntry:
    return entry(
        AlignmentEntry, alignment,
        rotation_rad=alignment.vector_rad,
        std_rad=np.sqrt(np.diag(alignment.covariance_rad2)),
    )  # fmt: skip


def _held_out(held: HeldOut) -> HeldOutEntry:
    return HeldOutEntry(dwells=len(held.dwells), rms_m_s2=held.rms_m_s2, max_m_s2=float(np.abs(held.error_m_s2).max()))


def _beside(solution: TriaxialSolution | Fault) -> InAttitudesEntry | ErrorEntry:
    if isinstance(solution, Fault):
        return ErrorEntry(error=str(solution))
    return entry(
        InAttitudesEntry, solution,
        scale=scale_of(solution.matrix),
        bias_m_s2=solution.bias,
    )  # fmt: skip
