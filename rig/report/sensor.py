"""One sensor's entry in `result.json`."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from rig.analysis.calibration import SensorResult
from rig.analysis.onboard_check import Agreement
from rig.errors import Fault
from rig.estimation import vector_model
from rig.estimation.estimate import Estimate
from rig.estimation.six_observation import MODEL, PARAMETER_UNITS, PARAMETERS
from rig.observation.average import Average
from rig.observation.observe import Observation
from rig.observation.timebase import TimeBase


def sensor_document(result: SensorResult, role: str = "calibrate", agreed: Agreement | None = None) -> dict[str, Any]:
    """Plain numbers, lists and strings, in SI units, of schema "rig.result/1".

    Scale, bias and covariance are those of the chosen estimator; `vector_model`, `six_observation` and `algorithm_1`
    stand beside them, each with its own, or with the `error` it ends in. `board` is the board's own solution; a
    reference sensor has none.
    """
    solution = result.solution
    return {
        "part": result.sensor.part,
        "serial_number": result.sensor.serial_number,
        "range_rad_s": result.sensor.range_rad_s,
        "role": role,
        "model": MODEL,
        **estimate_document(solution),
        "covariance_order": list(PARAMETERS),
        "covariance_units": list(PARAMETER_UNITS),
        "temperature_c": result.temperature_c,
        "observations": [_observation(observation) for observation in result.observations],
        "rests": [_average(rest) for rest in result.rests],
        "time_bases": [_time_base(time_base) for time_base in result.time_bases],
        "vector_model": _vector(result.vector_model),
        "six_observation": estimate_document(result.six_observation),
        "algorithm_1": outcome_document(result.algorithm_1),
        **({} if agreed is None else {"board": _board(agreed)}),
    }


def estimate_document(solution: Estimate) -> dict[str, Any]:
    """What every estimator's solution has, as plain numbers and lists."""
    return {
        "estimator": solution.estimator,
        "iterations": solution.iterations,
        "scale": solution.scale.tolist(),
        "bias_rad_s": solution.bias_rad_s.tolist(),
        "covariance": solution.covariance.tolist(),
        "observations_used": solution.observations,
        "rank": solution.rank,
        "condition": solution.condition,
    }


def outcome_document(outcome: Estimate | Fault) -> dict[str, Any]:
    """The same for a solution that stands beside another, or the `error` it ended in."""
    return {"error": str(outcome)} if isinstance(outcome, Fault) else estimate_document(outcome)


def _vector(outcome: vector_model.VectorSolution | Fault) -> dict[str, Any]:
    if isinstance(outcome, Fault):
        return {"error": str(outcome)}
    angles = np.sqrt(np.diag(outcome.angles_covariance_rad2))
    return {
        "model": vector_model.MODEL,
        **estimate_document(outcome),
        "matrix": outcome.matrix.tolist(),
        "matrix_covariance": outcome.matrix_covariance.tolist(),
        "matrix_covariance_order": list(vector_model.MATRIX_PARAMETERS),
        "non_orthogonality_rad": outcome.non_orthogonality_rad.tolist(),
        "non_orthogonality_std_rad": angles[:3].tolist(),
        "non_orthogonality_order": ["yz", "zx", "xy"],
        "mounting": outcome.mounting.tolist(),
        "mounting_std_rad": angles[3:].tolist(),
        "residuals_rad_s": outcome.residuals_rad_s.tolist(),
        "warnings": list(outcome.warnings),
    }


def _board(agreed: Agreement) -> dict[str, Any]:
    """The board's solutions by method, and the closed form's distance from the same in double precision."""
    return {
        "solutions": {method: dict(solution) for method, solution in agreed.solutions.items()},
        "not_observed": list(agreed.not_observed),
        "host_scale": None if agreed.host_scale is None else agreed.host_scale.tolist(),
        "host_bias_rad_s": None if agreed.host_bias_rad_s is None else agreed.host_bias_rad_s.tolist(),
        "scale_difference": agreed.scale_difference,
        "bias_difference_rad_s": agreed.bias_difference_rad_s,
    }


def _observation(observation: Observation) -> dict[str, Any]:
    return {
        "sweep": observation.sweep,
        "joint": observation.joint_name,
        "direction": observation.direction,
        "axis": observation.axis,
        "sign": observation.sign,
        "axis_flange": observation.axis_flange.tolist(),
        "speed_rad_s": observation.speed_rad_s,
        "speed_std_rad_s": observation.speed_std_rad_s,
        "lost": observation.lost,
        **_average(observation.average),
    }


def _average(average: Average) -> Mapping[str, Any]:
    return {
        "mean_rad_s": average.mean_rad_s.tolist(),
        "mean_std_rad_s": np.sqrt(average.variance_rad2_s2).tolist(),
        "noise_rad_s": average.noise_rad_s.tolist(),
        "samples": average.samples,
        "duration_s": average.duration_s,
        "temperature_c": average.temperature_c,
    }


def _time_base(time_base: TimeBase) -> dict[str, float]:
    return {
        "offset_s": time_base.offset_s,
        "offset_std_s": time_base.offset_std_s,
        "drift": time_base.drift,
        "drift_std": time_base.drift_std,
        "reference_board_s": time_base.reference_s,
    }
