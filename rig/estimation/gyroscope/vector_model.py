"""The vector model: sweeps about known axes. The arm gives the direction of a rate, not only the speed.

    m = F ω + c (+ G a),   F_i = a_i / k_i,   c = −b

m is the mean reading (rad/s), ω the mean angular rate in the flange frame (unit axis × speed, zero for a rest), a_i the
unit vector of sensor axis i in the flange frame. This is the model of the paper SIX, rate = K (m + b), with a rate of
known direction: k_i = 1 / ‖row i of F‖ and b = −c, so every sweep and every rest determines all three biases. The
mounting rotation and the non-orthogonality of the axes are estimated, not assumed. If the apparent gravity a in the
flange frame (m/s²) is given, G (3×3, rad/s per m/s²) is the g-sensitivity.

The equations are linear in F, c and G. Each axis has a weighted regression (Aitken's generalised least squares), which
is efficient if the noise is Gaussian.
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
MAX_CONDITION = 100.0  # six sweeps have less than 3; with g-sensitivity, rests in three attitudes have less than 30
REMEDY = "Sweep about three different axes, and turn the flange against gravity if g-sensitivity is wanted"


@dataclass(frozen=True, slots=True)
class VectorSolution:
    """A gyroscope's calibration by the vector model, rate = K (reading + b), with its covariance.

    - scale, bias_rad_s (3,): the diagonal of K, and b.
    - covariance (6, 6): in the order kx ky kz bx by bz.
    - matrix (3, 3): F of m = F ω + c, the scale factors and axes in one.
    - matrix_covariance (12, 12): covariance of the rows of F, then c.
    - non_orthogonality_rad (3,): 90° minus the angles between y and z, z and x, x and y.
    - mounting (3, 3): rotation from the flange frame to the orthogonal frame nearest to the three axes.
    - angles_covariance_rad2 (6, 6): covariance of non_orthogonality_rad, then of small rotations of mounting about
      sensor x y z.
    - g_sensitivity (3, 3): in rad/s per m/s², None if not estimated.
    - g_sensitivity_covariance (9, 9): covariance of its elements, row by row.
    - response (6, N, 3): derivative of scale and bias with respect to the mean readings.
    - residuals_rad_s (N, 3): readings minus model.
    - rank: rank of the scaled design.
    - condition: condition number of the design's part for axes and bias, without gravity.
    - observations, iterations: number of mean readings, and number of times that the equations were solved.
    - warnings: sentences for people.
    - estimator: the estimator's name.
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
    """Return the solution of the vector model by weighted least squares.

    The mean reading is m = F ω + c (+ G a), with the rate ω and the apparent gravity a.

    - `means_rad_s`, `variances_rad2_s2` (N, 3): mean readings and the variances of these means.
    - `rates_rad_s` (N, 3): the mean rate in the flange frame, zero for a rest.
    - `speed_std_rad_s` (N,): the standard deviation of the size of that rate.
    - `gravity_m_s2` (N, 3): the mean apparent gravity, in the flange frame.
    - `nominal_mounting` (3, 3): flange to sensor, with which the solution is compared.
    - `shared_covariance_rad2_s2` (N, N): covariance of the means beyond their own variances, for example due to bias
      drift. The covariance is equal for the three axes, which are independent.

    Raise Fault `too_few_observations`, `not_finite`, `bad_variance`, `zero_reading`, `duplicated_observation`,
    `rank_deficient`, `ill_conditioned`, `wrong_unit`, `mirrored_axis`, `swapped_axes`, `wrong_mounting`.
    """
    means, rates, variances = (np.asarray(a, dtype=np.float64) for a in (means_rad_s, rates_rad_s, variances_rad2_s2))
    count = len(means)
    speed_std = np.zeros(count) if speed_std_rad_s is None else np.asarray(speed_std_rad_s, dtype=np.float64)
    design = design_matrix(rates, None if gravity_m_s2 is None else np.asarray(gravity_m_s2, dtype=np.float64))
    columns = design.shape[1]
    scaled, conditioning = check_observations(design, means, rates, variances, speed_std)
    axes_conditioning = condition_of(scaled[:, :4], 4) if columns > 4 else conditioning

    shared = None if shared_covariance_rad2_s2 is None else np.asarray(shared_covariance_rad2_s2, dtype=np.float64)
    coefficients, inverse, speed_noise = fit_coefficients(
        design, means, rates, variances, speed_std=speed_std, shared=shared
    )
    raw = _raw_covariance(inverse, variances, speed_noise, shared)

    matrix = coefficients[:3].T
    axes = check_matrix(matrix, None if nominal_mounting is None else np.asarray(nominal_mounting, dtype=np.float64))
    of_matrix, of_gravity = index_coefficients(columns)
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
        rank=conditioning.rank,
        condition=axes_conditioning.condition,
        iterations=1 if speed_noise is None else 2,
        warnings=warn_of_residuals(residuals, _all_variances(variances, speed_noise, shared), 3 * (count - columns)),
    )


