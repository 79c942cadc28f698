"""The entry of one gyroscope in `result.json`."""

from typing import TYPE_CHECKING, Any

import numpy as np

from rig.analysis.effective_dof import angle_dof, g_sensitivity_dof
from rig.analysis.gyroscope.calibration import ALGORITHM_1, EARTH_RATE, NEWTON, VECTOR, SensorResult
from rig.data.entries.result_types import ErrorEntry, Role
from rig.data.quantity import RATE
from rig.data.result_file import (
    AverageEntry,
    BoardEntry,
    BoardSolutionEntry,
    EstimateEntry,
    GyroscopeEntry,
    NonlinearityEntry,
    ObservationEntry,
    TimeBaseEntry,
    VectorEntry,
)
from rig.errors import Fault
from rig.estimation.gyroscope import vector_model
from rig.estimation.gyroscope.estimate import Estimate
from rig.estimation.gyroscope.six_observation import MODEL, PARAMETERS
from rig.estimation.residuals import residual_std_rad_s
from rig.report.entries.budget import bias_process_entry, budget_entry
from rig.report.entries.by_hand import hand_entry
from rig.report.entries.earth_rate import earth_rate_entry
from rig.report.entry import dof_or_none, entry, error_entry, finite_or_none

if TYPE_CHECKING:
    from rig.analysis.gyroscope.onboard_check import Agreement
    from rig.estimation.gyroscope.rotations_by_angle import TurnedSolution


def sensor_entry(
    result: SensorResult, role: Role = "calibrate", board: "Agreement | None" = None, **more: Any
) -> GyroscopeEntry:
    """Return a gyroscope's entry: the chosen estimator's solution, and the others' solutions or errors.

    `board` is the comparison with the board's own solution, `more` are further fields. Fields without a value are left
    out.
    """
    solution, turns = result.solution, result.observations
    return entry(
        GyroscopeEntry, result.sensor, solution, result,
        role=role,
        model=MODEL,
        observations_used=solution.observations,
        covariance_order=PARAMETERS,
        covariance_units=RATE.parameter_units,
        observations=[
            entry(ObservationEntry, turn, turn.average, temperature_c=finite_or_none(turn.average.temperature_c))
            for turn in turns
        ],
        rests=[entry(AverageEntry, rest, temperature_c=finite_or_none(rest.temperature_c)) for rest in result.rests],
        time_bases=[entry(TimeBaseEntry, time_base) for time_base in result.time_bases],
        vector_model=_vector_or_error(result),
        six_observation=_estimate_or_error(result.six_observation, result.faults.get(NEWTON)),
        algorithm_1=_estimate_or_error(result.algorithm_1, result.faults.get(ALGORITHM_1)),
        by_hand=None if result.by_hand is None else hand_entry(result.by_hand),
        **({} if board is None else {"board": _board(board)}),
        **_uncertainty_fields(result),
        **more,
    )  # fmt: skip


def _uncertainty_fields(result: SensorResult) -> dict[str, Any]:
    """Return the fields of uncertainty, bias process, nonlinearity and Earth's rate that the result has."""
    fields: dict[str, Any] = {}
    if result.uncertainty is not None:
        combined = result.uncertainty.covariance
        fields |= {"covariance_combined": combined, "budget": budget_entry(result.uncertainty)}
    if (explained := result.explained) is not None:
        fields["bias_process"] = bias_process_entry(explained)
        fields["speeds_rad_s"] = explained.inputs.speeds_rad_s
        fields["axis_rate_ranges_rad_s"] = explained.axis_rate_ranges_rad_s
        if explained.nonlinearity is not None:
            fields["nonlinearity"] = entry(NonlinearityEntry, explained.nonlinearity)
    if result.earth is not None:
        fields["earth_rate"] = earth_rate_entry(result.earth)
    elif EARTH_RATE in result.faults:
        fields["earth_rate"] = error_entry(result.faults[EARTH_RATE])
    return fields


def _estimate_or_error(solution: Estimate | None, fault: Fault | None) -> EstimateEntry | ErrorEntry:
    """Return the entry of a solution, or of the error that prevented it."""
    return ErrorEntry(error=str(fault)) if solution is None else entry(EstimateEntry, solution)


def _vector_or_error(result: SensorResult) -> VectorEntry | ErrorEntry:
    """Return the vector model's entry with degrees of freedom, or the error that prevented a solution."""
    outcome = result.vector_model
    if outcome is None:
        return error_entry(result.faults[VECTOR])
    more: dict[str, Any] = {}
    if result.explained is not None:
        more["residuals_std_rad_s"] = residual_std_rad_s(result.explained)
        if (angles_dof := dof_or_none(angle_dof(result))) is not None:
            more |= {
                "non_orthogonality_degrees_of_freedom": angles_dof[:3],
                "mounting_degrees_of_freedom": angles_dof[3:],
            }
        if (sensitivity_dof := dof_or_none(g_sensitivity_dof(result))) is not None:
            more["g_sensitivity_degrees_of_freedom"] = sensitivity_dof
    return vector_entry(outcome, **more)


def vector_entry(outcome: "vector_model.VectorSolution | TurnedSolution", **more: Any) -> VectorEntry:
    """Return the entry of the vector model's solution, with the angles between the axes and the fields `more`."""
    angles = np.sqrt(np.diag(outcome.angles_covariance_rad2))
    sensitivity: dict[str, Any] = {}
    if outcome.g_sensitivity is not None and outcome.g_sensitivity_covariance is not None:
        std = np.sqrt(np.diag(outcome.g_sensitivity_covariance)).reshape(3, 3)
        sensitivity = {
            "g_sensitivity_rad_s_per_m_s2": outcome.g_sensitivity,
            "g_sensitivity_std_rad_s_per_m_s2": std,
        }
    return entry(
        VectorEntry, outcome,
        model=vector_model.MODEL,
        matrix_covariance_order=vector_model.MATRIX_PARAMETERS,
        non_orthogonality_std_rad=angles[:3],
        non_orthogonality_order=("yz", "zx", "xy"),
        mounting_std_rad=angles[3:],
        **sensitivity,
        **more,
    )  # fmt: skip


def _board(board: "Agreement") -> BoardEntry:
    solutions = {method: entry(BoardSolutionEntry, event, event.solution) for method, event in board.solutions.items()}
    return entry(BoardEntry, board, solutions=solutions)
