"""The uncertainty budget of the six-observation solution, from its derivatives by the mean readings.

The six-observation model uses speeds alone, so errors of directions do not matter. But it assumes orthogonal sensor
axes, which adds a contributor.
"""

from dataclasses import replace

import numpy as np

from rig.estimation.arrays import Array
from rig.estimation.gyroscope.accumulator import Solution
from rig.estimation.gyroscope.budget import (
    AXES,
    REMOUNTING,
    REPEATABILITY,
    Budget,
    Contributor,
    UnknownErrors,
    budget,
    split_bias_covariance,
)
from rig.estimation.gyroscope.six_observation import design
from rig.estimation.gyroscope.vector_fit import VectorFit, VectorInputs

AXIS_ANGLES = "angles between the axes"


def six_observation_budget(explained: VectorFit, six: Solution, unknown: UnknownErrors, axes_rad: float) -> Budget:
    """Return the budget of the solution `six`, which uses only the sweeps of `explained`, weighted by their noise.

    `axes_rad` is the half-width of the deviations from 90° of the angles between the sensor's axes.
    """
    inputs, solution = explained.inputs, explained.solution
    response = response_of(six, inputs)
    by_speed = np.einsum("qni,ni->qn", response, _propagate_speeds(inputs, solution.matrix))
    flicker, other_drift = split_bias_covariance(explained.bias, response, inputs.windows_s)
    noise = np.einsum("qni,ni,pni->qp", response, inputs.variances_rad2_s2, response)
    six_solution = replace(
        solution,
        scale=six.scale,
        bias_rad_s=six.bias_rad_s,
        covariance=noise + by_speed @ by_speed.T + (flicker + other_drift),
        response=response,
        g_sensitivity=None,
        g_sensitivity_covariance=None,
    )
    of_readings = budget(replace(explained, solution=six_solution), unknown)
    effects = np.einsum(
        "qni,kni->kq", response, _tilt_axes(inputs.turns_rad_s @ solution.mounting.T, six.scale, axes_rad) / np.sqrt(3)
    )
    half_width, source = float(np.degrees(axes_rad)), "stated properties of the part"
    square = Contributor(AXIS_ANGLES, "B", "rectangular", half_width, "°", source, np.inf, effects.T @ effects)
    contributors = [
        contributor
        for contributor in of_readings.contributors
        if contributor.name not in (AXES, REPEATABILITY, REMOUNTING)  # errors of directions have no effect
    ]
    return replace(of_readings, contributors=(*contributors, square))


def response_of(solution: Solution, inputs: VectorInputs) -> Array:
    """Return the derivative (6, N, 3) of scale and bias with respect to the mean readings; zero for the unused rests.

    An error δm of a mean reading m adds the error e = −2 Σ_j k_j² (m_j + b_j) δm_j to the equation of its sweep, which
    changes the solution as in `Accumulator._covariance`.
    """
    swept = np.linalg.norm(inputs.turns_rad_s, axis=1) > 0
    means, variances = inputs.means_rad_s[swept], inputs.variances_rad2_s2[swept]
    speeds, stds = np.linalg.norm(inputs.turns_rad_s[swept], axis=1), inputs.speed_std_rad_s[swept]
    weights = 1 / (4 * speeds**2 * variances.mean(axis=1) + (2 * speeds * stds) ** 2)
    centre = means.mean(axis=0)
    bias = solution.bias_rad_s + centre
    rows = np.array([design(mean - centre) for mean in means])
    weighted = rows.T * weights
    gamma_by_beta = np.concatenate([-(bias**2), bias])
    to_beta = np.linalg.inv(weighted @ rows + np.outer(weighted.sum(axis=1), gamma_by_beta))
    squares, linear = np.arange(3), np.arange(3, 6)
    to_parameters = np.zeros((6, 6))
    to_parameters[squares, squares] = 1 / (2 * solution.scale)
    to_parameters[linear, squares] = -bias / solution.scale**2
    to_parameters[linear, linear] = 1 / (2 * solution.scale**2)
    gain = to_parameters @ to_beta @ weighted
    response = np.zeros((6, *inputs.means_rad_s.shape))
    response[:, swept] = gain[:, :, None] * (-2 * solution.scale**2 * (means + solution.bias_rad_s))
    return response


def _propagate_speeds(inputs: VectorInputs, matrix: Array) -> Array:
    """Return the effect (N, 3) of one standard deviation of each sweep's speed on the sweep's mean reading."""
    size = np.linalg.norm(inputs.turns_rad_s, axis=1, keepdims=True)
    directions = np.divide(inputs.turns_rad_s, size, out=np.zeros(inputs.turns_rad_s.shape), where=size > 0)
    added: Array = inputs.speed_std_rad_s[:, None] * directions @ matrix.T
    return added


def _tilt_axes(sensed: Array, scale: Array, angle_rad: float) -> Array:
    """Return the effects (3, N, 3), on readings, of three tilts of sensor axes by `angle_rad` at `sensed` rates (N, 3).

    The tilts are that of y towards x, of z towards x, and of z towards y.
    """
    patterns = np.zeros((3, *sensed.shape))
    for row, (tilted, towards) in enumerate(((1, 0), (2, 0), (2, 1))):
        patterns[row, :, tilted] = angle_rad * sensed[:, towards] / scale[tilted]
    return patterns
