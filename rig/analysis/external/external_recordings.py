"""The solution and checks of external readings, whose motion a file describes. Pure functions."""

from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from rig.analysis.by_hand.gyroscope import solve_hand_samples
from rig.analysis.check import Check, fitness, list_unsolved
from rig.analysis.estimator_names import ESTIMATORS, Estimator, choose_estimator
from rig.analysis.external.attitudes import AttitudeCalibration, Result, find_method, solve_placed
from rig.analysis.external.changes_of_sweeps import check_sweeps_steady, widen_by_changes
from rig.analysis.external.increment_calibration import IncrementCalibration
from rig.analysis.external.omissions import (
    list_omitted,
    notes_on_changes,
    notes_on_reading,
    notes_on_scale,
    notes_on_speeds,
    notes_on_turns,
)
from rig.analysis.external.sweeps_agree import add_errors, check_agree, noise_dof, sweep_errors
from rig.analysis.gyroscope.calibration import (
    ALGORITHM_1,
    NEWTON,
    VECTOR,
    SensorResult,
    solve_observations,
    solve_six_observation,
    solve_vector,
)
from rig.analysis.gyroscope.correction import diagonal_correction, matrix_correction
from rig.analysis.installed_solvers import KindFound, OfKind
from rig.analysis.temperature.over_temperature import add_rate_polynomials, correct_files
from rig.data.quantity import RATE, Quantity
from rig.data.recording.motion_file import ExternalReadings, Item
from rig.data.recording.settings import RunSettings
from rig.errors import Fault, Refused
from rig.errors.attempts import attempt
from rig.estimation.gyroscope import rotations_by_angle
from rig.estimation.gyroscope.budget import Budget, Contributor
from rig.estimation.gyroscope.estimate import Estimate
from rig.estimation.gyroscope.rotations_by_angle import BIAS, NOISE, TurnedSolution, solve_turned
from rig.estimation.gyroscope.vector_model import VectorSolution
from rig.estimation.reference import triaxial
from rig.estimation.reference.reference_budget import scale_and_bias_covariance
from rig.estimation.reference.reference_model import BIAS as OFFSET
from rig.estimation.reference.reference_model import F
from rig.estimation.reference.triaxial import MAX_ATTITUDE_ERROR_RAD
from rig.estimation.sensor_axes import SensorAxes
from rig.estimation.temperature.temperature_polynomials import OverTemperature
from rig.observation.clocks.time_base import TimeBase
from rig.observation.external.attitude_import import average_placements
from rig.observation.external.csv_import import ExternalData, average_sweeps
from rig.observation.external.csv_samples import Samples, samples_in
from rig.observation.external.omission import Omitted
from rig.observation.external.turns import TurnedData
from rig.observation.statistics.mean import dof_by_axis

BySweeps = Estimator | Literal["increments"]
SWEEP_ESTIMATORS: tuple[BySweeps, ...] = (*ESTIMATORS, "increments")
FROM_SCATTER = "scatter of the readings"
MAX_SCALE_STD = 0.05  # u of a scale factor: more is no calibration, as of turns that are stated at wrong times
SWEEPS, FROM_RESIDUALS = "sweeps", "contradictions of the sweeps"
NO_SWEEPS = Fault("too_few_observations", "a file of attitudes contains no sweeps", "Give sweeps in six directions")


@dataclass(frozen=True, slots=True)
class ExternalResult:
    """The solution of an external recording.

    - item: the sensor.
    - gyroscope: the calibration of the gyroscope, None without a gyroscope.
    - rates: the gyroscope's solution in attitudes, None if it was solved from sweeps.
    - at_rest: the solutions of the other quantities, from rests.
    - unsolved: for each recorded quantity without a solution, the Fault that says why.
    - turned: the turns from rest to rest that the solution uses, if any.
    - installed_kinds: the solutions of sensors of kinds that installed packages add.
    - polynomials: the calibration over temperature, if any.
    - omitted: the readings and rows left out, each with the quantity concerned, None for all quantities.
    - notes: sentences for the user about the reading of the files and the solution.
    """

    item: Item
    gyroscope: SensorResult | None
    rates: Result | None
    at_rest: Mapping[Quantity, AttitudeCalibration]
    unsolved: Mapping[Quantity, Fault]
    turned: TurnedData | None = None
    installed_kinds: tuple[KindFound, ...] = ()
    polynomials: OverTemperature | None = None
    omitted: tuple[tuple[Quantity | None, Omitted], ...] = ()
    notes: tuple[str, ...] = ()


