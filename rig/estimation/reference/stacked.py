"""The stacked linear problem of the paper TRIAX, Eqs. (4)–(6), with or without second-order columns, Eq. (11).

F⁻¹ v_m − Rᵀ v_ref − b* − φ s² = v̄ with b* = F⁻¹ b is linear in β = [rows of F⁻¹, v_ref, b*, φ]:

    X β = V̄,   X = [D(v_m)  −Rᵀ  −I  −diag(s²)]

For v̄ ≠ 0 the solution is by linear least squares, Eq. (6). For v̄ = 0 it is the last right singular vector, Eq. (5),
scaled to the given ‖v_ref‖ and sign. This vector depends on the units of the columns, which the paper does not state;
here every block of columns is scaled to unit RMS first.

All functions broadcast over runs: readings (…, N, 3). θ is as in `reference_model`: F itself and b, not their inverses.
"""

import numpy as np

from rig.estimation.arrays import Array
from rig.estimation.reference.reference_model import (
    BIAS,
    REFERENCE,
    SECOND,
    F,
    KnownNorm,
    ReferencePrior,
    matrix,
    sensed,
)


def stack(readings: Array, attitudes: Array, squares: Array | None) -> Array:
    """Return the design matrix X (…, 3 N, 15) of the paper's Eq. (4).

    With the `squares` (…, N, 3) of the true quantity it has the three columns of Eq. (11) too: (…, 3 N, 18).
    """
    x = np.zeros((*readings.shape, 15 if squares is None else 18))
    for i in range(3):
        x[..., i, 3 * i : 3 * i + 3] = readings
        x[..., i, 12 + i] = -1.0
        if squares is not None:
            x[..., i, 15 + i] = -squares[..., i]
    x[..., REFERENCE] = -np.swapaxes(attitudes, -1, -2)
    return x.reshape(*readings.shape[:-2], -1, x.shape[-1])


def column_sizes(readings: Array, squares: Array | None) -> Array:
    """Return the root-mean-square size (…, 15 or 18) of the block to which each column of the design belongs."""
    sizes = np.ones((*readings.shape[:-2], 15 if squares is None else 18))
    sizes[..., F] = np.sqrt(np.mean(readings**2, axis=(-2, -1)))[..., None]
    sizes[..., REFERENCE] = np.sqrt(1 / 3)
    if squares is not None:
        sizes[..., SECOND] = np.sqrt(np.mean(squares**2, axis=(-2, -1)))[..., None]
    return sizes


def least_squares(x: Array, sizes: Array, v_bar: Array) -> Array:
    """Return β (…, p) of Eq. (6) for the design `x` (…, 3 N, p), scaled by column `sizes`, and the motion `v_bar`."""
    scaled = x / sizes[..., None, :]
    beta: Array = (np.linalg.pinv(scaled) @ v_bar.reshape(-1)) / sizes
    return beta


def null_vector(x: Array, sizes: Array, norm: float, side: Array) -> Array:
    """Return β (…, p), the solution of the paper's homogeneous Eq. (5) X β = 0 for the design `x` (…, 3 N, p).

    Its size and sign are free. They are chosen so that the reference in β has this `norm` and, of its two directions,
    the one nearer to `side` (3,).
    """
    _, _, directions = np.linalg.svd(x / sizes[..., None, :], full_matrices=False)
    beta = directions[..., -1, :] / sizes
    reference = beta[..., REFERENCE]
    sign = np.where(reference @ side < 0, -1.0, 1.0)
    scaled: Array = beta * (norm * sign / np.linalg.norm(reference, axis=-1))[..., None]
    return scaled


def to_theta(beta: Array) -> Array:
    """Return the parameters of the forward model, with F and b, from `beta`, which contains F⁻¹ and F⁻¹ b instead."""
    theta = beta.copy()
    f = np.linalg.inv(matrix(beta))
    theta[..., F] = f.reshape(*f.shape[:-2], 9)
    theta[..., BIAS] = np.einsum("...ij,...j->...i", f, beta[..., BIAS])
    return theta