def check_observations(
    design: Array, means: Array, rates: Array, variances: Array, speed_std: Array
) -> tuple[Array, Conditioning]:
    """Return the design (N, p) in comparable units, and its conditioning.

    Raise Fault for observations that `solve_vector_model` refuses.
    """
    count, columns = len(means), design.shape[1]
    for name, array in (("means", means), ("rates", rates), ("variances", variances)):
        require_shape(name, array, (count, 3))
    require_shape("speed_std", speed_std, (count,))
    check_count(count, columns, 3 * columns)
    check_finite(means=means, rates=rates, variances=variances, speed_std=speed_std, design=design)
    check_variances(variances)
    moving = rates.any(axis=1)
    swept = means[moving]
    check_signal(swept)
    check_duplicates(swept)
    scaled = design / _unit(design)
    return scaled, _check_identifiable(scaled)


def fit_coefficients(
    design: Array, means: Array, rates: Array, variances: Array, *, speed_std: Array, shared: Array | None
) -> tuple[Array, Array, Array | None]:
    """Return coefficients, their map from the means (see `regress`), and the effect (N, 3) of the speeds' errors.

    The effect is the change of the readings by one standard deviation of each speed, None if all speeds are exact. The
    weights of the fit include it.
    """
    coefficients, inverse = regress(design, means, variances, shared)
    if not speed_std.any():
        return coefficients, inverse, None
    speed_noise = propagate_speed_std(rates, speed_std, coefficients[:3].T)
    coefficients, inverse = regress(design, means, variances + speed_noise**2, shared)
    return coefficients, inverse, propagate_speed_std(rates, speed_std, coefficients[:3].T)


def check_matrix(matrix: Array, nominal_mounting: Array | None) -> SensorAxes:
    """Return the axes in a gyroscope's `matrix` (3, 3). Raise Fault for a matrix that `solve_vector_model` refuses."""
    check_reads(matrix)
    axes = SensorAxes.from_matrix(matrix)
    check_unit(axes.scale)
    check_axes(axes.axes, nominal_mounting)
    return axes


def solve_vector_batch(means_rad_s: ArrayLike, rates_rad_s: ArrayLike, variances_rad2_s2: ArrayLike) -> VectorBatch:
    """Return the vector model of R runs, solved at once and without checks, for studies of a design without defects.

    `means_rad_s` (R, N, 3); `rates_rad_s` (N, 3) or (R, N, 3); `variances_rad2_s2` (N, 3), the same for all runs.
    """
    means, rates, variances = (np.asarray(a, dtype=np.float64) for a in (means_rad_s, rates_rad_s, variances_rad2_s2))
    coefficients, _ = regress(design_matrix(rates, None), means, variances)
    matrix = np.swapaxes(coefficients[..., :3, :], -1, -2)
    return VectorBatch(1 / np.linalg.norm(matrix, axis=-1), -coefficients[..., 3, :], matrix)


def check_identifiable(rates: Array, gravity: Array | None) -> None:
    """Raise Fault `rank_deficient`, `ill_conditioned` unless rates and gravity (N, 3) identify all parameters."""
    design = design_matrix(rates, gravity)
    _check_identifiable(design / _unit(design))


def _check_identifiable(scaled: Array) -> Conditioning:
    """Return the conditioning of a scaled design (N, p). Raise the Faults of `check_identifiable`."""
    columns = scaled.shape[1]
    conditioning = condition_of(scaled, columns)
    check_conditioning(conditioning, columns, MAX_CONDITION, "axis, bias or g-sensitivity", REMEDY)
    return conditioning


def design_matrix(rates: Array, gravity: Array | None) -> Array:
    """Return the design Z (…, N, 4 or 7) = [ω 1 (a)] from the rates ω (…, N, 3) and, unless None, the gravity a."""
    blocks = [rates, np.ones((*rates.shape[:-1], 1))]
    if gravity is not None:
        require_shape("gravity", gravity, rates.shape)
        blocks.append(gravity)
    return np.concatenate(blocks, axis=-1)


