"""The path from recordings to a gyroscope's calibration, common to runs and `rig solve`. Pure functions."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import combinations
from typing import TYPE_CHECKING

import numpy as np

from rig.analysis.environment import MeasurementEnvironment
from rig.analysis.estimator_names import DEFAULT_ESTIMATOR, Estimator, find_estimator
from rig.analysis.gyroscope.correction import Correction, CorrectionKind, diagonal_correction, matrix_correction
from rig.analysis.gyroscope.vector_inputs import collect_inputs, list_given, list_uncertainties
from rig.data.recording.motion_file import Item
from rig.data.recording.recorded_sensor import RecordedSensor
from rig.data.recording.run_data import RunData
from rig.errors import Fault, Refused, name_sensor
from rig.errors.attempts import attempt
from rig.estimation.arrays import Array
from rig.estimation.gyroscope.accumulator import Accumulator, SixObservationEstimator, Solution
from rig.estimation.gyroscope.budget import Budget, UnknownErrors, budget
from rig.estimation.gyroscope.earth_rate import EarthRate, find_earth_rate
from rig.estimation.gyroscope.estimate import Estimate
from rig.estimation.gyroscope.six_observation_budget import six_observation_budget
from rig.estimation.gyroscope.vector_fit import VectorFit, VectorInputs, explain
from rig.estimation.gyroscope.vector_model import VectorSolution, solve_vector_model
from rig.estimation.refusals import check_duplicates
from rig.observation.average import Average
from rig.observation.clocks.time_base import TimeBase
from rig.observation.finished_steps import complete_sweeps
from rig.observation.observe import Observation
from rig.observation.observed_run import NO_ROTATIONS, ObservedRun, observe_runs

if TYPE_CHECKING:
    from rig.estimation.by_hand import HandSolution
    from rig.estimation.gyroscope.levenberg_marquardt import LevenbergMarquardtSolution
    from rig.estimation.gyroscope.rotations_by_angle import TurnedSolution

VECTOR, NEWTON, ALGORITHM_1, EARTH_RATE = "vector", "newton", "algorithm_1", "earth_rate"


@dataclass(frozen=True, slots=True)
class SensorResult:
    """One gyroscope's calibration, and its intermediate results.

    - sensor: the sensor as recorded.
    - solution: the estimate by the chosen estimator.
    - vector_model: the solution of the vector model, None if it has none.
    - uncertainty: the budget of `solution`; None for estimators without one.
    - corrected_by: the correction for the board and calibration.h.
    - explained: the fit of the vector model with gravity and bias drift, None without a solution from a run.
    - six_observation: the exact solution of the six-observation model (the paper SIX).
    - algorithm_1: the solution of the same model by the paper's Algorithm 1.
    - observations: the averages of the sweeps.
    - rests: the averages of the rests.
    - time_bases: the conversion of the sensor's times to the arm's clock, for each recording.
    - earth: the Earth's rate, None if it was not estimated.
    - by_hand: the solution of a session by hand, None for other recordings.
    - faults: the reasons why parts are missing, by the estimator's name or EARTH_RATE.
    """

    sensor: RecordedSensor | Item
    solution: Estimate
    vector_model: "VectorSolution | TurnedSolution | None"
    uncertainty: Budget | None
    corrected_by: Correction
    explained: VectorFit | None = None
    six_observation: Solution | None = None
    algorithm_1: Solution | None = None
    observations: tuple[Observation, ...] = ()
    rests: tuple[Average, ...] = ()
    time_bases: tuple[TimeBase, ...] = ()
    earth: EarthRate | None = None
    by_hand: "HandSolution | None" = None
    faults: Mapping[str, Fault] = field(default_factory=dict)

    @property
    def serial_number(self) -> str:
        """The serial number of the sensor."""
        return self.sensor.serial_number

    @property
    def scale(self) -> Array:
        """The scale factors (3,) of rate = scale × (reading + bias) by the chosen estimator."""
        return self.solution.scale

    @property
    def bias_rad_s(self) -> Array:
        """The biases (3,) by the chosen estimator."""
        return self.solution.bias_rad_s

    @property
    def correction(self) -> CorrectionKind:
        """The kind of the correction: axis by axis, or by the whole matrix."""
        return self.corrected_by.kind

    @property
    def correction_matrix(self) -> Array:
        """The matrix M (3, 3) of the correction rate = M (reading + bias)."""
        return self.corrected_by.matrix

    @property
    def temperature_c(self) -> float | None:
        """The mean temperature of the samples of all sweeps; None without a thermometer."""
        averages = [observation.average for observation in self.observations]
        if not averages or np.isnan([average.temperature_c for average in averages]).any():
            return None
        return float(np.average([a.temperature_c for a in averages], weights=[a.samples for a in averages]))


def observe_recordings(
    runs: Sequence[RunData], rotations: Mapping[int, Array] = NO_ROTATIONS
) -> tuple[ObservedRun, ...]:
    """Return the observations of all recordings of one calibration, without those that have no finished sweep.

    The first recording's thresholds apply to all. `rotations` correct the item's nominal mounts, by stage (see
    `observe_runs`). Raise Refused `different_sensors`; Fault `duplicated_observation` and those of `observe_run`.
    """
    refuse_different_sensors(runs)
    _check_recordings(runs)
    return observe_runs(runs, rotations)


def refuse_different_sensors(runs: Sequence[RunData]) -> None:
    """Raise Refused `different_sensors` unless all recordings describe the same sensors with the same settings."""
    if any(run.sensors != runs[0].sensors for run in runs):
        raise Refused(
            "different_sensors",
            "the recordings do not describe the same sensors with the same settings",
            "Solve them one by one",
        )


def solve_observed(
    sensors: Mapping[str, RecordedSensor],
    recordings: Sequence[ObservedRun],
    environment: MeasurementEnvironment,
    estimator: str = DEFAULT_ESTIMATOR,
    matrix_corrected: Collection[str] = (),
) -> dict[str, SensorResult]:
    """Return the calibrations of the gyroscopes `sensors`, by name, from all recordings of a run.

    If the estimator is the vector model, sensors named in `matrix_corrected` are corrected by the whole matrix; all
    other corrections assume orthogonal axes. Sweeps must suffice for the six-observation solution, even if another
    estimator is chosen. Raise Refused `unknown_estimator`; Fault `duplicated_observation` and as the estimators do.
    """
    chosen = find_estimator(estimator)
    results = dict[str, SensorResult]()
    for name, sensor in sensors.items():
        with name_sensor(name, sensors):
            whole_matrix = name in matrix_corrected
            results[name] = _solve_sensor(name, sensor, recordings, environment, chosen, whole_matrix=whole_matrix)
    return results


def _solve_sensor(
    name: str,
    sensor: RecordedSensor,
    recordings: Sequence[ObservedRun],
    environment: MeasurementEnvironment,
    estimator: Estimator,
    *,
    whole_matrix: bool,
) -> SensorResult:
    """Return a gyroscope's calibration by the `estimator`, with the results or Faults of other estimators."""
    parts = [recording.sensors[name] for recording in recordings]
    observations = tuple(observation for part in parts for observation in part.revolutions)
    rests = tuple(rest for part in parts for rest in part.rests)
    mounting = np.array(sensor.mounting)
    check_duplicates(np.array([observation.average.mean_rad_s for observation in observations]))
    six_observation = solve_six_observation(observations, "newton")
    faults = dict[str, Fault]()
    earth_rate: EarthRate | None = None
    inputs = collect_inputs(recordings, name, environment)
    if environment.finds_earth_rate:
        given_values = list_given(environment, name)
        earth_rate = attempt(faults, EARTH_RATE, lambda: find_earth_rate(inputs, mounting, given_values))
    explained = attempt(faults, VECTOR, lambda: explain(_add_earth_rate(inputs, earth_rate), mounting))
    vector_model = None if explained is None else explained.solution
    algorithm_1 = attempt(faults, ALGORITHM_1, lambda: solve_six_observation(observations, "algorithm_1"))
    solutions: dict[str, Estimate | None] = {VECTOR: vector_model, NEWTON: six_observation, ALGORITHM_1: algorithm_1}
    solution = solutions[estimator] if estimator in solutions else solve_observations(observations, estimator)
    if solution is None:
        raise faults[estimator]
    return SensorResult(
        sensor=sensor,
        solution=solution,
        vector_model=vector_model,
        explained=explained,
        uncertainty=None
        if explained is None
        else _budget_of(
            solution,
            explained,
            environment,
            list_uncertainties(environment, name, earth_rate, sensor.stamp_std_s),
            name,
        ),
        six_observation=six_observation,
        algorithm_1=algorithm_1,
        observations=observations,
        rests=rests,
        time_bases=tuple(part.time_base for part in parts),
        corrected_by=_choose_correction(solution, whole_matrix=whole_matrix),
        earth=earth_rate,
        faults=faults,
    )


