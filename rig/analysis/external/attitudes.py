"""The calibration of gyroscope, accelerometer and magnetometer in known attitudes, as in the paper TRIAX."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import partial
from typing import Literal, get_args

import numpy as np

from rig.analysis.estimator_names import choose_estimator
from rig.analysis.external.attitude_budget import budget_by_causes, noise_dof
from rig.analysis.external.attitude_equations import Equations
from rig.analysis.external.changes import check_steady
from rig.analysis.external.increment_calibration import IncrementCalibration, solve_turning
from rig.analysis.installed_solvers import OfKind
from rig.analysis.reference.triad import Triad, check_identifiable, check_mounted, field_reference, gravity_reference
from rig.data.installed_kinds import installed_kinds
from rig.data.quantity import ACCELERATION, RATE, Quantity
from rig.data.recording.settings import Site, SolveOptions
from rig.errors import Fault, or_fault
from rig.errors.attempts import Attempts, attempt_each
from rig.estimation.external.placement import NOISE, PlacementSolution, laid_down
from rig.estimation.external.placement_changes import find_placement_change
from rig.estimation.external.sole_attitude import find_sole_attitude
from rig.estimation.gyroscope.budget import Budget
from rig.estimation.gyroscope.earth_rate import check_earth_rate
from rig.estimation.reference.accelerometer_model import Dwells
from rig.estimation.reference.reference_model import BIAS, REFERENCE, SECOND, F
from rig.estimation.reference.triaxial import EqualWeights, Method, TriaxialSolution
from rig.observation.external.attitude_import import PlacedReadings
from rig.observation.external.placements import Placements
from rig.observation.external.reference_rows import Turning
from rig.observation.false_readings import check_frozen
from rig.observation.statistics.mean import StaticReading
from rig.observation.stuck_check import check_reads

Chosen = Method | Literal["increments"]
METHODS: tuple[Method, ...] = (*get_args(EqualWeights), "attitude_weighted")
CHOICES: tuple[Chosen, ...] = ("increments", *METHODS)
TOO_LITTLE_DATA = ("too_few_observations", "rank_deficient", "ill_conditioned")
ORDER_REMEDY = "Leave out --second-order: it would triple the uncertainty of the bias for nothing; or dwell longer"
ROUNDING_RATIO = 1e-9  # standard deviation over mean, below which all readings were the same


@dataclass(frozen=True, slots=True)
class AttitudeCalibration:
    """One quantity's calibration by the chosen method.

    - triad: scale and axes.
    - other_methods: the solutions by the other methods, or the Fault of a method that fails.
    - budget: the contributors to the uncertainty.
    - measurements: the mean readings with their attitudes.
    - reference_fault: the Fault that says why a gyroscope's estimated reference is not the Earth's rate, or None.
    - laid: the solution with placement errors, None by methods without them.
    - unplaced_rests: the number of rests without an attitude that contribute to `laid`.
    - moving: the number of rows left out because the body moved.
    - dwells: the placements with their mean readings and times; empty for a gyroscope.
    """

    solution: TriaxialSolution
    triad: Triad
    other_methods: Attempts[Method, TriaxialSolution]
    budget: Budget
    measurements: Dwells
    reference_fault: Fault | None = None
    laid: PlacementSolution | None = None
    unplaced_rests: int = 0
    moving: int = 0
    dwells: tuple[StaticReading, ...] = ()


Result = AttitudeCalibration | IncrementCalibration


def solve_placed(
    name: str, placed: PlacedReadings, site: Site, options: SolveOptions, method: Chosen | None, *, second_order: bool
) -> Attempts[Quantity, Result | OfKind]:
    """Return the calibration of every recorded quantity of a sensor by `method`, or its Fault.

    If `method` is None, gyroscopes are solved by "increments", or by "maximum_likelihood" if the options state that
    rates are exact (`exact_rates`); other sensors are solved by "attitude_weighted", also if `method` is "increments".
    Sensors of kinds that plug-ins add are solved by these, whatever the method.
    """
    any_mounting, exact_rates = options.any_mounting, options.exact_rates

    def solve_rate(turning: Turning) -> Result:
        check_reads(turning.readings_rad_s, RATE)
        check_frozen(turning.time_s, turning.readings_rad_s)
        chosen = method or ("maximum_likelihood" if exact_rates else "increments")
        if chosen != "increments":
            return _solve_rows(Equations.from_rows(placed, exact_rates=exact_rates), chosen, any_mounting=any_mounting)
        return solve_turning(turning, options.window_s, any_mounting=any_mounting)

    solvers = {kind.quantity: kind.solve for kind in installed_kinds()}

    def solve_reference(quantity: Quantity, placements: Placements | Fault) -> Result | OfKind:
        if not isinstance(placements, Fault):
            _check_noisy(placements, quantity)
            if quantity in solvers:
                of_kind: OfKind = solvers[quantity](name, placements, site)
                return of_kind
        # Raises if the field's strength is not stated: this is named before the Fault of the placements.
        norm = gravity_reference(site) if quantity == ACCELERATION else field_reference(site, "--field-t, in tesla")
        if isinstance(placements, Fault):
            raise placements
        chosen = "attitude_weighted" if method is None or method == "increments" else method
        equations = Equations.from_placements(placements, quantity, norm, second_order=second_order)
        return _solve_placements(placements, quantity, equations, chosen, any_mounting=any_mounting)

    solves = dict[Quantity, Callable[[], Result | OfKind]]()
    for quantity in (one for one in placed.quantities if not options.only or one.sensor in options.only):
        if quantity == RATE and placed.turning is not None:
            solves[quantity] = partial(solve_rate, placed.turning)
        elif placed.placements is not None:
            solves[quantity] = partial(solve_reference, quantity, placed.placements)
    return attempt_each(solves)


def _check_noisy(placements: Placements, quantity: Quantity) -> None:
    """Raise Fault `stuck_sensor` if an axis reads the same value throughout a placement."""
    read = placements.read
    nothing = read.variances[quantity] <= (ROUNDING_RATIO * read.means[quantity]) ** 2
    for row, axis in np.argwhere(nothing)[:1]:
        window, reads = read.windows[row], read.means[quantity][row, axis]
        raise Fault(
            "stuck_sensor",
            f"from {window.start_s:.4g} to {window.end_s:.4g} s the {quantity.sensor} always reads {reads:g} "
            f"{quantity.unit} on {quantity.axes[axis]}: it is stuck, at the end of its range, or too coarse to show "
            "its noise",
            "Check its supply, its bus wires and its range; record with all digits",
        )


def find_method(name: str | None) -> Chosen | None:
    """Return the method called `name`, or None if `name` is None. Raise Refused `unknown_estimator`."""
    return None if name is None else choose_estimator(CHOICES, name)


def _solve_rows(equations: Equations, method: Method, *, any_mounting: bool) -> AttitudeCalibration:
    """Return a gyroscope's calibration from the mean rates in all attitudes, with the other methods' solutions."""
    solution = equations.solve(method)
    if not any_mounting:
        check_mounted(solution.matrix)
    budget = budget_by_causes(solution.matrix, {NOISE: solution.covariance}, float(equations.dof.min()))
    other_methods = equations.solve_others(method, *get_args(EqualWeights))
    return AttitudeCalibration(
        solution,
        Triad.from_solution(solution),
        other_methods,
        budget,
        equations.measurements,
        or_fault(partial(check_earth_rate, solution.reference, solution.covariance[REFERENCE, REFERENCE])),
    )


def _solve_placements(
    placements: Placements, quantity: Quantity, equations: Equations, method: Method, *, any_mounting: bool
) -> AttitudeCalibration:
    """Return a sensor's calibration from placements; "attitude_weighted" also estimates placement errors.

    Raise Fault `bias_jumped` or `scale_changed` if the sensor changed abruptly by more than U covers, and the Faults of
    `Equations.solve`, `check_identifiable` and `check_mounted`; `too_few_observations` if a scale factor depends on a
    single placement.
    """
    unplaced, moving = placements.unplaced, placements.left_out
    solution, laid = _solve(equations, method, placements), None
    _check_not_sole(solution, equations, placements, quantity)
    if method == "attitude_weighted":
        laid = laid_down(solution.theta, equations.placed, unplaced.means[quantity], unplaced.variances[quantity])
        starts_s = np.array([window.start_s for window in placements.read.windows])
        change = find_placement_change(laid.theta, equations.placed, starts_s)
        check_steady(change, quantity)
        if change is not None:
            laid = laid.add_change(change)
        solution = _replace_parameters(solution, laid)
    if solution.second_order is not None:
        check_identifiable(solution.second_order, np.sqrt(np.diag(solution.covariance)[SECOND]), ORDER_REMEDY)
    if not any_mounting:
        check_mounted(solution.matrix)
    causes = {NOISE: solution.covariance} if laid is None else laid.causes
    budget = budget_by_causes(solution.matrix, causes, noise_dof(solution, equations))
    return AttitudeCalibration(
        solution,
        Triad.from_solution(solution),
        equations.solve_others(method, *METHODS),
        budget,
        equations.measurements,
        laid=laid,
        unplaced_rests=len(unplaced.windows),
        moving=moving,
        dwells=tuple(_dwells(placements, quantity)),
    )


def _check_not_sole(
    solution: TriaxialSolution, equations: Equations, placements: Placements, quantity: Quantity
) -> None:
    """Raise Fault `too_few_observations` if a scale factor depends on a single attitude."""
    sole = find_sole_attitude(solution.theta, equations.placed)
    if sole is None:
        return
    axis, placement = sole
    window = placements.read.windows[placement]
    raise Fault(
        "too_few_observations",
        f"the scale factor of {quantity.sensor} {quantity.axes[axis]} depends on one attitude, from "
        f"{window.start_s:.4g} to {window.end_s:.4g} s: if that is wrong, no other attitude shows it",
        "Let the body lie still in more attitudes: with each axis up, down and tilted",
    )


def _dwells(placements: Placements, quantity: Quantity) -> Iterator[StaticReading]:
    read = placements.read
    for number, (attitude, window) in enumerate(zip(placements.attitudes, read.windows, strict=True)):
        yield StaticReading(number, f"placement {number + 1}", read.mean(quantity, number), attitude.T, window)


def _solve(equations: Equations, method: Method, placements: Placements) -> TriaxialSolution:
    """Return the solution of the equations. If rests are too few, the Fault also mentions the rows left out."""
    try:
        return equations.solve(method)
    except Fault as fault:
        if not placements.omitted or fault.name not in TOO_LITTLE_DATA:
            raise
        what = f"{fault.what}; left out, because only rests give a reference: {'; '.join(map(str, placements.omitted))}"
        raise Fault(fault.name, what, fault.remedy) from None


def _replace_parameters(solution: TriaxialSolution, laid: PlacementSolution) -> TriaxialSolution:
    """Return the solution with the parameters, covariance and attitude error of the fit with placement errors."""
    theta = laid.theta
    return replace(
        solution,
        matrix=theta[F].reshape(3, 3),
        reference=theta[REFERENCE],
        bias=theta[BIAS],
        second_order=None if solution.second_order is None else theta[15:],
        covariance=laid.covariance,
        attitude_error=laid.attitude_error,
    )
