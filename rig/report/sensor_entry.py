"""One sensor's entry in `result.json`."""

from dataclasses import asdict

import numpy as np

from rig.analysis.calibration import SensorResult
from rig.analysis.onboard_check import Agreement
from rig.data.result_file import (
    AverageEntry,
    BoardEntry,
    ErrorEntry,
    EstimateEntry,
    ObservationEntry,
    Role,
    SensorEntry,
    TimeBaseEntry,
    VectorEntry,
)
from rig.errors import Fault
from rig.estimation import vector_model
from rig.estimation.estimate import Estimate
from rig.estimation.six_observation import MODEL, PARAMETER_UNITS, PARAMETERS
from rig.observation.average import Average
from rig.observation.observe import Observation
from rig.observation.timebase import TimeBase


def sensor_entry(result: SensorResult, role: Role = "calibrate", agreed: Agreement | None = None) -> SensorEntry:
    """Scale, bias and covariance by the chosen estimator; beside them the others, or the error each ends in."""
    entry = SensorEntry(
        part=result.sensor.part,
        serial_number=result.sensor.serial_number,
        range_rad_s=result.sensor.range_rad_s,
        role=role,
        model=MODEL,
        **estimate_entry(result.solution).model_dump(),
        covariance_order=PARAMETERS,
        covariance_units=PARAMETER_UNITS,
        temperature_c=result.temperature_c,
        observations=tuple(map(_observation, result.observations)),
        rests=tuple(map(_average, result.rests)),
        time_bases=tuple(map(_time_base, result.time_bases)),
        vector_model=_vector(result.vector_model),
        six_observation=estimate_entry(result.six_observation),
        algorithm_1=entry_or_error(result.algorithm_1),
    )
    return entry if agreed is None else entry.model_copy(update={"board": _board(agreed)})


def estimate_entry(solution: Estimate) -> EstimateEntry:
    """What every estimator's solution has."""
    return EstimateEntry(
        estimator=solution.estimator,
        iterations=solution.iterations,
        scale=solution.scale.tolist(),
        bias_rad_s=solution.bias_rad_s.tolist(),
        covariance=solution.covariance.tolist(),
        observations_used=solution.observations,
        rank=solution.rank,
        condition=solution.condition,
    )


def entry_or_error(outcome: Estimate | Fault) -> EstimateEntry | ErrorEntry:
    """A solution that stands beside another, or the error it ended in."""
    return ErrorEntry(error=str(outcome)) if isinstance(outcome, Fault) else estimate_entry(outcome)


def _vector(outcome: vector_model.VectorSolution | Fault) -> VectorEntry | ErrorEntry:
    if isinstance(outcome, Fault):
        return ErrorEntry(error=str(outcome))
    angles = np.sqrt(np.diag(outcome.angles_covariance_rad2))
    return VectorEntry(
        model=vector_model.MODEL,
        **estimate_entry(outcome).model_dump(),
        matrix=outcome.matrix.tolist(),
        matrix_covariance=outcome.matrix_covariance.tolist(),
        matrix_covariance_order=vector_model.MATRIX_PARAMETERS,
        non_orthogonality_rad=outcome.non_orthogonality_rad.tolist(),
        non_orthogonality_std_rad=angles[:3].tolist(),
        non_orthogonality_order=("yz", "zx", "xy"),
        mounting=outcome.mounting.tolist(),
        mounting_std_rad=angles[3:].tolist(),
        residuals_rad_s=outcome.residuals_rad_s.tolist(),
        warnings=outcome.warnings,
    )


def _board(agreed: Agreement) -> BoardEntry:
    return BoardEntry.model_validate(
        {
            "solutions": {
                method: {"sensor": solved.sensor, **asdict(solved.solution)}
                for method, solved in agreed.solutions.items()
            },
            "not_observed": agreed.not_observed,
            "host_scale": None if agreed.host_scale is None else agreed.host_scale.tolist(),
            "host_bias_rad_s": None if agreed.host_bias_rad_s is None else agreed.host_bias_rad_s.tolist(),
            "scale_difference": agreed.scale_difference,
            "bias_difference_rad_s": agreed.bias_difference_rad_s,
        }
    )


def _observation(observation: Observation) -> ObservationEntry:
    return ObservationEntry.model_validate(
        {
            "sweep": observation.sweep,
            "joint": observation.joint_name,
            "direction": observation.direction,
            "axis": observation.axis,
            "sign": observation.sign,
            "axis_flange": observation.axis_flange.tolist(),
            "speed_rad_s": observation.speed_rad_s,
            "speed_std_rad_s": observation.speed_std_rad_s,
            "lost": observation.lost,
            **_average(observation.average).model_dump(),
        }
    )


def _average(average: Average) -> AverageEntry:
    return AverageEntry(
        mean_rad_s=average.mean_rad_s.tolist(),
        mean_std_rad_s=np.sqrt(average.variance_rad2_s2).tolist(),
        noise_rad_s=average.noise_rad_s.tolist(),
        samples=average.samples,
        duration_s=average.duration_s,
        temperature_c=average.temperature_c,
    )


def _time_base(time_base: TimeBase) -> TimeBaseEntry:
    return TimeBaseEntry(
        offset_s=time_base.offset_s,
        offset_std_s=time_base.offset_std_s,
        drift=time_base.drift,
        drift_std=time_base.drift_std,
        reference_board_s=time_base.reference_s,
    )
