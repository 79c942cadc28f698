"""An accelerometer calibrated on an arm from sweeps and attitudes together.

The model is that of `rig.estimation.reference.accelerometer_model`. F, b, the direction of v_ref, the lever arm r, the
delay τ and, where wanted, φ are found together, by weighted least squares; the weights allow for an arm that is not
quite where it says. Each dwell is turned by small angles of its own, the points of a sweep by errors that they share,
all of the common size δ: restricted likelihood over dwells and sweeps together finds it
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
    LEVER,
    NO_DWELLS,
    NO_SWEEPS,
    OWN_SHARE,
    PARAMETERS,
    SECOND,
    Dwells,
    Movement,
    Sweeps,
    effects,
    jacobian,
    predicted,
    turned,
)
from rig.estimation.reference.attitude_error import AttitudeError
from rig.estimation.reference.imu_fit import Fit, as_expected, free_ways, held_still, most_likely, sizes_of
from rig.estimation.reference.linear_start import MAX_CONDITION, REMEDY, linear_start
from rig.estimation.reference.reference_model import BIAS, REFERENCE, matrix
from rig.estimation.reference.shared_errors import with_uncertainty
from rig.estimation.reference.triaxial import check_trustworthy

MODEL = "m = F (s + φ s²) + b, s = Rᵀ v_ref + ω × (ω × (p + r)) + α × (p + r)"


@dataclass(frozen=True, slots=True)
class ImuSolution:
    """An accelerometer's calibration from dwells and sweeps.

    - `matrix` F (3, 3), `bias_m_s2` b (3,), `reference_m_s2` v_ref (3,) in base coordinates.
    - `lever_arm_m` r (3,) in the flange's frame and `delay_s` τ, None without sweeps; `second_order_s2_m` φ (3,) or
      None.
    - `covariance` (22, 22): the rows of F, v_ref, b, r, τ, φ (`rig.estimation.reference.accelerometer_model`); zero for
      what was held. `response` (22, 3 K): how they change with the readings.
    - `attitude_error`: δ of the arm, about each axis.
    - `dwell_residuals_m_s2` (N, 3): reading less model; `chi_square` of these and of the sweeps', which
      left `freedom`.
    - `rank`, `condition`: of the readings' derivatives, each column in its own size.
    - `own`: what the sensor adds, with what the readings say of it; None where nothing is known. `own_share`: of δ².
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
    freedom: int
    rank: int
    condition: float
    iterations: int
    warnings: tuple[str, ...]
    own: AccelerometerErrors | None = None
    own_share: float = OWN_SHARE

    @property
    def theta(self) -> Array:
        """(22,) parameters as `rig.estimation.reference.accelerometer_model` orders them."""
        found = np.zeros(PARAMETERS)
        found[: LEVER.start] = np.concatenate([self.matrix.ravel(), self.reference_m_s2, self.bias_m_s2])
        if self.lever_arm_m is not None:
            found[LEVER], found[DELAY] = self.lever_arm_m, self.delay_s
        if self.second_order_s2_m is not None:
            found[SECOND] = self.second_order_s2_m
        return found


