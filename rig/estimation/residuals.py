"""The standard deviations that a solution's residuals would have if the modelled errors were the only errors."""

from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from rig.estimation.arrays import Array
from rig.estimation.gyroscope.vector_fit import VectorFit
from rig.estimation.gyroscope.vector_model import design_matrix, propagate_speed_std, regress

if TYPE_CHECKING:
    from rig.estimation.reference.accelerometer_model import Dwells, Movement
    from rig.estimation.reference.imu import ImuSolution
    from rig.estimation.reference.triaxial import TriaxialSolution


def residual_std_rad_s(explained: VectorFit) -> Array:
    """Return the standard deviations (N, 3), rad/s, of the vector model's residuals.

    Their covariance is (I − H) V (I − H)ᵀ, with the hat matrix H and the covariance V of the mean readings.
    """
    inputs, solution = explained.inputs, explained.solution
    rates, gravity = inputs.rates_rad_s, None if solution.g_sensitivity is None else inputs.apparent_gravity_m_s2
    variances = inputs.variances_rad2_s2 + propagate_speed_std(rates, inputs.speed_std_rad_s, solution.matrix) ** 2
    shared = explained.bias.covariance(inputs.windows_s)
    design = design_matrix(rates, gravity)
    _, inverse = regress(design, inputs.means_rad_s, variances, shared)
    residual_maker = np.eye(len(variances)) - design @ inverse  # (3, N, N)
    noise = np.array([np.diag(of_axis) for of_axis in variances.T]) + shared
    variances = np.einsum("inm,imk,ink->ni", residual_maker, noise, residual_maker)
    std: Array = np.sqrt(variances.clip(min=0.0))
    return std


def dwell_residual_std_m_s2(solution: "ImuSolution", movement: "Movement") -> Array:
    """Return the standard deviations (N, 3) of the residuals that an accelerometer's solution has in N dwells."""
    from rig.estimation.reference import accelerometer_model
    from rig.estimation.reference.reading_errors import noise

    movement, theta = (
        replace(movement, sensor_errors=solution.sensor_errors, independent_fraction=solution.independent_fraction),
        solution.theta,
    )
    arm = solution.attitude_error.std_rad * accelerometer_model.effects(theta, movement)
    fit_matrix = accelerometer_model.jacobian(theta, movement) @ solution.response
    return _residual_std(fit_matrix, noise(theta, movement) + arm @ arm.T)[: len(movement.dwells.readings_m_s2)]


def attitude_residual_std(solution: "TriaxialSolution", inputs: "Dwells") -> Array:
    """Return the standard deviations (N, 3) of a solution's residuals in N dwells, in the readings' unit.

    The solution is one from dwells alone, without sweeps.
    """
    from rig.estimation.reference import attitude_error, reference_model
    from rig.estimation.reference.reference_budget import response_in_attitudes

    theta, v_bar = solution.theta[: reference_model.SECOND.start], np.zeros_like(inputs.readings_m_s2)
    by_attitude = solution.attitude_std_rad * attitude_error.effects(theta, inputs.attitudes, v_bar)
    variances = np.eye(3) * inputs.variances_m2_s4[:, :, None] + by_attitude @ np.swapaxes(by_attitude, -1, -2)
    slopes = reference_model.jacobian(theta, inputs.attitudes, v_bar).reshape(-1, len(theta))
    fit_matrix = slopes @ response_in_attitudes(solution, inputs)
    return _residual_std(fit_matrix, _block_diagonal(variances))


def _residual_std(fit_matrix: Array, covariance: Array) -> Array:
    """Return the std (K, 3) of the residuals of readings with `covariance`; `fit_matrix` maps readings to the fit."""
    residual_maker = np.eye(len(fit_matrix)) - fit_matrix
    std: Array = np.sqrt(np.diag(residual_maker @ covariance @ residual_maker.T).clip(min=0.0)).reshape(-1, 3)
    return std


def _block_diagonal(blocks: Array) -> Array:
    """Return blocks (N, 3, 3) as a block-diagonal matrix (3 N, 3 N)."""
    stacked = np.zeros((len(blocks), 3, len(blocks), 3))
    stacked[np.arange(len(blocks)), :, np.arange(len(blocks))] = blocks
    return stacked.reshape(3 * len(blocks), -1)