def estimate_as_published(
    readings: Array, attitudes: Array, prior: ReferencePrior, *, second_order: bool
) -> tuple[Array, int]:
    """Return the parameters by the paper's method as published, and the number of linear solutions.

    There are 15 parameters, or 18 with `second_order` terms. With these terms the linear solution is repeated until the
    reference converges, each time with squares of the input that are computed from the last solution.
    """
    x = stack(readings, attitudes, None)
    theta = to_theta(_solve(x, column_sizes(readings, None), prior))
    if not second_order:
        return theta, 1
    v_bar = prior.v_bar(len(attitudes))
    solutions = 1
    change = np.inf
    while change > 1e-12 and solutions < 50:
        squares = sensed(theta, attitudes, v_bar) ** 2
        x = stack(readings, attitudes, squares)
        last = theta[..., REFERENCE]
        theta = to_theta(_solve(x, column_sizes(readings, squares), prior))
        moved = np.linalg.norm(theta[..., REFERENCE] - last, axis=-1) / np.linalg.norm(last, axis=-1)
        change, solutions = float(np.max(moved)), solutions + 1
    return theta, solutions


def _solve(x: Array, sizes: Array, prior: ReferencePrior) -> Array:
    """Return β (…, p) for the design X by Eq. (5) if the norm of v_ref is given, else by Eq. (6).

    X is scaled by the `sizes` of its columns.
    """
    if isinstance(prior, KnownNorm):
        return null_vector(x, sizes, prior.norm, np.asarray(prior.side, dtype=np.float64))
    return least_squares(x, sizes, prior.v_bar(x.shape[-2] // 3))


def compute_published_covariance(
    theta: Array, readings: Array, attitudes: Array, prior: ReferencePrior, variances: Array
) -> Array:
    """Return the covariance (p, p) of the parameters by the published method, to first order in the readings' errors.

    The errors have `variances` (N, 3). An error e of a reading also changes the matrix X of the equations, so the error
    enters equation k as F⁻¹ e_k. Hence δβ = −X⁺ F⁻¹ e, of which the part that would change ‖v_ref‖ is removed if that
    norm is given. With second-order terms s² changes with v_ref. F and b follow from β.
    """
    second_order = len(theta) > 15
    norm_known = isinstance(prior, KnownNorm)
    s = sensed(theta, attitudes, prior.v_bar(len(attitudes)))
    squares = s**2 if second_order else None
    x, sizes = stack(readings, attitudes, squares), column_sizes(readings, squares)
    f = matrix(theta)
    inverse = np.linalg.inv(f)
    p = len(theta)
    left_vectors, singular, right_vectors = np.linalg.svd(x / sizes, full_matrices=False)
    rank = p - norm_known
    pseudo = ((right_vectors[:rank].T / singular[:rank]) @ left_vectors[:, :rank].T) / sizes[:, None]  # X⁺
    project = np.eye(p)
    if norm_known:
        beta = theta.copy()
        beta[F], beta[BIAS] = inverse.ravel(), inverse @ theta[BIAS]
        reference = theta[REFERENCE]
        project[:, REFERENCE] -= np.outer(beta, reference) / (reference @ reference)
    gain = -project @ pseudo
    if second_order:  # δβ changes s² and with it the equations, so that δβ = gain (F⁻¹ e + feedback δβ)
        feedback = np.zeros((len(s), 3, p))
        feedback[..., REFERENCE] = -(2 * theta[SECOND] * s)[..., None] * np.swapaxes(attitudes, -1, -2)
        gain = np.linalg.solve(np.eye(p) - gain @ feedback.reshape(-1, p), gain)
    to_errors = np.einsum("pni,ij->pnj", gain.reshape(p, -1, 3), inverse)
    of_beta = np.einsum("pnj,nj,qnj->pq", to_errors, variances, to_errors)
    change = np.eye(p)  # derivative of θ by β
    change[F, F] = -np.kron(f, f.T)
    change[BIAS, F] = -np.kron(f, theta[BIAS])
    change[BIAS, BIAS] = f
    return np.asarray(change @ of_beta @ change.T, dtype=np.float64)
