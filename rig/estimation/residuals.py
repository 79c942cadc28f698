"""What a solve expects of its own residuals: all that it knows to be off in readings, less what the fit takes up."""

from dataclasses import replace

import numpy as np

from rig.estimation.arrays import Array
from rig.estimation.gyroscope.vector_fit import Explained
from rig.estimation.gyroscope.vector_model import design_matrix, of_the_speed, regress
from rig.estimation.reference import accelerometer_model, attitude_error, reference_model
from rig.estimation.reference.accelerometer_model import Dwells, Movement
from rig.estimation.reference.imu import ImuSolution
from rig.estimation.reference.reading_errors import noise
from rig.estimation.reference.reference_budget import response_in_attitudes
from rig.estimation.reference.triaxial import TriaxialSolution


def residual_std_rad_s(explained: Explained) -> Array:
    """(N, 3) standard deviations of the vector model's residuals: of (1 − H) V (1 − H)ᵀ, with H that makes the fit."""
    seen, solution = explained.seen, explained.solution
    rates, pull = seen.rates_rad_s, None if solution.g_sensitivity is None else seen.pull_m_s2
    own = seen.variances_rad2_s2 + of_the_speed(rates, seen.speed_std_rad_s, solution.matrix) ** 2
    shared = explained.bias.covariance(seen.windows_s)
    design = design_matrix(rates, pull)
    _, inverse = regress(design, seen.means_rad_s, own, shared)
    left = np.eye(len(own)) - design @ inverse  # (3, N, N)
    noise = np.array([np.diag(each) for each in own.T]) + shared
    variances = np.einsum("inm,imk,ink->ni", left, noise, left)
    std: Array = np.sqrt(variances.clip(min=0.0))
    return std


def dwell_residual_std_m_s2(solution: ImuSolution, movement: Movement) -> Array:
    """(N, 3) standard deviations of what is left in an accelerometer's dwells, solved from the `movement`."""
    movement, theta = replace(movement, own=solution.own, own_share=solution.own_share), solution.theta
    arm = solution.attitude_error.std_rad * accelerometer_model.effects(theta, movement)
    fit = accelerometer_model.jacobian(theta, movement) @ solution.response
    return _left(fit, noise(theta, movement) + arm @ arm.T)[: len(movement.dwells.readings_m_s2)]


def attitude_residual_std(solution: TriaxialSolution, seen: Dwells) -> Array:
    """(N, 3) standard deviations of what is left in attitudes alone, as `seen`, in the readings' unit."""
    theta, v_bar = solution.theta[: reference_model.SECOND.start], np.zeros_like(seen.readings_m_s2)
    turned = solution.attitude_std_rad * attitude_error.effects(theta, seen.attitudes, v_bar)
    own = np.eye(3) * seen.variances_m2_s4[:, :, None] + turned @ np.swapaxes(turned, -1, -2)
    slopes = reference_model.jacobian(theta, seen.attitudes, v_bar).reshape(-1, len(theta))
    fit = slopes @ response_in_attitudes(solution, seen)
    return _left(fit, _along_diagonal(own))


def _left(fit: Array, covariance: Array) -> Array:
    """(K, 3) standard deviations of what a fit (3 K, 3 K) leaves of readings with that covariance."""
    left = np.eye(len(fit)) - fit
    std: Array = np.sqrt(np.diag(left @ covariance @ left.T).clip(min=0.0)).reshape(-1, 3)
    return std


def _along_diagonal(blocks: Array) -> Array:
    """(3 N, 3 N) blocks (N, 3, 3) along the diagonal."""
    whole = np.zeros((len(blocks), 3, len(blocks), 3))
    whole[np.arange(len(blocks)), :, np.arange(len(blocks))] = blocks
    return whole.reshape(3 * len(blocks), -1)
