"""One sensor's entry in `result.json`."""

import numpy as np

from rig.analysis.calibration import SensorResult
from rig.analysis.freedom_beside import of_angles, of_sensitivity
from rig.analysis.loads import loads_rad_s
from rig.analysis.onboard_check import Agreement
from rig.data.result_file import (
    AverageEntry,
    BoardEntry,
    BoardSolutionEntry,
    EstimateEntry,
    NonlinearityEntry,
    ObservationEntry,
    SensorEntry,
    TimeBaseEntry,
    VectorEntry,
)
from rig.data.result_types import ErrorEntry, Role
from rig.errors import Fault
from rig.estimation import vector_model
from rig.estimation.arrays import Array
from rig.estimation.estimate import Estimate
from rig.estimation.residuals import residual_std_rad_s
from rig.estimation.six_observation import MODEL, PARAMETER_UNITS, PARAMETERS
from rig.estimation.turned import TurnedSolution
from rig.report.budget_entry import bias_process_entry, budget_entry
from rig.report.earth_rate import earth_rate_entry
from rig.report.entry import counted, entry


def sensor_entry(result: SensorResult, role: Role = "calibrate", agreed: Agreement | None = None) -> SensorEntry:
    """Scale, bias and covariance by the chosen estimator; beside them the others, or the error each ends in."""
    solution, turns = result.solution, result.observations
    found = entry(
        SensorEntry, result.sensor, solution, result,
        role=role,
        model=MODEL,
        observations_used=solution.observations,
        covariance_order=PARAMETERS,
        covariance_units=PARAMETER_UNITS,
        observations=[entry(ObservationEntry, turn, turn.average, joint=turn.joint_name) for turn in turns],
        rests=[entry(AverageEntry, each) for each in result.rests],
        time_bases=[entry(TimeBaseEntry, each, reference_board_s=each.reference_s) for each in result.time_bases],
        vector_model=_vector_or_error(result),
        six_observation=estimate_entry(result.six_observation),
        algorithm_1=entry_or_error(result.algorithm_1),
    )  # fmt: skip
    more: dict[str, object] = {} if agreed is None else {"board": _board(agreed)}
    if result.uncertainty is not None:
        combined = result.uncertainty.covariance
        more |= {"covariance_combined": _rows(combined), "budget": budget_entry(result.uncertainty)}
    if result.explained is not None:
        more["bias_process"] = bias_process_entry(result.explained)
        more["speeds_rad_s"] = result.explained.seen.speeds_rad_s
        more["loads_rad_s"] = _rows(loads_rad_s(result.explained))
        if result.explained.nonlinearity is not None:
            more["nonlinearity"] = entry(NonlinearityEntry, result.explained.nonlinearity)
    if result.earth is not None:
        counts = result.uncertainty is not None and result.uncertainty.by_freedom
        more["earth_rate"] = earth_rate_entry(result.earth, counts_freedom=counts)
    return found.model_copy(update=more)


def _rows(matrix: Array) -> tuple[tuple[float, ...], ...]:
    return tuple(map(tuple, matrix.tolist()))


def estimate_entry(solution: Estimate) -> EstimateEntry:
    """What every estimator's solution has."""
    return entry(EstimateEntry, solution, observations_used=solution.observations)


def entry_or_error(outcome: Estimate | Fault) -> EstimateEntry | ErrorEntry:
    """A solution that stands beside another, or the error it ended in."""
    return ErrorEntry(error=str(outcome)) if isinstance(outcome, Fault) else estimate_entry(outcome)


def _vector_or_error(result: SensorResult) -> VectorEntry | ErrorEntry:
    outcome = result.vector_model
    if isinstance(outcome, Fault):
        return ErrorEntry(error=str(outcome))
    found = vector_entry(outcome)
    if result.explained is None:
        return found
    more: dict[str, object] = {"residuals_std_rad_s": _rows(residual_std_rad_s(result.explained))}
    if (angles := counted(of_angles(result))) is not None:
        more |= {"non_orthogonality_freedom": tuple(angles[:3]), "mounting_freedom": tuple(angles[3:])}
    if (felt := counted(of_sensitivity(result))) is not None:
        more["g_sensitivity_freedom"] = tuple(map(tuple, felt))
    return found.model_copy(update=more)


def vector_entry(outcome: vector_model.VectorSolution | TurnedSolution) -> VectorEntry:
    """The vector model's solution, how the axes lie to each other included."""
    angles = np.sqrt(np.diag(outcome.angles_covariance_rad2))
    sensitivity: dict[str, object] = {}
    if outcome.g_sensitivity is not None and outcome.g_sensitivity_covariance is not None:
        std = np.sqrt(np.diag(outcome.g_sensitivity_covariance)).reshape(3, 3)
        sensitivity = {
            "g_sensitivity_rad_s_per_m_s2": outcome.g_sensitivity,
            "g_sensitivity_std_rad_s_per_m_s2": std,
        }
    return entry(
        VectorEntry, outcome,
        model=vector_model.MODEL,
        observations_used=outcome.observations,
        matrix_covariance_order=vector_model.MATRIX_PARAMETERS,
        non_orthogonality_std_rad=angles[:3],
        non_orthogonality_order=("yz", "zx", "xy"),
        mounting_std_rad=angles[3:],
        **sensitivity,
    )  # fmt: skip


def _board(agreed: Agreement) -> BoardEntry:
    solutions = {
        method: entry(BoardSolutionEntry, solved, solved.solution) for method, solved in agreed.solutions.items()
    }
    return entry(BoardEntry, agreed, solutions=solutions)
