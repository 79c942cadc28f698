"""Calibration of an accelerometer on an arm from sweeps and attitudes together.

The model is that of `rig.estimation.reference.accelerometer_model`. F, b, the direction of v_ref, the lever arm r, the
delay τ and, if requested, φ are estimated together by generalised least squares with the covariance of the arm's
attitude errors. Each dwell has independent small rotations; the points of a sweep share errors. The size δ of all these
errors is estimated by restricted maximum likelihood over dwells and sweeps
(`rig.estimation.reference.shared_errors`).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from rig.estimation import refusals
from rig.estimation.arrays import Array, scale_of
from rig.estimation.reference.accelerometer_errors import AccelerometerErrors
from rig.estimation.reference.accelerometer_model import (
    DELAY,
    INDEPENDENT_FRACTION,
    LEVER,
    NO_DWELLS,
    NO_SWEEPS,
    PARAMETERS,
    SECOND,
    Dwells,
    Movement,
    Sweeps,
    arm_effects,
    effects,
    jacobian,
    predicted,
)
from rig.estimation.reference.attitude_error import AttitudeError
from rig.estimation.reference.imu_fit import (
    Fit,
    find_free_directions,
    list_fixed,
    most_likely,
    refit_with_components,
    sizes_of,
)
from rig.estimation.reference.linear_start import MAX_CONDITION, REMEDY, linear_start
from rig.estimation.reference.reference_model import BIAS, REFERENCE, matrix
from rig.estimation.reference.shared_errors import add_uncertainty
from rig.estimation.reference.triaxial import check_trustworthy

MODEL = "m = F (s + φ s²) + b, s = Rᵀ v_ref + ω × (ω × (p + r)) + α × (p + r)"


@dataclass(frozen=True, slots=True)
class ImuSolution:
    """An accelerometer's calibration from dwells and sweeps.

    - matrix (3, 3): F, the scale factors and axes; bias_m_s2 (3,): b, the reading at zero specific force.
    - reference_m_s2 (3,): v_ref, the specific force at rest, in base coordinates.
    - lever_arm_m (3,), delay_s: r in the flange's frame, and the filter's lag τ; None without sweeps.
    - second_order_s2_m (3,): quadratic terms φ, None if they were not estimated.
    - covariance (22, 22): in the order F by rows, v_ref, b, r, τ, φ; zero for fixed parameters.
    - response (22, 3 K): derivative of the parameters with respect to the readings.
    - attitude_error: standard deviation δ of the arm's attitudes, about each axis.
    - dwell_residuals_m_s2 (N, 3): readings minus model.
    - chi_square, dof: χ² of the residuals of dwells and sweeps, and its degrees of freedom.
    - rank, condition: rank and condition number of the readings' derivatives, each column scaled to its norm.
    - sensor_errors: errors of the sensor itself, partly estimated; None if unknown.
    - independent_fraction: the fraction of δ² that is independent in each dwell.
    - iterations: number of Gauss-Newton steps.
    - warnings: sentences for people.
    """

    matrix: Array
    bias_m_s2: Array
    reference_m_s2: Array
    lever_arm_m: Array | None
    delay_s: float | None
    second_order_s2_m: Array | None
    covariance: Array
    response: Array
    attitude_error: AttitudeError
    dwell_residuals_m_s2: Array
    chi_square: float
    dof: int
    rank: int
    condition: float
    iterations: int
    warnings: tuple[str, ...]
    sensor_errors: AccelerometerErrors | None = None
    independent_fraction: float = INDEPENDENT_FRACTION

    @property
    def theta(self) -> Array:
        """The parameters (22,) in the order of `rig.estimation.reference.accelerometer_model`."""
        theta = np.zeros(PARAMETERS)
        theta[: LEVER.start] = np.concatenate([self.matrix.ravel(), self.reference_m_s2, self.bias_m_s2])
        if self.lever_arm_m is not None:
            theta[LEVER], theta[DELAY] = self.lever_arm_m, self.delay_s
        if self.second_order_s2_m is not None:
            theta[SECOND] = self.second_order_s2_m
        return theta


def solve_imu(
    dwells: Dwells = NO_DWELLS,
    sweeps: Sweeps = NO_SWEEPS,
    *,
    gravity_m_s2: float,
    up: ArrayLike = (0.0, 0.0, 1.0),
    second_order: bool = False,
    repeatability_rad: float = 0.0,
    sensor_errors: AccelerometerErrors | None = None,
    arm_turns: Array | None = None,
    independent_fractions: Sequence[float] = (INDEPENDENT_FRACTION,),
) -> ImuSolution:
    """Return the calibration of an accelerometer from dwells, sweeps or both.

    v_ref, the specific force at rest in the base frame, has the length `gravity_m_s2` and a positive product with `up`
    (3,). `Movement` explains `repeatability_rad`, `sensor_errors` and `arm_turns`. `independent_fractions` are possible
    values of `Movement.independent_fraction`; the readings select one of them.

    Raise Fault `too_few_observations`, `not_finite`, `bad_variance`, `bad_speed`, `zero_reading`,
    `duplicated_observation`, `bad_attitude`, `rank_deficient`, `ill_conditioned`, `sign_unknown`, `wrong_unit`,
    `mirrored_axis`, `attitude_untrustworthy`; ValueError for a wrong shape, or axes that are not unit vectors.
    """
    movement = Movement(dwells, sweeps, repeatability_rad, sensor_errors, arm_turns)
    fixed = list_fixed(movement, second_order=second_order)
    parameters = PARAMETERS - 1 - len(fixed)
    _check(movement, parameters)
    with refusals.convergence_required():
        start = linear_start(movement, gravity_m_s2, np.asarray(up, dtype=np.float64))
        columns = jacobian(start, movement) @ find_free_directions(start, fixed)
        conditioning = refusals.condition_of(columns / sizes_of(columns), parameters)
        parts = "some of F, bias, reference, lever arm and delay"
        refusals.check_conditioning(conditioning, parameters, MAX_CONDITION, parts, REMEDY)
        fit = most_likely(start, movement, fixed, None)
        if sensor_errors is not None:
            movement, fit = refit_with_components(fit, movement, sensor_errors, fixed, independent_fractions)
        covariance, response = fit.covariance(), fit.response()
        _check_attitudes(start, movement, fixed, fit)
    f = matrix(fit.theta)
    refusals.check_unit(scale_of(f), refusals.UNIT_RATIOS)
    refusals.check_handedness(f)
    residuals = movement.readings() - predicted(fit.theta, movement)
    whitened = fit.readings.whitener(fit.std_rad) @ residuals.ravel()
    count, swept, dof = len(dwells.readings_m_s2), len(sweeps.speeds_rad_s) > 0, len(whitened) - parameters
    return ImuSolution(
        matrix=f,
        bias_m_s2=fit.theta[BIAS],
        reference_m_s2=fit.theta[REFERENCE],
        lever_arm_m=fit.theta[LEVER] if swept else None,
        delay_s=float(fit.theta[DELAY]) if swept else None,
        second_order_s2_m=fit.theta[SECOND] if second_order else None,
        covariance=covariance,
        response=response,
        attitude_error=add_uncertainty(fit.readings, fit.std_rad, fit.jacobian),
        dwell_residuals_m_s2=residuals[:count],
        chi_square=float(whitened @ whitened),
        dof=dof,
        rank=conditioning.rank,
        condition=conditioning.condition,
        iterations=fit.iterations,
        sensor_errors=movement.sensor_errors,
        independent_fraction=movement.independent_fraction,
        warnings=refusals.warn_of_residuals(whitened, np.ones_like(whitened), dof),
    )


def _check_attitudes(start: Array, movement: Movement, fixed: list[int], fit: Fit) -> None:
    """Raise Fault if all attitudes are wrong, or if one is wrong and the others suffice to identify it."""
    enough = len(movement.dwells.readings_m_s2) > 0 and movement.readings().size - 3 > fit.free.shape[1] + 3
    check_trustworthy(fit.std_rad, lambda: _find_worst_dwell(start, movement, fixed, fit), enough=enough)


def _find_worst_dwell(start: Array, movement: Movement, fixed: list[int], fit: Fit) -> tuple[int, float, float]:
    """Return the index of the dwell that fits worst, and two errors in rad from a fit to all others.

    The first is the error of that dwell's attitude, the second the standard deviation of the others.
    """
    count = len(movement.dwells.readings_m_s2)
    residuals = (movement.readings() - predicted(fit.theta, movement))[:count]
    rotations = effects(fit.theta, movement)[: 3 * count].reshape(count, 3, -1)
    spread = movement.dwells.variances_m2_s4[..., None] * np.eye(3) + fit.std_rad**2 * rotations @ rotations.swapaxes(
        1, 2
    )
    misfit = np.sum(residuals * np.linalg.solve(spread, residuals[..., None])[..., 0], axis=1)
    worst = int(np.argmax(misfit))
    rest = most_likely(start, movement.omit(worst), fixed, None)
    missed = (movement.readings() - predicted(rest.theta, movement))[worst]
    rotation = arm_effects(rest.theta, movement)[3 * worst : 3 * worst + 3, 3 * worst : 3 * worst + 3]
    error_rad = np.linalg.lstsq(rotation, missed, rcond=1e-6)[0]  # rotations about the reference are not identifiable
    return worst, float(np.linalg.norm(error_rad)), rest.std_rad


def _check(movement: Movement, parameters: int) -> None:
    """Raise as `solve_imu` does for inputs of a wrong shape, number, value or rank, to fit so many `parameters`."""
    dwells, sweeps = movement.dwells, movement.sweeps
    count, swept = len(dwells.readings_m_s2), len(sweeps.speeds_rad_s)
    shapes = (
        ("readings", dwells.readings_m_s2, (count, 3)),
        ("variances", dwells.variances_m2_s4, (count, 3)),
        ("attitudes", dwells.attitudes, (count, 3, 3)),
        ("harmonics", sweeps.harmonics_m_s2, (swept, 3, 3)),
        ("sway", sweeps.swayed_m_s2, (swept, 3, 3)),
        ("covariances", sweeps.covariances_m2_s4, (swept, 9, 9)),
        ("axes", sweeps.axes_flange, (swept, 3)),
        ("speeds", sweeps.speeds_rad_s, (swept,)),
        ("attitudes of sweeps", sweeps.attitudes, (swept, 3, 3)),
        ("arms", sweeps.arms_m, (swept, 3)),
        ("stations", sweeps.stations.astype(np.float64), (swept,)),
    )
    for name, array, shape in shapes:
        refusals.require_shape(name, array, shape)
    refusals.check_count(count + 3 * swept, -(-parameters // 3), parameters)
    refusals.check_finite(**{name: array for name, array, _ in shapes})
    refusals.check_variances(dwells.variances_m2_s4)
    refusals.check_variances(np.asarray(np.linalg.eigvalsh(sweeps.covariances_m2_s4), dtype=np.float64))
    if (np.abs(np.linalg.norm(sweeps.axes_flange, axis=1) - 1) > 1e-6).any():
        raise ValueError("axes must be unit vectors")
    refusals.check_speeds(np.abs(sweeps.speeds_rad_s))
    for attitudes in (dwells.attitudes, sweeps.attitudes):
        refusals.check_rotations(attitudes)
    for readings in (dwells.readings_m_s2, sweeps.harmonics_m_s2.reshape(-1, 9)):
        refusals.check_signal(readings)
        refusals.check_duplicates(readings)
