"""The vector model with errors that many observations have in common, of which only the likely size is known before.

A twist of the arm's wrist turns the axis of every sweep beyond it; a nonlinear sensor reads every fast sweep alike.
Each such error e (zero on average, of standard deviation 1 in its own unit) adds B e to the readings:

    m = F ω + c (+ G a) + B e,   e ~ N(0, I)

F, c, G and e are found together (the mixed model of Henderson, Biometrics 31 (1975) 423). What sweeps and rests tell
of e is taken out of the result; what they do not tell leaves e at zero and F as it is without it.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from rig.estimation.arrays import Array
from rig.estimation.gyroscope.vector_model import (
    VectorSolution,
    design_matrix,
    of_the_speed,
    places,
    regress,
    solve_vector_model,
)
from rig.estimation.sensor_axes import angle_jacobian, parameter_jacobian

PASSES = 2  # B depends on F, which is known to a fraction of a percent before the first


@dataclass(frozen=True, slots=True)
class CommonErrors:
    """`sizes` (P,) in standard deviations of what was known before, their `covariance` (P, P) after it.

    `readings_rad_s` (N, 3) is what they do to the mean readings.
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
    """The vector model's solution without what the errors do, and the errors.

    `effects` gives B (P, N, 3), rad/s for one standard deviation, from F (3, 3); else as in `solve_vector_model`.
    The solution's `covariance`, `matrix_covariance` and `response` hold what the readings do to it; of the errors, only
    `angles_covariance_rad2` holds what is left of them. Raises Fault as `solve_vector_model` does.
    """
    means, rates, variances = (np.asarray(a, dtype=np.float64) for a in (means_rad_s, rates_rad_s, variances_rad2_s2))

    def solve(without: Array) -> VectorSolution:
        return solve_vector_model(
            means - without,
            rates,
            variances,
            speed_std_rad_s=speed_std_rad_s,
            gravity_m_s2=gravity_m_s2,
            nominal_mounting=nominal_mounting,
            shared_covariance_rad2_s2=shared_covariance_rad2_s2,
        )

    design = design_matrix(rates, gravity_m_s2)
    shared = np.zeros((len(means), len(means))) if shared_covariance_rad2_s2 is None else shared_covariance_rad2_s2
    solution = solve(np.zeros_like(means))
    for _ in range(PASSES):
        speed_noise = of_the_speed(rates, speed_std_rad_s, solution.matrix)
        noise = np.array([np.diag(own) for own in (variances + speed_noise**2).T]) + shared  # (3, N, N)
        known = effects(solution.matrix)
        gain, covariance = _gain(design, known, noise)
        sizes = np.einsum("pni,ni->p", gain, means)
        errors = CommonErrors(sizes, covariance, np.einsum("p,pni->ni", sizes, known))
        solution = solve(errors.readings_rad_s)
    own = np.array([np.diag(each) for each in variances.T]) + shared
    _, inverse = regress(design, means, variances + speed_noise**2, shared_covariance_rad2_s2)
    moved = np.einsum("ipn,kni->ipk", inverse, known)  # the coefficients, by one standard deviation of each error
    whole = -np.einsum("ipk,knj->ipjn", moved, gain)
    for axis in range(3):
        whole[axis, :, axis] += inverse[axis]
    left = moved @ (np.eye(len(known)) - np.einsum("kni,lni->kl", gain, known))
    return _known_to(solution, whole, left, own, speed_noise), errors


def _gain(design: Array, effects: Array, noise: Array) -> tuple[Array, Array]:
    """(P, N, 3) gain that takes readings to the sizes of the errors, and the sizes' covariance (P, P)."""
    weights = np.linalg.inv(noise)
    weighted = weights @ design
    blind = weights - weighted @ np.linalg.solve(design.T @ weighted, np.swapaxes(weighted, -1, -2))  # to F, c, G
    known = np.moveaxis(effects, 2, 0)
    seen = known @ blind  # (3, P, N)
    covariance = np.linalg.inv(np.eye(len(effects)) + np.sum(seen @ np.swapaxes(known, 1, 2), axis=0))
    return np.moveaxis(covariance @ seen, 0, 2), covariance


def _known_to(solution: VectorSolution, whole: Array, left: Array, noise: Array, speed_noise: Array) -> VectorSolution:
    """The solution with the covariances and the response of F, c, G and the errors found together.

    `whole` (3, p, 3, N) takes readings to the coefficients, `left` (3, p, P) is what they are off by for the errors.
    `noise` (3, N, N) is without what a wrong speed adds, `speed_noise` (N, 3), to all three axes at once.
    """
    columns = whole.shape[1]
    of_speed = np.einsum("ipjn,nj->ipn", whole, speed_noise).reshape(3 * columns, -1)
    by_axis = np.moveaxis(whole.reshape(3 * columns, 3, -1), 1, 0)
    raw = np.sum(by_axis @ noise @ np.swapaxes(by_axis, 1, 2), axis=0) + of_speed @ of_speed.T
    of_matrix, of_gravity = places(columns)
    matrix_covariance = raw[of_matrix[:, None], of_matrix]
    to_parameters = parameter_jacobian(solution.matrix, solution.scale)
    to_angles = angle_jacobian(solution.scale[:, None] * solution.matrix, solution.scale, solution.mounting)
    of_errors = to_angles @ left[:, :3].reshape(9, -1)
    response = np.einsum("qr,rin->qni", to_parameters, whole.reshape(3 * columns, 3, -1)[of_matrix])
    return replace(
        solution,
        covariance=to_parameters @ matrix_covariance @ to_parameters.T,
        matrix_covariance=matrix_covariance,
        angles_covariance_rad2=to_angles @ matrix_covariance[:9, :9] @ to_angles.T + of_errors @ of_errors.T,
        g_sensitivity_covariance=raw[of_gravity[:, None], of_gravity] if columns > 4 else None,
        response=response,
    )