def solve_external(read: ExternalReadings, settings: RunSettings, estimator: str | None) -> ExternalResult:
    """Return the solution of readings whose motion a file describes; if `estimator` is None, one is chosen.

    Raise Refused `unknown_estimator`, and what `average_sweeps` and `average_placements` raise. If no quantity has a
    solution, raise the estimator's Fault; for several quantities, Refused `nothing_solved` with every reason.
    """
    samples = samples_in(read.readings, "the recording")
    with _mention(samples.omitted):
        return _solve_samples(read, samples, settings, estimator)


def _solve_samples(
    read: ExternalReadings, samples: Samples, settings: RunSettings, estimator: str | None
) -> ExternalResult:
    if read.tells == "turns":
        return _add_notes(_solve_turns(read, samples, estimator), read, samples)
    solved = (
        _solve_sweeps(read, samples, estimator, settings.reference_c)
        if read.tells == "sweeps"
        else _solve_attitudes(read, samples, settings, estimator)
    )
    if solved.gyroscope is None and not solved.at_rest and not solved.installed_kinds:
        raise _nothing_solved(solved.unsolved)
    return _add_notes(solved, read, samples)


def _add_notes(sensor: ExternalResult, read: ExternalReadings, samples: Samples) -> ExternalResult:
    return replace(
        sensor,
        omitted=(*((None, part) for part in samples.omitted), *sensor.omitted),
        notes=(*notes_on_reading(read, samples), *sensor.notes),
    )


def check_external(name: str, sensor: ExternalResult) -> Iterator[Check]:
    """Yield the verdict's checks of an external recording.

    They are of the condition of the equations, of the standard uncertainty of the scale factors, and of the error of
    the attitudes. Every quantity without a solution has a failing check. There are no further checks, because files
    come without a configuration that states limits.
    """
    yield from list_unsolved((name, quantity.name, fault) for quantity, fault in sensor.unsolved.items())
    if (gyroscope := sensor.gyroscope) is not None:
        largest = triaxial.MAX_CONDITION if sensor.rates is not None else rotations_by_angle.MAX_CONDITION
        yield fitness(name, RATE.name, "condition", gyroscope.solution.condition, largest)
        if gyroscope.uncertainty is not None:
            scale_std = float(gyroscope.uncertainty.std[:3].max())
            yield fitness(name, RATE.name, "scale_std", scale_std, MAX_SCALE_STD)
    for quantity, result in sensor.at_rest.items():
        yield fitness(name, quantity.name, "condition", result.solution.condition, triaxial.MAX_CONDITION)
        if (error := result.solution.attitude_error) is not None:
            at_least = max(error.std_rad - 2 * error.uncertainty_rad, 0.0)  # a few placements determine it poorly
            yield fitness(name, quantity.name, "attitude_error", at_least, MAX_ATTITUDE_ERROR_RAD, unit="rad")


def _solve_turns(read: ExternalReadings, samples: Samples, name: str | None) -> ExternalResult:
    if name not in (None, "by_hand"):
        choose_estimator(("by_hand",), str(name))
    return ExternalResult(read.item, solve_hand_samples(read.item, samples, read.motion), None, {}, {})


def _solve_sweeps(
    read: ExternalReadings, samples: Samples, name: str | None, reference_c: float | None
) -> ExternalResult:
    """Return the solution of a file's sweeps and rests by the estimator `name`; if it is None, one is chosen.

    The readings are first corrected to the temperature `reference_c`, if given.
    """
    chosen = None if name is None else choose_estimator(SWEEP_ESTIMATORS, name)
    data, polynomials = average_sweeps(samples, read.motion), None
    if reference_c is not None and data.turned is not None:
        raise Refused(
            "bad_option",
            "the body was turned from rest to rest, but a calibration over temperature needs mean rates",
            "Give sweeps at constant speed, with speed_rad_s; or leave out --reference-c",
        )
    if reference_c is not None:
        data, polynomials = correct_files(data, reference_c)
    with _mention([omitted for omitted in data.omitted if omitted.what == "rows"]):
        solution, faults = solve_swept(data, chosen), dict[str, Fault]()
    vector = (
        solution
        if isinstance(solution, VectorSolution | TurnedSolution)
        else attempt(faults, VECTOR, lambda: add_errors(_vector(data), data))
    )
    gyroscope = SensorResult(
        sensor=read.item,
        solution=solution,
        vector_model=vector,
        uncertainty=budget_of(solution, data),
        # Three sweeps may do for the vector model, not for the six observations.
        six_observation=attempt(faults, NEWTON, lambda: solve_six_observation(data.sweeps, "newton")),
        algorithm_1=attempt(faults, ALGORITHM_1, lambda: solve_six_observation(data.sweeps, "algorithm_1")),
        observations=data.sweeps,
        rests=data.rests,
        corrected_by=(
            matrix_correction(solution)
            if isinstance(solution, VectorSolution | TurnedSolution)
            else diagonal_correction(solution.scale)
        ),
        faults=faults,
    )
    by_turns = data.turned if isinstance(solution, TurnedSolution) else None
    if polynomials is not None:
        gyroscope, polynomials = add_rate_polynomials(gyroscope, polynomials)
    notes = (*notes_on_speeds(data), *notes_on_scale(solution.scale), *notes_on_changes(data))
    notes += tuple(notes_on_turns(data, solution)) if chosen in (None, "increments") else ()
    omitted = tuple((RATE, part) for part in data.omitted)
    return ExternalResult(
        read.item, gyroscope, None, {}, {}, by_turns, polynomials=polynomials, omitted=omitted, notes=notes
    )


