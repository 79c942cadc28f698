"""The vector model: sweeps whose axes are known. The arm knows the direction it turns in, not only the speed.

    m = F ω + c (+ G a),   F_i = a_i / k_i,   c = −b

m is the mean reading (rad/s), ω the mean angular rate in the flange frame (unit axis × speed, zero for a rest), a_i the
unit vector of sensor axis i in the flange frame. Of g = K (m + b), the convention of SIX, it is the version that knows
the direction of g: k_i = 1 / ‖row i of F‖ and b = −c, so every sweep sees all three biases, and so does every rest.
The mounting rotation and the non-orthogonality of the axes are found, not assumed. With gravity in the flange frame
(m/s²) given, G (3×3, rad/s per m/s²) is the g-sensitivity.

The equations are linear in F, c and G, one weighted regression for each axis: efficient when the noise is Gaussian.
"""

from dataclasses import dataclass
from functools import cache
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rig.estimation.arrays import Array
from rig.estimation.refusals import (
    Conditioning,
    check_axes,
    check_conditioning,
    check_count,
    check_duplicates,
    check_finite,
    check_reads,
    check_signal,
    check_unit,
    check_variances,
    condition_of,
    require_shape,
    warn_of_residuals,
)
from rig.estimation.sensor_axes import SensorAxes, parameter_jacobian

MODEL = "m = F ω − b, k_i = 1/‖F_i‖"
MATRIX_PARAMETERS = (*(f"f{i}{j}" for i in "xyz" for j in "xyz"), "cx", "cy", "cz")
MAX_CONDITION = 100.0  # six sweeps stay below 3; with g-sensitivity, rests at three attitudes below 30
REMEDY = "Sweep about three different axes, and turn the flange against gravity if g-sensitivity is wanted"


@dataclass(frozen=True, slots=True)
class VectorSolution:
    """A gyroscope's calibration by the vector model, and how well it is known.

    - `scale` (3,), `bias_rad_s` (3,): g = K (m + b); `covariance` (6, 6) in the order kx ky kz bx by bz.
    - `matrix` (3, 3): F. `matrix_covariance` (12, 12): the rows of F, then c.
    - `non_orthogonality_rad` (3,): by how much the angles between y and z, z and x, x and y fall short of 90°.
    - `mounting` (3, 3): the rotation from the flange frame to the sensor frame nearest to the three axes.
    - `angles_covariance_rad2` (6, 6): of `non_orthogonality_rad`, then of small turns of `mounting` about sensor x y z.
    - `g_sensitivity` (3, 3) in rad/s per m/s² and its (9, 9) covariance (row by row), or None.
    - `response` (6, N, 3): derivative of scale and bias with respect to the mean readings.
    - `residuals_rad_s` (N, 3): reading less model.
    - `rank` is that of the scaled design, `condition` that of its part for axes and bias: how well sweeps and rests
      tell these, whatever they tell of gravity.
    """

    scale: Array
    bias_rad_s: Array
    covariance: Array
    matrix: Array
    matrix_covariance: Array
    non_orthogonality_rad: Array
    mounting: Array
    angles_covariance_rad2: Array
    g_sensitivity: Array | None
    g_sensitivity_covariance: Array | None
    response: Array
    residuals_rad_s: Array
    observations: int
    rank: int
    condition: float
    iterations: int
    warnings: tuple[str, ...]
    estimator: Literal["vector"] = "vector"


@dataclass(frozen=True, slots=True)
class VectorBatch:
    """The vector model of many runs: scale (R, 3), bias_rad_s (R, 3), matrix F (R, 3, 3)."""

    scale: Array
    bias_rad_s: Array
    matrix: Array


