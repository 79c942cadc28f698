"""The degrees of freedom of estimates without a budget of their own, such as angles and sensitivity to gravity.

The estimates' variance is divided among the budget's contributors of type A, each with its degrees of freedom (Welch
and Satterthwaite, JCGM 100, G.4); the remainder, due to arm errors of a stated size, has infinite degrees of freedom.
"""

from typing import TYPE_CHECKING

import numpy as np

from rig.estimation.arrays import Array
from rig.estimation.gyroscope.budget import BIAS_DRIFT, NOISE, Budget
from rig.estimation.gyroscope.vector_fit import VectorFit
from rig.estimation.gyroscope.vector_model import design_matrix, regress
from rig.estimation.sensor_axes import SensorAxes
from rig.estimation.statistics.coverage import effective_dof

if TYPE_CHECKING:
    from rig.analysis.gyroscope.calibration import SensorResult
    from rig.analysis.reference.accelerometer import AccelerometerResult
    from rig.analysis.reference.magnetometer import MagnetometerResult
    from rig.analysis.reversal import MagnetometerReversal


def angle_dof(result: "SensorResult") -> Array | None:
    """Return the degrees of freedom (6,) of a gyroscope's non-orthogonality, then mounting; None without a budget."""
    explained, budget = result.explained, result.uncertainty
    if explained is None or budget is None:
        return None
    solution = explained.solution
    derivative = _angle_derivatives(solution.matrix)
    covariance = solution.matrix_covariance[:9, :9].reshape(3, 3, 3, 3)  # covariance of F due to the readings
    readings = np.einsum("aij,ijkl,akl->a", derivative, covariance, derivative)
    walk = np.einsum("aij,ijl,ail->a", derivative, _drift_covariance(explained)[:, :3, :3], derivative)
    return _split(np.diag(solution.angles_covariance_rad2), _reading_parts(readings - walk, walk, explained), budget)


def g_sensitivity_dof(result: "SensorResult") -> Array | None:
    """Return the degrees of freedom (3, 3) of a gyroscope's g-sensitivity; None without it or without a budget."""
    explained, budget = result.explained, result.uncertainty
    if explained is None or budget is None:
        return None
    covariance = explained.solution.g_sensitivity_covariance
    if covariance is None:
        return None
    whole = np.diag(covariance).reshape(3, 3)
    walk = np.diagonal(_drift_covariance(explained)[:, 4:, 4:], axis1=1, axis2=2)
    return _split(whole, _reading_parts(whole - walk, walk, explained), budget)


def acceleration_angle_dof(result: "AccelerometerResult") -> Array:
    """Return the degrees of freedom (3,) of an accelerometer's non-orthogonality."""
    return _axis_dof(result, result.solution.response, result.movement.noise())


def second_order_dof(result: "AccelerometerResult") -> Array | None:
    """Return the degrees of freedom (3,) of an accelerometer's quadratic terms; None if they were not estimated."""
    from rig.estimation.reference.accelerometer_model import SECOND

    if result.solution.second_order_s2_m is None:
        return None
    std = np.sqrt(np.diag(result.solution.covariance)[SECOND])
    return _attitude_dof(result.budget, result.solution.response[SECOND], result.movement.noise(), std)


def field_angle_dof(result: "MagnetometerResult") -> Array:
    """Return the degrees of freedom (3,) of a magnetometer's non-orthogonality."""
    from rig.estimation.reference.reference_budget import response_in_attitudes

    response = response_in_attitudes(result.solution, result.measurements)
    return _axis_dof(result, response, np.diag(result.measurements.variances_m2_s4.ravel()))