def _budget_of(
    solution: Estimate, explained: VectorFit, environment: MeasurementEnvironment, unknown: UnknownErrors, name: str
) -> Budget | None:
    """Return the budget of the chosen solution of the sensor `name`; None if its estimator has no budget."""
    if isinstance(solution, VectorSolution):
        return budget(explained, unknown)
    if isinstance(solution, Solution) and solution.estimator == "newton":
        axes_rad = float(np.radians(environment.uncertainty.find_stated_size("non_orthogonality_deg", name)))
        return six_observation_budget(explained, solution, unknown, axes_rad)
    return None


def _add_earth_rate(inputs: VectorInputs, earth_rate: EarthRate | None) -> VectorInputs:
    """Return the inputs with the estimated Earth's rate, if any."""
    return inputs if earth_rate is None else replace(inputs, earth_rate_rad_s=earth_rate.rate_rad_s)


def _choose_correction(solution: Estimate, *, whole_matrix: bool) -> Correction:
    if whole_matrix and isinstance(solution, VectorSolution):
        return matrix_correction(solution)
    return diagonal_correction(solution.scale)


def solve_observations(
    observations: Sequence[Observation], estimator: Estimator, rests: Sequence[Average] = ()
) -> Estimate:
    """Return the estimate of scale and bias by the given `estimator`; only the vector model uses `rests`."""
    if estimator == "vector":
        return solve_vector(observations, rests)
    if estimator == "levenberg_marquardt":
        return _solve_levenberg_marquardt(observations)
    return solve_six_observation(observations, estimator)


