"""From readings in known attitudes to calibrations: gyroscope, accelerometer and magnetometer, as TRIAX has them."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from typing import Literal, get_args

import numpy as np

from rig.analysis.calibration import or_fault
from rig.analysis.increments import InIncrements, solve_turning
from rig.errors import Fault, Refused
from rig.estimation.arrays import Array
from rig.estimation.earth_rate import check_earth_seen
from rig.estimation.known_increments import KnownIncrements
from rig.estimation.reference_budget import scale_and_bias
from rig.estimation.reference_model import REFERENCE, Known, KnownNorm, KnownVector
from rig.estimation.refusals import check_axes
from rig.estimation.triaxial import EqualWeights, Method, TriaxialSolution, solve_triaxial
from rig.observation.attitude_import import PlacedReadings
from rig.observation.csv_samples import Quantity

Chosen = Method | Literal["increments"]
METHODS: tuple[Method, ...] = (*get_args(EqualWeights), "attitude_weighted")
CHOICES: tuple[Chosen, ...] = ("increments", *METHODS)
SEEN = 3.0  # standard deviations that the largest second-order term must have
NOT_SEEN = "Leave out --second-order: it would triple the uncertainty of the bias for nothing; or dwell longer"
UPWARDS = dict(zip(("+x", "+y", "+z", "-x", "-y", "-z"), np.concatenate([np.eye(3), -np.eye(3)]), strict=True))


@dataclass(frozen=True, slots=True)
class Surrounding:
    """What is known of the place: the size of gravity, that of the magnetic field or None, and the table's upward axis.

    `field_upwards` where the field rises from the ground, as it does south of the magnetic equator. `any_mounting`
    where the sensor's axes need not point along those of the body whose attitudes are given.
    """

    gravity_m_s2: float
    field_t: float | None
    up: str
    field_upwards: bool = False
    any_mounting: bool = False

    def known(self, quantity: Quantity, placed: PlacedReadings, *, exact_rates: bool) -> Known:
        """What the reference of a quantity is. Raises Fault `no_rates`, `field_strength_unknown`."""
        up = UPWARDS[self.up]
        if quantity == "acceleration":
            return KnownNorm(self.gravity_m_s2, up)
        if quantity == "rate":
            if placed.rates_rad_s is None or not exact_rates:
                raise Fault(
                    "no_rates",
                    "the attitudes do not say how the table turned, or not that it is exact",
                    "Use increments, which need no rates; or give the columns rate_x_rad_s, rate_y_rad_s, rate_z_rad_s "
                    "in body coordinates, with --exact-rates where their noise is far below the sensor's",
                )
            return KnownVector(placed.rates_rad_s)
        if self.field_t is None:
            raise Fault(
                "field_strength_unknown",
                "the size of the magnetic field is not given, and the scale of a magnetometer is relative to it",
                "Give --field-t, in tesla, as a reference magnetometer measured it where the sensor was",
            )
        return KnownNorm(self.field_t, up if self.field_upwards else -up)


@dataclass(frozen=True, slots=True)
class InAttitudes:
    """One quantity's calibration by the chosen method, and by each of the others, or the Fault that it ends in.

    `reference_fault` says why what was found as the reference, a gyroscope's Earth's rate, is not it.
    """

    solution: TriaxialSolution
    beside: Mapping[Method, TriaxialSolution | Fault]
    reference_fault: Fault | None = None


Result = InAttitudes | InIncrements


def solve_placed(
    placed: PlacedReadings,
    surrounding: Surrounding,
    method: Chosen | None,
    *,
    second_order: bool,
    exact_rates: bool = False,
    window_s: float | None = None,
) -> dict[Quantity, Result | Fault]:
    """Every quantity that was recorded, by `method`; None chooses the one that suits it.

    That is "attitude_weighted", and for a gyroscope "increments" (over windows of `window_s`), or with `exact_rates`
    "maximum_likelihood".
    """

    def solved(quantity: Quantity) -> Result:
        if quantity == "rate":
            chosen = method or ("maximum_likelihood" if exact_rates else "increments")
            if chosen == "increments":
                assert placed.turning is not None  # there are readings of the rate
                return solve_turning(placed.turning, window_s, any_mounting=surrounding.any_mounting)
        else:
            chosen = "attitude_weighted" if method is None or method == "increments" else method
        known = surrounding.known(quantity, placed, exact_rates=exact_rates)
        second = second_order and quantity == "acceleration"
        return _solved(placed, quantity, known, chosen, second_order=second, any_mounting=surrounding.any_mounting)

    return {quantity: or_fault(partial(solved, quantity)) for quantity in placed.means}


def known_method(name: str | None) -> Chosen | None:
    """Raises Refused `unknown_estimator`."""
    for method in CHOICES:
        if name == method:
            return method
    if name is None:
        return None
    raise Refused("unknown_estimator", f"there is no {name} for readings in attitudes", f"Use {', '.join(CHOICES)}")


def _solved(
    placed: PlacedReadings,
    quantity: Quantity,
    known: Known,
    method: Method,
    *,
    second_order: bool,
    any_mounting: bool,
) -> InAttitudes:
    means = placed.means[quantity]
    if placed.variances is None:
        variances = _scatter(placed, means, known, second_order=second_order)
    else:
        variances = placed.variances[quantity]
    solve = partial(_solve, placed, means, variances, known, second_order=second_order)
    solution = solve(method=method)
    if second_order:
        std = np.sqrt(np.diag(solution.covariance)[15:18])
        check_seen(solution.second_order, std, NOT_SEEN)
    if not any_mounting:
        check_axes(solution.matrix / np.linalg.norm(solution.matrix, axis=1, keepdims=True), np.eye(3))
    others = [each for each in METHODS if each != method and (each != "attitude_weighted" or quantity != "rate")]
    beside = {other: or_fault(partial(solve, method=other)) for other in others}
    return InAttitudes(solution, beside, _not_the_earth(solution) if quantity == "rate" else None)


def _not_the_earth(solution: TriaxialSolution) -> Fault | None:
    """Why what a gyroscope's rates leave over is not the Earth's rate: as in a run, it must be seen to a tenth."""
    try:
        check_earth_seen(solution.reference, solution.covariance[REFERENCE, REFERENCE])
    except Fault as fault:
        return fault
    return None


def _solve(
    placed: PlacedReadings, means: Array, variances: Array, known: Known, *, method: Method, second_order: bool
) -> TriaxialSolution:
    """Raises Fault as `solve_triaxial` does, and `inverted_attitudes`."""

    def solved(attitudes: Array) -> TriaxialSolution:
        return solve_triaxial(
            means,
            attitudes,
            variances,
            known,
            second_order=second_order,
            method=method,
            attitude_std_rad=placed.attitude_std_rad,
        )

    try:
        return solved(placed.attitudes)
    except Fault as fault:
        if fault.name != "attitude_untrustworthy":
            raise
        try:
            solved(np.swapaxes(placed.attitudes, -1, -2))
        except Fault:
            raise fault from None
        raise Fault(
            "inverted_attitudes",
            "the readings contradict the attitudes and agree with their inverses",
            "Give quaternions that take body to table coordinates: conjugate those that take table to body",
        ) from None


def _scatter(placed: PlacedReadings, means: Array, known: Known, *, second_order: bool) -> Array:
    """(N, 3) variances of the means from how they scatter about the model, each axis' noise alike in all rows.

    Equal weights: the model that weighs attitude errors would take them for noise here.
    """
    counts = placed.samples[:, None]
    quiet = np.full_like(means, (1e-9 * np.abs(means).max()) ** 2) / counts
    left = solve_triaxial(means, placed.attitudes, quiet, known, second_order=second_order).residuals
    freedom = len(means) - (18 if second_order else 15) / 3
    if freedom < 1:
        raise Fault(
            "too_few_observations",
            f"{len(means)} rows of few samples do not show their noise",
            "Give longer rows, or more of them",
        )
    variances: Array = np.maximum(np.sum(left**2 * counts, axis=0) / freedom, 1e-30) / counts
    return variances


def check_seen(second_order: Array | None, std: Array, remedy: str) -> None:
    """Whether any of the terms φ (3,) that were asked for is told. Raises Fault `second_order_not_seen`."""
    assert second_order is not None
    largest = float(np.max(np.abs(second_order) / std))
    if largest < SEEN:
        raise Fault(
            "second_order_not_seen", f"no second-order term is beyond {largest:.1f} of its standard deviations", remedy
        )


def in_unit(solution: TriaxialSolution | KnownIncrements) -> tuple[Array, Array]:
    """Scale factors 1/‖row of F‖ (3,), and the standard deviations of them and of the bias (6,)."""
    scale = 1 / np.linalg.norm(solution.matrix, axis=1)
    return scale, np.sqrt(np.diag(scale_and_bias_covariance(solution.matrix, scale, solution.covariance)))


def scale_and_bias_covariance(matrix: Array, scale: Array, covariance: Array) -> Array:
    """(6, 6) from that of a reference model's parameters; b is part of the reading, a gyroscope's is added to it."""
    jacobian = scale_and_bias(matrix, scale, len(covariance))
    found: Array = jacobian @ covariance @ jacobian.T
    return found