def solve_imu(
    dwells: Dwells = NO_DWELLS,
    sweeps: Sweeps = NO_SWEEPS,
    *,
    gravity_m_s2: float,
    up: ArrayLike = (0.0, 0.0, 1.0),
    second_order: bool = False,
    repeatability_rad: float = 0.0,
    own: AccelerometerErrors | None = None,
    arm_turns: Array | None = None,
    own_shares: Sequence[float] = (OWN_SHARE,),
) -> ImuSolution:
    """Calibrate from dwells, sweeps or both.

    `gravity_m_s2` is the size of v_ref, `up` (3,) says to which side of the base it points, roughly.
    `repeatability_rad`, `own`, `arm_turns`: see `Movement`; of `own_shares` the readings tell which.

    Raises Fault `too_few_observations`, `not_finite`, `bad_variance`, `bad_speed`, `zero_reading`,
    `duplicated_observation`, `bad_attitude`, `rank_deficient`, `ill_conditioned`, `sign_unknown`, `wrong_unit`,
    `mirrored_axis`, `attitude_untrustworthy`; ValueError for a wrong shape, or axes that are no unit vectors.
    """
    movement = Movement(dwells, sweeps, repeatability_rad, own, arm_turns)
    held = held_still(movement, second_order=second_order)
    needed = PARAMETERS - 1 - len(held)
    _check(movement, needed)
    with refusals.convergence_required():
        start = linear_start(movement, gravity_m_s2, np.asarray(up, dtype=np.float64))
        columns = jacobian(start, movement) @ free_ways(start, held)
        told = refusals.condition_of(columns / sizes_of(columns), needed)
        what = "some of F, bias, reference, lever arm and delay"
        refusals.check_conditioning(told, needed, MAX_CONDITION, what, REMEDY)
        fit = most_likely(start, movement, held, None)
        if own is not None:
            movement, fit = as_expected(fit, movement, own, held, own_shares)
        covariance, response = fit.covariance(), fit.response()
        _check_attitudes(start, movement, held, fit)
    f = matrix(fit.theta)
    refusals.check_unit(scale_of(f))
    refusals.check_handedness(f)
    residuals = movement.readings() - predicted(fit.theta, movement)
    white = fit.readings.white(fit.std_rad) @ residuals.ravel()
    count, swept, freedom = len(dwells.readings_m_s2), len(sweeps.speeds_rad_s) > 0, len(white) - needed
    return ImuSolution(
        matrix=f,
        bias_m_s2=fit.theta[BIAS],
        reference_m_s2=fit.theta[REFERENCE],
        lever_arm_m=fit.theta[LEVER] if swept else None,
        delay_s=float(fit.theta[DELAY]) if swept else None,
        second_order_s2_m=fit.theta[SECOND] if second_order else None,
        covariance=covariance,
        response=response,
        attitude_error=with_uncertainty(fit.readings, fit.std_rad, fit.jacobian),
        dwell_residuals_m_s2=residuals[:count],
        chi_square=float(white @ white),
        freedom=freedom,
        rank=told.rank,
        condition=told.condition,
        iterations=fit.iterations,
        own=movement.own,
        own_share=movement.own_share,
        warnings=refusals.warn_of_residuals(white, np.ones_like(white), freedom),
    )


def _check_attitudes(start: Array, movement: Movement, held: list[int], fit: Fit) -> None:
    """Raises Fault where attitudes are off: all, or the dwell that fits worst where enough others are left to tell."""
    enough = len(movement.dwells.readings_m_s2) > 0 and movement.readings().size - 3 > fit.free.shape[1] + 3
    check_trustworthy(fit.std_rad, lambda: _furthest_off(start, movement, held, fit), enough=enough)


def _furthest_off(start: Array, movement: Movement, held: list[int], fit: Fit) -> tuple[int, float, float]:
    """The dwell that fits worst, by how much the others say it is off, rad, and their own δ."""
    count = len(movement.dwells.readings_m_s2)
    residuals = (movement.readings() - predicted(fit.theta, movement))[:count]
    off_by = effects(fit.theta, movement)[: 3 * count].reshape(count, 3, -1)
    spread = movement.dwells.variances_m2_s4[..., None] * np.eye(3) + fit.std_rad**2 * off_by @ off_by.swapaxes(1, 2)
    misfit = np.sum(residuals * np.linalg.solve(spread, residuals[..., None])[..., 0], axis=1)
    worst = int(np.argmax(misfit))
    rest = most_likely(start, movement.without(worst), held, None)
    missed = (movement.readings() - predicted(rest.theta, movement))[worst]
    own = turned(rest.theta, movement)[3 * worst : 3 * worst + 3, 3 * worst : 3 * worst + 3]
    off = np.linalg.lstsq(own, missed, rcond=1e-6)[0]  # about the reference itself nothing can be told
    return worst, float(np.linalg.norm(off)), rest.std_rad


def _check(movement: Movement, needed: int) -> None:
    dwells, sweeps = movement.dwells, movement.sweeps
    count, swept = len(dwells.readings_m_s2), len(sweeps.speeds_rad_s)
    shapes = (
        ("readings", dwells.readings_m_s2, (count, 3)),
        ("variances", dwells.variances_m2_s4, (count, 3)),
        ("attitudes", dwells.attitudes, (count, 3, 3)),
        ("harmonics", sweeps.harmonics_m_s2, (swept, 3, 3)),
        ("covariances", sweeps.covariances_m2_s4, (swept, 9, 9)),
        ("axes", sweeps.axes_flange, (swept, 3)),
        ("speeds", sweeps.speeds_rad_s, (swept,)),
        ("attitudes of sweeps", sweeps.attitudes, (swept, 3, 3)),
        ("arms", sweeps.arms_m, (swept, 3)),
        ("stations", sweeps.stations.astype(np.float64), (swept,)),
    )
    for name, array, shape in shapes:
        refusals.require_shape(name, array, shape)
    refusals.check_count(count + 3 * swept, -(-needed // 3), needed)
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