@contextmanager
def _mention(omitted: Sequence[Omitted]) -> Iterator[None]:
    """Add a list of the readings `omitted` so far to the message of any Fault or Refused that the block raises."""
    try:
        yield
    except (Fault, Refused) as error:
        if not omitted:
            raise
        what = f"{error.what}; left out before: {'; '.join(map(str, omitted))}"
        raise type(error)(error.name, what, error.remedy) from None


def solve_swept(data: ExternalData, estimator: BySweeps | None) -> Estimate:
    """Return the solution of sweeps by `estimator`.

    If `estimator` is None, it is "increments" if turns start and end at rest, else "vector". Raise Fault `no_turns` if
    "increments" has no such turns; `bias_jumped`, `scale_changed`, Refused `bad_sweep`, and what the estimators raise.
    """
    if estimator is None:
        estimator = "vector" if data.turned is None else "increments"
    if estimator != "increments":
        check_agree(data)
        check_sweeps_steady(data)
        vector = _vector(data)
        if estimator == "vector":
            return add_errors(vector, data)
        return solve_observations(data.sweeps, estimator, data.rests)
    if data.turned is None:
        raise Fault(
            "no_turns",
            "no row of the sweeps has an angle and begins and ends at rest",
            "Let the body lie still for a second before and after each turn, and give angle_rad; or use vector",
        )
    check_sweeps_steady(data)
    start, turned = _vector(data), data.turned
    solution = solve_turned(turned.gyroscope, turned.turns, turned.means, start.matrix, start.bias_rad_s)
    return widen_by_changes(solution, data)


def budget_of(solution: Estimate, data: ExternalData) -> Budget:
    """Return the budget of a `solution` of sweeps.

    The contributors are the scatter of the means and the errors of the stated motion. A `TurnedSolution`, from stated
    angles of rotation, already contains its budget.
    """
    if data.turned is None or not isinstance(solution, TurnedSolution):
        vector = solution if isinstance(solution, VectorSolution) else _vector(data)
        errors, covariance = sweep_errors(vector, data), solution.covariance
        dof = noise_dof(vector, data) if vector is solution else _fewest_of_means(data)
        if errors is not None and vector is solution:
            covariance = covariance - errors.covariance
        noise = Contributor(NOISE, "A", "normal", None, "", FROM_SCATTER, dof, covariance)
        if errors is None:
            return Budget((noise,))
        sweeps = Contributor(SWEEPS, "A", "normal", None, "", FROM_RESIDUALS, errors.dof, errors.covariance)
        return Budget((noise, sweeps))
    dof_by_name = {NOISE: float(data.turned.noise_dof), BIAS: float(data.turned.bias_dof)}
    dof_by_name |= dict.fromkeys((rotations_by_angle.ENDS, rotations_by_angle.AXES), solution.inflation_dof)
    parts = solution.budget.contributors
    return Budget(tuple(replace(part, dof=dof_by_name.get(part.name, part.dof)) for part in parts))


def _fewest_of_means(data: ExternalData) -> float:
    """Return the smallest degrees of freedom of any mean's noise."""
    return float(dof_by_axis(average.dof for average in [*(sweep.average for sweep in data.sweeps), *data.rests]).min())


def _vector(data: ExternalData) -> VectorSolution:
    try:
        return solve_vector(data.sweeps, data.rests)
    except Fault:
        check_agree(data)  # one wrong row may look like a stuck axis, or like another unit
        raise