def _unit(design: Array) -> Array:
    """Return the RMS (p,) of the block to which each column belongs: the rates, the ones, or gravity."""
    squares = np.einsum("np,np->p", design, design).tolist()
    of_rates, of_gravity = ((sum(squares[block]) / len(design)) ** 0.5 or 1.0 for block in (slice(0, 3), slice(4, 7)))
    return np.array([*[of_rates] * 3, 1.0, *[of_gravity] * len(squares[4:])])


def regress(design: Array, means: Array, variances: Array, shared: Array | None = None) -> tuple[Array, Array]:
    """Return coefficients (…, p, 3), and the map (…, 3, p, N) of each axis from its means to its coefficients.

    `shared` (N, N) is a covariance that is added to the `variances`.
    """
    transposed = np.swapaxes(design, -1, -2)[..., None, :, :]
    if shared is None:
        weights = 1 / np.swapaxes(variances, -1, -2)  # (…, 3, N)
        weighted = transposed * weights[..., :, None, :]  # (…, 3, p, N)
    else:
        noise = np.array([np.diag(axis) for axis in variances.T]) + shared
        weighted = transposed @ np.linalg.inv(noise)
    inverse: Array = np.asarray(np.linalg.solve(weighted @ design[..., None, :, :], weighted), dtype=np.float64)
    coefficients: Array = np.einsum("...ipn,...ni->...pi", inverse, means)
    return coefficients, inverse


def propagate_speed_std(rates: Array, speed_std: Array, matrix: Array) -> Array:
    """Return the effect (N, 3) on readings of one std `speed_std` (N,) of the speed, along the rates' directions."""
    speed = np.linalg.norm(rates, axis=1)
    axes = np.divide(rates, speed[:, None], out=np.zeros_like(rates), where=speed[:, None] > 0)
    noise: Array = speed_std[:, None] * (axes @ matrix.T)
    return noise


def _raw_covariance(inverse: Array, variances: Array, speed_noise: Array | None, shared: Array | None) -> Array:
    """Return the covariance (3 p, 3 p) of the coefficients, axis by axis; a speed's error is common to all axes."""
    columns, count = inverse.shape[1:]
    covariance = np.zeros((3, columns, 3, columns))
    if speed_noise is not None:
        of_speed = (inverse * speed_noise.T[:, None]).reshape(3 * columns, count)
        covariance += (of_speed @ of_speed.T).reshape(covariance.shape)
    noise = inverse * variances.T[:, None]
    if shared is not None:
        noise = noise + inverse @ shared
    blocks_of_axes = np.einsum("ipiq->ipq", covariance)  # a view
    blocks_of_axes += noise @ np.swapaxes(inverse, -1, -2)
    raw: Array = covariance.reshape(3 * columns, 3 * columns)
    return raw


@cache
def index_coefficients(columns: int) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Return the indices (12,) of F, row by row, then c, and the indices of G, among all coefficients.

    The coefficients are listed axis by axis; each axis has as many as the design has `columns`.
    """
    index = np.arange(3 * columns, dtype=np.intp).reshape(3, columns)
    return np.concatenate([index[:, :3].ravel(), index[:, 3]]), index[:, 4:].ravel()


def _all_variances(variances: Array, speed_noise: Array | None, shared: Array | None) -> Array:
    """Return the total `variances` (N, 3) of the means, including `speed_noise` (N, 3, std) and `shared` (N, N)."""
    of_speed = 0.0 if speed_noise is None else speed_noise**2
    common = 0.0 if shared is None else np.diag(shared)[:, None]
    total: Array = variances + of_speed + common
    return total


def _response(to_parameters: Array, inverse: Array) -> Array:
    """Return the derivative (6, N, 3) of scale and bias with respect to the mean readings, by the chain rule.

    `to_parameters` (6, 12) is the derivative of scale and bias with respect to the coefficients; `inverse` (3, p, N)
    maps readings to coefficients.
    """
    by_axis = np.concatenate([to_parameters[:, :9].reshape(6, 3, 3), to_parameters[:, 9:, None]], axis=2)
    response: Array = np.matmul(np.swapaxes(by_axis, 0, 1), inverse[:, :4]).transpose(1, 2, 0)
    return response
