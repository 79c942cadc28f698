"""The uncertainty budget of the six-observation solution: what pushes readings pushes scale and bias by its response.

That model knows speeds alone. So the direction in which an item was turned does not matter to it, however badly it was
mounted; but it takes the sensor's axes to stand at right angles, which is one more thing that may be wrong.
"""

from dataclasses import replace

import numpy as np

from rig.estimation.arrays import Array
from rig.estimation.gyroscope.accumulator import Solution
from rig.estimation.gyroscope.budget import AXES, MOUNTS, REPEATABILITY, Budget, Contributor, Unknown, budget
from rig.estimation.gyroscope.six_observation import design
from rig.estimation.gyroscope.vector_fit import Explained, Seen
from rig.estimation.statistics.bias_process import BiasProcess

NOT_SQUARE = "angles between the axes"


def six_observation_budget(explained: Explained, own: Solution, unknown: Unknown, axes_rad: float) -> Budget:
    """The budget of `own`, which was solved from the sweeps alone of what is `explained`, weighted by their noise.

    `axes_rad` is the half-width of the angles between the sensor's axes about 90°.
    """
    seen, solution = explained.seen, explained.solution
    response = response_of(own, seen)
    by_speed = np.einsum("qni,ni->qn", response, _of_speeds(seen, solution.matrix))
    walking = _walking(explained.bias, response, seen.windows_s)
    noise = np.einsum("qni,ni,pni->qp", response, seen.variances_rad2_s2, response)
    instead = replace(
        solution,
        scale=own.scale,
        bias_rad_s=own.bias_rad_s,
        covariance=noise + by_speed @ by_speed.T + walking,
        response=response,
        g_sensitivity=None,
        g_sensitivity_covariance=None,
    )
    of_readings = budget(replace(explained, solution=instead), unknown)
    effects = np.einsum(
        "qni,kni->kq", response, _leaning(seen.turns_rad_s @ solution.mounting.T, own.scale, axes_rad) / np.sqrt(3)
    )
    half_width, source = float(np.degrees(axes_rad)), "what is known of the part"
    square = Contributor(NOT_SQUARE, "B", "rectangular", half_width, "°", source, np.inf, effects.T @ effects)
    known = [
        contributor for contributor in of_readings.contributors if contributor.name not in (AXES, REPEATABILITY, MOUNTS)
    ]
    return replace(of_readings, contributors=(*known, square))


def response_of(solution: Solution, seen: Seen) -> Array:
    """(6, N, 3) derivative of scale and bias with respect to the mean readings; zero for rests, which do not count.

    To first order, as `Accumulator.solve` has the covariance: δβ = (XᵀW X + XᵀW 1 ∂Γ/∂β)⁻¹ XᵀW e with
    e = −2 Σ_j k_j² (m_j + b_j) δm_j.
    """
    turning = np.linalg.norm(seen.turns_rad_s, axis=1) > 0
    means, variances = seen.means_rad_s[turning], seen.variances_rad2_s2[turning]
    speeds, stds = np.linalg.norm(seen.turns_rad_s[turning], axis=1), seen.speed_std_rad_s[turning]
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
    response = np.zeros((6, *seen.means_rad_s.shape))
    response[:, turning] = gain[:, :, None] * (-2 * solution.scale**2 * (means + solution.bias_rad_s))
    return response


def _of_speeds(seen: Seen, matrix: Array) -> Array:
    """(N, 3) what one standard deviation of each sweep's speed adds to its reading."""
    size = np.linalg.norm(seen.turns_rad_s, axis=1, keepdims=True)
    along = np.divide(seen.turns_rad_s, size, out=np.zeros(seen.turns_rad_s.shape), where=size > 0)
    added: Array = seen.speed_std_rad_s[:, None] * along @ matrix.T
    return added


def _walking(bias: BiasProcess, response: Array, windows_s: Array) -> Array:
    """(6, 6) what a bias that does not stand still adds."""
    flicker = replace(bias, walk_rad_s_sqrt_s=0.0, scatter_rad_s=0.0)
    wandering = replace(bias, instability_rad_s=0.0)
    covariance: Array = np.sum(
        [np.einsum("pni,nm,qmi->pq", response, each.covariance(windows_s), response) for each in (flicker, wandering)],
        axis=0,
    )
    return covariance


def _leaning(sensed: Array, scale: Array, angle_rad: float) -> Array:
    """(3, N, 3) what is read when y leans towards x, z towards x, z towards y, by that angle; `sensed` (N, 3) rates."""
    patterns = np.zeros((3, *sensed.shape))
    for place, (leaning, towards) in enumerate(((1, 0), (2, 0), (2, 1))):
        patterns[place, :, leaning] = angle_rad * sensed[:, towards] / scale[leaning]
    return patterns
