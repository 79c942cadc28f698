"""Cramér–Rao bounds: the smallest covariance that an unbiased estimator can have with a given design.

The noise is Gaussian with known variances, so the Fisher information is Σ Jᵀ V⁻¹ J. Unknown directions of rotation and
mounting are nuisance parameters in it. `efficiency` compares an estimator with the bound.
"""

import numpy as np
from numpy.typing import ArrayLike

from rig.estimation.arrays import Array, scale_of
from rig.estimation.gyroscope.levenberg_marquardt import compute_squared_rate_jacobian, compute_squared_rate_variance
from rig.estimation.reference.reference_model import covariance_bound, whitening
from rig.estimation.sensor_axes import parameter_jacobian


def six_observation_bound(scale: ArrayLike, rates_rad_s: ArrayLike, variances_rad2_s2: ArrayLike) -> Array:
    """Return the Cramér–Rao bound (6, 6) for kx, ky, kz, bx, by, bz in the model of the paper SIX, Eqs. (1)–(4).

    In this model g = k (m + b) is the rate, k (3,) the `scale`, m a mean reading, and only ‖g‖ is given. `rates_rad_s`
    (N, 3) are the true rates in the sensor frame, `variances_rad2_s2` v (N, 3) the variances of the mean readings. The
    two unknown components of a sweep's direction take two of its three readings; the third determines ‖g‖², with the
    variance Σ 4 k⁴ (m + b)² v. The value of the bias b has no effect. Raise LinAlgError for a singular design.
    """
    k, rates, variances = (np.asarray(a, dtype=np.float64) for a in (scale, rates_rad_s, variances_rad2_s2))
    theta = np.concatenate([k, np.zeros(3)])
    means = rates / k
    jacobian = compute_squared_rate_jacobian(theta, means)
    return _inverse(jacobian / np.sqrt(compute_squared_rate_variance(theta, means, variances))[:, None])


def vector_matrix_bound(rates_rad_s: ArrayLike, variances_rad2_s2: ArrayLike) -> Array:
    """Return the Cramér–Rao bound (12, 12) for a gyroscope's matrix F, row by row, and its offset c.

    The readings are F ω + c, with the rates `rates_rad_s` ω (N, 3), which may be zero, and the noise
    `variances_rad2_s2`.
    """
    rates, variances = (np.asarray(a, dtype=np.float64) for a in (rates_rad_s, variances_rad2_s2))
    design = np.concatenate([rates, np.ones((len(rates), 1))], axis=1)
    bound = np.zeros((12, 12))
    for axis in range(3):
        columns = np.array([3 * axis, 3 * axis + 1, 3 * axis + 2, 9 + axis])
        bound[np.ix_(columns, columns)] = _inverse(design / np.sqrt(variances[:, axis])[:, None])
    return bound


def vector_bound(matrix: ArrayLike, rates_rad_s: ArrayLike, variances_rad2_s2: ArrayLike) -> Array:
    """Return the Cramér–Rao bound (6, 6) for kx, ky, kz, bx, by, bz if the rates are known as vectors.

    `matrix` (3, 3) is the gyroscope's true matrix F. The mean readings of N sweeps have the true rates `rates_rad_s`
    (N, 3) and the variances `variances_rad2_s2` (N, 3).
    """
    f = np.asarray(matrix, dtype=np.float64)
    jacobian = parameter_jacobian(f, scale_of(f))
    return jacobian @ vector_matrix_bound(rates_rad_s, variances_rad2_s2) @ jacobian.T


def triaxial_bound(
    matrix: ArrayLike,
    reference: ArrayLike,
    bias: ArrayLike,
    attitudes: ArrayLike,
    variances: ArrayLike,
    *,
    known_references: ArrayLike | None = None,
    second_order: ArrayLike | None = None,
) -> Array:
    """Return the Cramér–Rao bound (15, 15) of `matrix`, row by row, `reference` and `bias`.

    The bound is (18, 18) if `second_order` (3,) is given. The model is Eqs. (3) and (10) of the paper TRIAX. The
    arguments are true values, in the shapes of `solve_triaxial`. `known_references` (N, 3) are the table's own motion;
    without them the norm of `reference` counts as known.
    """
    parts = [np.ravel(matrix), np.asarray(reference), np.asarray(bias)]
    if second_order is not None:
        parts.append(np.asarray(second_order))
    theta = np.concatenate(parts).astype(np.float64)
    r, v = np.asarray(attitudes, dtype=np.float64), np.asarray(variances, dtype=np.float64)
    v_bar = np.zeros((len(r), 3)) if known_references is None else np.asarray(known_references, dtype=np.float64)
    return covariance_bound(theta, r, v_bar, whitening(v), norm_known=known_references is None)


def efficiency(errors: ArrayLike, bound: Array) -> Array:
    """Return the mean squared error (p,) of R runs (R, p) divided by the bound's diagonal: 1 if efficient."""
    return np.asarray(np.mean(np.asarray(errors) ** 2, axis=0) / np.diag(bound), dtype=np.float64)


def _inverse(weighted: Array) -> Array:
    """Return (JᵀJ)⁻¹ of the `weighted` Jacobian J, computed with columns of unit length."""
    size = np.linalg.norm(weighted, axis=0)
    scaled = weighted / size
    inverse: Array = np.asarray(np.linalg.inv(scaled.T @ scaled) / np.outer(size, size), dtype=np.float64)
    return inverse