def solve_vector(
    observations: Sequence[Observation], rests: Sequence[Average], nominal_mounting: Array | None = None
) -> VectorSolution:
    """Return the solution of the vector model from sweeps and rests. Raise Fault as `solve_vector_model` does."""
    averages = [*(observation.average for observation in observations), *rests]
    rates = [observation.speed_rad_s * observation.axis_flange for observation in observations]
    return solve_vector_model(
        np.array([average.mean_rad_s for average in averages]),
        np.array([*rates, *np.zeros((len(rests), 3))]),
        np.array([average.variance_rad2_s2 for average in averages]),
        speed_std_rad_s=[*(observation.speed_std_rad_s for observation in observations), *np.zeros(len(rests))],
        nominal_mounting=nominal_mounting,
    )


def solve_six_observation(observations: Sequence[Observation], estimator: SixObservationEstimator) -> Solution:
    """Return the six-observation solution; weights are inverse variances, but equal for the paper's "algorithm_1"."""
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


def _solve_levenberg_marquardt(observations: Sequence[Observation]) -> "LevenbergMarquardtSolution":
    from rig.estimation.gyroscope.levenberg_marquardt import solve_levenberg_marquardt

    return solve_levenberg_marquardt(
        np.array([observation.average.mean_rad_s for observation in observations]),
        [observation.speed_rad_s for observation in observations],
        np.array([observation.average.variance_rad2_s2 for observation in observations]),
        speed_std_rad_s=[observation.speed_std_rad_s for observation in observations],
    )


def _check_recordings(runs: Sequence[RunData]) -> None:
    """Raise Fault `duplicated_observation` if two recordings have the same samples of a sweep."""
    for run, other in combinations(runs, 2):
        repeated = complete_sweeps(run) & complete_sweeps(other)
        if repeated and all(np.array_equal(samples, other.samples[name]) for name, samples in run.samples.items()):
            raise Fault(
                "duplicated_observation",
                f"two recordings hold the same samples of sweep {min(repeated)}",
                "Give each recording once",
            )