def reversal_dof(reversal: "MagnetometerReversal") -> tuple[Array, Array]:
    """Return the degrees of freedom of the mean scale factors (3,), and those of bias and arm's field (6,).

    All of the latter are the smallest of any run's bias, because a sum of independent parts has no fewer.
    """
    budgets = [run.result.budget for run in reversal.runs]
    # Welch–Satterthwaite: u⁴ / ν = Σ u_i⁴ / ν_i. Errors common to the runs have infinite ν and add nothing.
    fourths = np.sum([budget.std[:3] ** 4 / budget.dof[:3] for budget in budgets], axis=0) / len(budgets) ** 4
    with np.errstate(divide="ignore"):
        scale: Array = reversal.scale_std**4 / fourths
    return scale, np.full(6, min(float(budget.dof[3:].min()) for budget in budgets))


def _axis_dof(result: "AccelerometerResult | MagnetometerResult", response: Array, noise: Array) -> Array:
    """Return the degrees of freedom (3,) of the angles between axes, for readings with the covariance `noise` (n, n).

    `response` (p, n): the derivatives of all parameters with respect to the readings.
    """
    from rig.estimation.reference.reference_model import F

    derivative = _angle_derivatives(result.solution.matrix)[:3].reshape(3, 9) @ response[F]
    return _attitude_dof(result.budget, derivative, noise, result.triad.non_orthogonality_std_rad)


def _attitude_dof(budget: Budget, response: Array, noise: Array, std: Array) -> Array:
    """Return the degrees of freedom (q,) of the standard deviations `std` (q,) of q estimates.

    `response` (q, n) are the derivatives of the estimates with respect to the readings, whose covariance is `noise`
    (n, n). The part of a variance that is not due to noise has the degrees of freedom of the attitudes in the `budget`.
    """
    from rig.estimation.reference.reference_budget import ATTITUDES

    by_noise = np.einsum("qn,nm,qm->q", response, noise, response)
    return _split(std**2, {NOISE: by_noise, ATTITUDES: std**2 - by_noise}, budget)


def _reading_parts(noise: Array, walk: Array, explained: VectorFit) -> dict[str, Array]:
    """Return the variances that have finite dof, by contributor: those due to `noise` and to the bias's `walk`.

    If readings show no bias drift, `walk` is omitted, because it is the data sheet's flicker, which has infinite dof.
    """
    return {NOISE: noise, **({BIAS_DRIFT: walk} if explained.bias.is_drifting else {})}


def _split(whole: Array, parts: dict[str, Array], budget: Budget) -> Array:
    """Return the degrees of freedom of the variances `whole`, of the same shape, by Welch–Satterthwaite.

    Each of `parts` has the degrees of freedom of the budget's contributor with the same name; the remainder of `whole`
    has infinitely many. Raise KeyError if the budget has no such contributor.
    """
    clipped = [np.clip(part, 0.0, whole) for part in parts.values()]
    rest = np.clip(whole - np.sum(clipped, axis=0), 0.0, None)
    dof = [budget.line(name).dof for name in parts]
    shape = (-1, *np.ones(np.ndim(whole), dtype=np.intp))
    return effective_dof(np.array([*clipped, rest]), np.reshape([*dof, np.inf], shape))


def _angle_derivatives(matrix: Array) -> Array:
    """Return the derivative (6, 3, 3), with respect to `matrix`, of the angles between axes, then of the mounting."""
    return SensorAxes.from_matrix(matrix).to_angles.reshape(6, 3, 3)


def _drift_covariance(explained: VectorFit) -> Array:
    """Return bias drift's part (3, p, p) in the covariance of each axis' p coefficients of the vector model."""
    inputs = explained.inputs
    gravity = None if explained.solution.g_sensitivity is None else inputs.apparent_gravity_m_s2
    design = design_matrix(inputs.rates_rad_s, gravity)
    if explained.bias.steady:
        return np.zeros((3, design.shape[1], design.shape[1]))
    shared = explained.bias.covariance(inputs.windows_s)
    _, gain = regress(design, inputs.means_rad_s, inputs.variances_rad2_s2, shared)
    walk: Array = gain @ shared @ np.swapaxes(gain, -1, -2)
    return walk