def _solve_attitudes(
    read: ExternalReadings, samples: Samples, settings: RunSettings, name: str | None
) -> ExternalResult:
    """Return the solution of all quantities in attitudes by the method `name`; if None, one is chosen for each."""
    method, site, options = find_method(name), settings.site, settings.elsewhere
    assert options is not None, "of readings of others"
    placed = average_placements(samples, read.motion, find_clock=options.find_clock)
    attempts = solve_placed(read.item.name, placed, site, options, method, second_order=settings.second_order)
    rates = attempts.results.get(RATE)
    gyroscope = rates if isinstance(rates, AttitudeCalibration | IncrementCalibration) else None
    return ExternalResult(
        read.item,
        gyroscope=None if gyroscope is None else _gyroscope(read.item, gyroscope, placed.clock),
        rates=gyroscope,
        at_rest={
            quantity: result
            for quantity, result in attempts.results.items()
            if quantity != RATE and isinstance(result, AttitudeCalibration)
        },
        unsolved=attempts.faults,
        omitted=tuple(list_omitted(placed, attempts.results)),
        notes=tuple(gyroscope.notes) if isinstance(gyroscope, IncrementCalibration) else (),
        installed_kinds=tuple(
            KindFound(read.item.name, read.item, quantity, result)
            for quantity, result in attempts.results.items()
            if isinstance(result, OfKind)
        ),
    )


def _gyroscope(item: Item, result: Result, clock: TimeBase | None) -> SensorResult:
    """Return a gyroscope's `result`, obtained in attitudes, in the form of a calibration from sweeps."""
    solution = _describe_as_swept(result)
    if clock is not None and isinstance(result, IncrementCalibration):
        clock = clock.correct(-result.solution.clock_s, result.solution.clock_std_s)
    return SensorResult(
        sensor=item,
        solution=solution,
        vector_model=solution,
        uncertainty=solution.budget,
        time_bases=() if clock is None else (clock,),
        corrected_by=matrix_correction(solution),
        faults=dict.fromkeys((NEWTON, ALGORITHM_1), NO_SWEEPS),
    )


def _describe_as_swept(result: Result) -> TurnedSolution:
    """Return the solution in the form rate = scale × (reading + bias), which solutions of sweeps have too.

    In the solution by attitudes the bias is the reading at rest, so its sign changes.
    """
    solution, matrix = result.solution, result.solution.matrix
    axes = SensorAxes.from_matrix(matrix)
    of_matrix = np.r_[F, OFFSET]
    sign = np.diag(RATE.parameter_signs)
    lines = tuple(replace(line, covariance=sign @ line.covariance @ sign) for line in result.budget.contributors)
    if isinstance(result, IncrementCalibration):
        observations, rank = len(result.solution.residuals_rad), 12
        warnings: tuple[str, ...] = ()
        residuals, estimator = np.zeros((0, 3)), "increments"
    else:
        of_rows = result.solution
        observations, rank, warnings = of_rows.observations, of_rows.rank, of_rows.warnings
        residuals, estimator = of_rows.residuals, str(of_rows.method)
    return TurnedSolution(
        scale=axes.scale,
        bias_rad_s=RATE.offset * solution.bias,
        covariance=sign @ scale_and_bias_covariance(matrix, axes.scale, solution.covariance) @ sign,
        matrix=matrix,
        matrix_covariance=solution.covariance[np.ix_(of_matrix, of_matrix)],
        non_orthogonality_rad=axes.non_orthogonality_rad,
        mounting=axes.mounting,
        angles_covariance_rad2=axes.angles_covariance_rad2(solution.covariance[F, F]),
        residuals_rad_s=residuals,
        inflation=1.0,
        inflation_dof=np.inf,
        budget=Budget(lines),
        observations=observations,
        rank=rank,
        condition=solution.condition,
        iterations=solution.iterations,
        warnings=warnings,
        estimator=estimator,
    )


def _nothing_solved(unsolved: Mapping[Quantity, Fault]) -> Fault | Refused:
    """Return one error that contains the messages of all Faults in `unsolved`; a single Fault is returned unchanged."""
    faults: Sequence[Fault] = list(unsolved.values())
    if len(faults) == 1:
        return faults[0]
    reasons = "; ".join(f"{quantity}: {str(fault).rstrip('.')}" for quantity, fault in unsolved.items())
    return Refused(
        "nothing_solved", f"no sensor has a solution: {reasons}", "Do what the message says about your sensor"
    )
