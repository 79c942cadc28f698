"""From recordings to a calibration: the one path that a run and `rig solve` share, pure from end to end."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, get_args

import numpy as np

from rig.config.load import parse
from rig.errors import Fault, Refused
from rig.estimation.accumulator import Accumulator, Estimator, Solution
from rig.estimation.six_observation import MODEL, PARAMETER_UNITS, PARAMETERS
from rig.observation import Average, Observation, SensorObservations, has_finished_sweeps, observe
from rig.recording import RecordedSensor, RunData
from rig.timebase import TimeBase

ESTIMATORS: tuple[Estimator, ...] = get_args(Estimator)


@dataclass(frozen=True, slots=True)
class SensorResult:
    """One sensor's calibration and what it rests on.

    `algorithm_1` is the paper's own estimate from the same observations, or the Fault it ends in. There is one time
    base for each recording that took part.
    """

    sensor: RecordedSensor
    solution: Solution
    algorithm_1: Solution | Fault
    observations: tuple[Observation, ...]
    rests: tuple[Average, ...]
    time_bases: tuple[TimeBase, ...]

    @property
    def temperature_c(self) -> float:
        """Mean over all averaged samples."""
        averages = [observation.average for observation in self.observations]
        return float(np.average([a.temperature_c for a in averages], weights=[a.samples for a in averages]))


def solve_runs(runs: Sequence[RunData], estimator: str = "newton") -> dict[str, SensorResult]:
    """Calibrate every sensor from one recording, or from all recordings of a run that was resumed.

    The thresholds come from the configuration in the first recording. Recordings without a finished sweep add nothing.
    Raises Refused `unknown_estimator`, `different_sensors`; Fault as `observe` and `Accumulator.solve` do, and
    `duplicated_observation`.
    """
    chosen = next((known for known in ESTIMATORS if known == estimator), None)
    if chosen is None:
        raise Refused(
            "unknown_estimator", f"there is no estimator {estimator!r}", f"Choose one of {', '.join(ESTIMATORS)}"
        )
    if any(run.sensors != runs[0].sensors for run in runs):
        raise Refused(
            "different_sensors",
            "the recordings do not describe the same sensors with the same settings",
            "Solve them one by one",
        )
    settings = parse(runs[0].config, "the recorded configuration").config.observation
    useful = [run for run in runs if has_finished_sweeps(run)]
    return {
        name: _solve_sensor(sensor, [observe(run, name, settings) for run in useful], chosen)
        for name, sensor in runs[0].sensors.items()
    }


def _solve_sensor(sensor: RecordedSensor, parts: Sequence[SensorObservations], estimator: Estimator) -> SensorResult:
    observations = tuple(observation for part in parts for observation in part.revolutions)
    _check_duplicates(observations)
    return SensorResult(
        sensor=sensor,
        solution=solve_observations(observations, estimator),
        algorithm_1=_as_published(observations),
        observations=observations,
        rests=tuple(rest for part in parts for rest in part.rests),
        time_bases=tuple(part.time_base for part in parts),
    )


def solve_observations(observations: Sequence[Observation], estimator: Estimator) -> Solution:
    """Accumulate and solve: weighted by inverse variance, or all alike where the paper's algorithm is asked for."""
    accumulated = Accumulator.empty()
    for observation in observations:
        average = observation.average
        accumulated = accumulated.add(
            average.mean_rad_s,
            average.variance_rad2_s2,
            observation.speed_rad_s,
            observation.speed_std_rad_s,
            weight=1.0 if estimator == "algorithm_1" else None,
        )
    return accumulated.solve(estimator)


def _as_published(observations: Sequence[Observation]) -> Solution | Fault:
    try:
        return solve_observations(observations, "algorithm_1")
    except Fault as fault:
        return fault


def _check_duplicates(observations: Sequence[Observation]) -> None:
    seen: dict[bytes, int] = {}
    for observation in observations:
        mean = observation.average.mean_rad_s.tobytes()
        if mean in seen:
            raise Fault(
                "duplicated_observation",
                f"sweeps {seen[mean]} and {observation.sweep} hold the same readings",
                "Give each recording once",
            )
        seen[mean] = observation.sweep


def sensor_document(result: SensorResult) -> dict[str, Any]:
    """One sensor's entry in `result.json` (schema "rig.result/1"): plain numbers, lists and strings, SI units."""
    solution = result.solution
    return {
        "part": result.sensor.part,
        "serial_number": result.sensor.serial_number,
        "model": MODEL,
        **_estimate(solution),
        "covariance_order": list(PARAMETERS),
        "covariance_units": list(PARAMETER_UNITS),
        "observations_used": solution.observations,
        "rank": solution.rank,
        "condition": solution.condition,
        "temperature_c": result.temperature_c,
        "observations": [_observation(observation) for observation in result.observations],
        "rests": [_average(rest) for rest in result.rests],
        "time_bases": [_time_base(time_base) for time_base in result.time_bases],
        "algorithm_1": _published(result.algorithm_1),
    }


def _estimate(solution: Solution) -> dict[str, Any]:
    return {
        "estimator": solution.estimator,
        "iterations": solution.iterations,
        "scale": solution.scale.tolist(),
        "bias_rad_s": solution.bias_rad_s.tolist(),
        "covariance": solution.covariance.tolist(),
    }


def _published(outcome: Solution | Fault) -> dict[str, Any]:
    return {"error": str(outcome)} if isinstance(outcome, Fault) else _estimate(outcome)


def _observation(observation: Observation) -> dict[str, Any]:
    return {
        "sweep": observation.sweep,
        "joint": observation.joint_name,
        "direction": observation.direction,
        "axis": observation.axis,
        "sign": observation.sign,
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