def solve_vector_model(
    means_rad_s: ArrayLike,
    rates_rad_s: ArrayLike,
    variances_rad2_s2: ArrayLike,
    *,
    speed_std_rad_s: ArrayLike | None = None,
    gravity_m_s2: ArrayLike | None = None,
    nominal_mounting: ArrayLike | None = None,
    shared_covariance_rad2_s2: ArrayLike | None = None,
) -> VectorSolution:
    """Solve m = F ω + c (+ G a) by weighted least squares.

    `means_rad_s`, `variances_rad2_s2` (N, 3): mean readings and the variances of these means; `rates_rad_s` (N, 3):
    the mean rate in the flange frame, zero for a rest; `speed_std_rad_s` (N,): how well its size is known;
    `gravity_m_s2` (N, 3): the mean of what is felt as gravity, in the flange frame; `nominal_mounting` (3, 3): flange
    to sensor, to be held to; `shared_covariance_rad2_s2` (N, N): of what the observations have in common beside their
    own variances, as a bias that wanders, alike and independent for the three axes.

    Raises Fault `too_few_observations`, `not_finite`, `bad_variance`, `zero_reading`, `duplicated_observation`,
    `rank_deficient`, `ill_conditioned`, `wrong_unit`, `mirrored_axis`, `swapped_axes`, `wrong_mounting`.
    """
    means, rates, variances = (np.asarray(a, dtype=np.float64) for a in (means_rad_s, rates_rad_s, variances_rad2_s2))
    count = len(means)
    speed_std = np.zeros(count) if speed_std_rad_s is None else np.asarray(speed_std_rad_s, dtype=np.float64)
    design = design_matrix(rates, None if gravity_m_s2 is None else np.asarray(gravity_m_s2, dtype=np.float64))
    for name, array in (("means", means), ("rates", rates), ("variances", variances)):
        require_shape(name, array, (count, 3))
    require_shape("speed_std", speed_std, (count,))
    columns = design.shape[1]
    check_count(count, columns, 3 * columns)
    check_finite(means=means, rates=rates, variances=variances, speed_std=speed_std, design=design)
    check_variances(variances)
    moving = rates.any(axis=1)
    check_signal(means[moving])
    check_duplicates(means[moving])
    scaled = design / _unit(design)
    told = _check_told(scaled)
    found = condition_of(scaled[:, :4], 4) if columns > 4 else told

    speed_noise = np.zeros_like(means)
    shared = None if shared_covariance_rad2_s2 is None else np.asarray(shared_covariance_rad2_s2, dtype=np.float64)
    coefficients, inverse = regress(design, means, variances, shared)
    if speed_std.any():
        speed_noise = of_the_speed(rates, speed_std, coefficients[:3].T)
        coefficients, inverse = regress(design, means, variances + speed_noise**2, shared)
        speed_noise = of_the_speed(rates, speed_std, coefficients[:3].T)
    raw = _raw_covariance(inverse, variances, speed_noise if speed_std.any() else None, shared)

    matrix = coefficients[:3].T
    check_reads(matrix)
    axes = SensorAxes.of(matrix)
    check_unit(axes.scale)
    check_axes(axes.axes, None if nominal_mounting is None else np.asarray(nominal_mounting, dtype=np.float64))
    of_matrix, of_gravity = places(columns)
    matrix_covariance = raw[of_matrix[:, None], of_matrix]
    to_parameters = parameter_jacobian(matrix, axes.scale)
    residuals = means - design @ coefficients
    return VectorSolution(
        scale=axes.scale,
        bias_rad_s=-coefficients[3],
        covariance=to_parameters @ matrix_covariance @ to_parameters.T,
        matrix=matrix,
        matrix_covariance=matrix_covariance,
        non_orthogonality_rad=axes.non_orthogonality_rad,
        mounting=axes.mounting,
        angles_covariance_rad2=axes.angles_covariance_rad2(matrix_covariance[:9, :9]),
        g_sensitivity=coefficients[4:].T if columns > 4 else None,
        g_sensitivity_covariance=raw[of_gravity[:, None], of_gravity] if columns > 4 else None,
        response=_response(to_parameters, inverse),
        residuals_rad_s=residuals,
        observations=count,
        rank=told.rank,
        condition=found.condition,
        iterations=2 if speed_std.any() else 1,
        warnings=warn_of_residuals(residuals, _all_variances(variances, speed_noise, shared), 3 * (count - columns)),
    )


def solve_vector_batch(means_rad_s: ArrayLike, rates_rad_s: ArrayLike, variances_rad2_s2: ArrayLike) -> VectorBatch:
    """The vector model of many runs at once, without gates: for studies whose design is known to be good.

    `means_rad_s` (R, N, 3); `rates_rad_s` (N, 3) or (R, N, 3); `variances_rad2_s2` (N, 3), alike for all runs.
    """
    means, rates, variances = (np.asarray(a, dtype=np.float64) for a in (means_rad_s, rates_rad_s, variances_rad2_s2))
    coefficients, _ = regress(design_matrix(rates, None), means, variances)
    matrix = np.swapaxes(coefficients[..., :3, :], -1, -2)
    return VectorBatch(1 / np.linalg.norm(matrix, axis=-1), -coefficients[..., 3, :], matrix)


