"""The vector model with errors common to many observations, each with a prior standard deviation.

A twist of the arm's wrist rotates the axis of every sweep beyond it; a nonlinear sensor has the same error in every
fast sweep. Each such error e (zero on average, of standard deviation 1 in its own unit) adds B e to the readings:

    m = F ω + c (+ G a) + B e,   e ~ N(0, I)

F, c, e and, with the apparent gravity a, the g-sensitivity G are estimated together (the mixed model of Henderson,
Biometrics 31 (1975) 423). The result is corrected for the part of e that sweeps and rests determine; the other part is
predicted as zero.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from rig.estimation.arrays import Array
from rig.estimation.gyroscope.vector_model import (
    VectorSolution,
    design_matrix,
    index_coefficients,
    propagate_speed_std,
    regress,
    solve_vector_model,
)
from rig.estimation.sensor_axes import angle_jacobian, parameter_jacobian

MAX_ITERATIONS = 2  # B depends on F, and the first F is already within one percent


@dataclass(frozen=True, slots=True)
class CommonErrors:
    """The best linear unbiased prediction of the errors.

    `sizes` (P,) are in prior standard deviations, with the posterior `covariance` (P, P); `readings_rad_s` (N, 3) are
    the effects of the errors on the mean readings.
    """

    sizes: Array
    covariance: Array
    readings_rad_s: Array


def solve_with_common_errors(
    means_rad_s: ArrayLike,
    rates_rad_s: ArrayLike,
    variances_rad2_s2: ArrayLike,
    effects: Callable[[Array], Array],
    *,
    speed_std_rad_s: Array,
    gravity_m_s2: Array | None = None,
    nominal_mounting: Array | None = None,
    shared_covariance_rad2_s2: Array | None = None,
) -> tuple[VectorSolution, CommonErrors]:
    """Return the solution of the vector model corrected for common errors, and the estimated errors.

    `effects` takes F (3, 3) and returns B (P, N, 3): the change of the readings, rad/s, by one standard deviation of
    each error. The other arguments are those of `solve_vector_model`. The solution's `covariance`, `matrix_covariance`
    and `response` are due to the readings alone; `angles_covariance_rad2` includes the common errors that remain. Raise
    Fault as `solve_vector_model` does.
    """
    means, rates, variances = (np.asarray(a, dtype=np.float64) for a in (means_rad_s, rates_rad_s, variances_rad2_s2))

    def solve(effect_rad_s: Array) -> VectorSolution:
        return solve_vector_model(
            means - effect_rad_s,
            rates,
            variances,
            speed_std_rad_s=speed_std_rad_s,
            gravity_m_s2=gravity_m_s2,
            nominal_mounting=nominal_mounting,
            shared_covariance_rad2_s2=shared_covariance_rad2_s2,
        )

    design = design_matrix(rates, gravity_m_s2)
    shared = np.zeros((len(means), len(means))) if shared_covariance_rad2_s2 is None else shared_covariance_rad2_s2

    def estimate(matrix: Array) -> tuple[Array, Array, Array, CommonErrors]:
        speed_noise = propagate_speed_std(rates, speed_std_rad_s, matrix)
        noise = np.array([np.diag(axis) for axis in (variances + speed_noise**2).T]) + shared  # (3, N, N)
        error_patterns = effects(matrix)
        gain, covariance = _gain(design, error_patterns, noise)
        # The gain applies to the means themselves, because it maps what F, c and G explain to zero.
        sizes = np.einsum("pni,ni->p", gain, means)
        errors = CommonErrors(sizes, covariance, np.einsum("p,pni->ni", sizes, error_patterns))
        return speed_noise, error_patterns, gain, errors

    solution = solve(np.zeros_like(means))
    speed_noise, error_patterns, gain, errors = estimate(solution.matrix)
    for _ in range(1, MAX_ITERATIONS):
        solution = solve(errors.readings_rad_s)
        speed_noise, error_patterns, gain, errors = estimate(solution.matrix)
    solution = solve(errors.readings_rad_s)
    # The errors of a sweep's speed are left out here: the axes share them, and `_add_covariances` adds them.
    noise = np.array([np.diag(axis) for axis in variances.T]) + shared
    _, inverse = regress(design, means, variances + speed_noise**2, shared_covariance_rad2_s2)
    shifts = np.einsum("ipn,kni->ipk", inverse, error_patterns)  # changes of the coefficients, per standard deviation
    # The coefficients are inverse (m − B e), and e is gain m. So their derivative by the means m has two parts.
    total_gain = -np.einsum("ipk,knj->ipjn", shifts, gain)
    for axis in range(3):
        total_gain[axis, :, axis] += inverse[axis]
    # Prediction leaves (1 − gain B) e of the errors e.
    remaining = shifts @ (np.eye(len(error_patterns)) - np.einsum("kni,lni->kl", gain, error_patterns))
    return _add_covariances(solution, total_gain, remaining, noise, speed_noise), errors


def _gain(design: Array, effects: Array, noise: Array) -> tuple[Array, Array]:
    """Return the gain (P, N, 3) from readings with `noise` (3, N, N) to the errors, and their covariance (P, P)."""
    weights = np.linalg.inv(noise)
    weighted = weights @ design
    # The weights after removing what F, c and G explain (Frisch and Waugh, Econometrica 1 (1933) 387; Lovell 1963).
    reduced = weights - weighted @ np.linalg.solve(design.T @ weighted, np.swapaxes(weighted, -1, -2))
    patterns = np.moveaxis(effects, 2, 0)
    projected = patterns @ reduced  # (3, P, N)
    covariance = np.linalg.inv(np.eye(len(effects)) + np.sum(projected @ np.swapaxes(patterns, 1, 2), axis=0))
    return np.moveaxis(covariance @ projected, 0, 2), covariance


def _add_covariances(
    solution: VectorSolution, gain: Array, remaining: Array, noise: Array, speed_noise: Array
) -> VectorSolution:
    """Return the solution with the covariances and the response of all coefficients and errors, estimated together.

    `gain` (3, p, 3, N) maps readings to the coefficients; `remaining` (3, p, P) is the coefficients' error due to the
    unresolved part of the common errors. `noise` (3, N, N) excludes `speed_noise` (N, 3), which the three axes share.
    """
    columns = gain.shape[1]
    of_speed = np.einsum("ipjn,nj->ipn", gain, speed_noise).reshape(3 * columns, -1)
    by_axis = np.moveaxis(gain.reshape(3 * columns, 3, -1), 1, 0)
    raw = np.sum(by_axis @ noise @ np.swapaxes(by_axis, 1, 2), axis=0) + of_speed @ of_speed.T
    of_matrix, of_gravity = index_coefficients(columns)
    matrix_covariance = raw[of_matrix[:, None], of_matrix]
    to_parameters = parameter_jacobian(solution.matrix, solution.scale)
    to_angles = angle_jacobian(solution.scale[:, None] * solution.matrix, solution.scale, solution.mounting)
    of_errors = to_angles @ remaining[:, :3].reshape(9, -1)
    response = np.einsum("qr,rin->qni", to_parameters, gain.reshape(3 * columns, 3, -1)[of_matrix])
    return replace(
        solution,
        covariance=to_parameters @ matrix_covariance @ to_parameters.T,
        matrix_covariance=matrix_covariance,
        angles_covariance_rad2=to_angles @ matrix_covariance[:9, :9] @ to_angles.T + of_errors @ of_errors.T,
        g_sensitivity_covariance=raw[of_gravity[:, None], of_gravity] if columns > 4 else None,
        response=response,
    )