def check_told(rates: Array, gravity: Array | None) -> None:
    """Whether rates and gravity (N, 3) tell axes, bias and sensitivity to gravity from each other.

    Raises Fault `rank_deficient`, `ill_conditioned`.
    """
    design = design_matrix(rates, gravity)
    _check_told(design / _unit(design))


def _check_told(scaled: Array) -> Conditioning:
    columns = scaled.shape[1]
    told = condition_of(scaled, columns)
    check_conditioning(told, columns, MAX_CONDITION, "axis, bias or g-sensitivity", REMEDY)
    return told


def design_matrix(rates: Array, gravity: Array | None) -> Array:
    """Z (…, N, 4 or 7) = [ω 1 (a)]."""
    blocks = [rates, np.ones((*rates.shape[:-1], 1))]
    if gravity is not None:
        require_shape("gravity", gravity, rates.shape)
        blocks.append(gravity)
    return np.concatenate(blocks, axis=-1)


def _unit(design: Array) -> Array:
    """(p,) the size of each block of columns, so that rate, one and gravity compare while a missing axis shows."""
    unit = np.ones(design.shape[1])
    squares = np.einsum("np,np->p", design, design)
    for block in (slice(0, 3), slice(4, None)):
        unit[block] = (float(squares[block].sum()) / len(design)) ** 0.5 or 1.0
    return unit


def regress(design: Array, means: Array, variances: Array, shared: Array | None = None) -> tuple[Array, Array]:
    """Coefficients (…, p, 3) and the linear map (…, 3, p, N) that made them: one weighted regression for each axis."""
    transposed = np.swapaxes(design, -1, -2)[..., None, :, :]
    if shared is None:
        weights = 1 / np.swapaxes(variances, -1, -2)  # (…, 3, N)
        weighted = transposed * weights[..., :, None, :]  # (…, 3, p, N)
    else:
        noise = np.array([np.diag(own) for own in variances.T]) + shared
        weighted = transposed @ np.linalg.inv(noise)
    inverse: Array = np.asarray(np.linalg.solve(weighted @ design[..., None, :, :], weighted), dtype=np.float64)
    coefficients: Array = np.einsum("...ipn,...ni->...pi", inverse, means)
    return coefficients, inverse


def of_the_speed(rates: Array, speed_std: Array, matrix: Array) -> Array:
    """(N, 3) what one standard deviation of the speed does to the readings, F û σ."""
    speed = np.linalg.norm(rates, axis=1)
    axes = np.divide(rates, speed[:, None], out=np.zeros_like(rates), where=speed[:, None] > 0)
    noise: Array = speed_std[:, None] * (axes @ matrix.T)
    return noise


def _raw_covariance(inverse: Array, variances: Array, speed_noise: Array | None, shared: Array | None) -> Array:
    """(3 p, 3 p) covariance of the coefficients, axis by axis; a wrong speed moves all three axes at once."""
    columns, count = inverse.shape[1:]
    covariance = np.zeros((3, columns, 3, columns))
    if speed_noise is not None:
        of_speed = (inverse * speed_noise.T[:, None]).reshape(3 * columns, count)
        covariance += (of_speed @ of_speed.T).reshape(covariance.shape)
    noise = inverse * variances.T[:, None]
    if shared is not None:
        noise = noise + inverse @ shared
    each = np.arange(3)
    covariance[each, :, each] += noise @ np.swapaxes(inverse, -1, -2)
    raw: Array = covariance.reshape(3 * columns, 3 * columns)
    return raw


@cache
def places(columns: int) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Where F, row by row, then c stand among the coefficients axis by axis, (12,), and where G does, row by row."""
    place = np.arange(3 * columns, dtype=np.intp).reshape(3, columns)
    return np.concatenate([place[:, :3].ravel(), place[:, 3]]), place[:, 4:].ravel()


def _all_variances(variances: Array, speed_noise: Array, shared: Array | None) -> Array:
    """(N, 3) variances of each mean reading, whatever it comes from."""
    alike = 0.0 if shared is None else np.diag(shared)[:, None]
    everything: Array = variances + speed_noise**2 + alike
    return everything


def _response(to_parameters: Array, inverse: Array) -> Array:
    """(6, N, 3) derivative of k and b with respect to each mean reading, from (6, 12) and the linear map (3, p, N)."""
    by_axis = np.concatenate([to_parameters[:, :9].reshape(6, 3, 3), to_parameters[:, 9:, None]], axis=2)
    response: Array = np.matmul(np.swapaxes(by_axis, 0, 1), inverse[:, :4]).transpose(1, 2, 0)
    return response
