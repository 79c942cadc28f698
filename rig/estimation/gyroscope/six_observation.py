"""Scale factors and biases of a triaxial gyroscope from averaged revolutions: the equations of the paper SIX.

The model is g = K (m + b) for the rate g and the reading m, with K = diag(k) and b in rad/s of the reading. The paper
prints g = K m + b as Eq. (1), but its Eqs. (3), (4) and Algorithm 1 agree with the model here. Each revolution gives
one equation ‖g‖² = ω², Eq. (4):

    ω² = β0 + x β,   x = [mx² my² mz² mx my mz],   β = [k² …, 2 k² b …],   β0 = Σ k² b² = Σ β_l² / (4 β_s)

with s the three squares and l the three linear terms. The columns of X have the squares first, in the order of β; Eq.
(7) prints them last. m is the mean reading of the revolution, squared afterwards: averaging m², as Eq. (8) reads, adds
the noise's variance to every square and shrinks the scale.

β0 is unknown too. If it has the value γ, least squares give β(γ) = p − γ q with p = X⁺ω² and q = X⁺1 (X⁺: pseudoinverse
of X, 1: column of ones). With Γ(β) = Σ β_l² / (4 β_s) the solution is the γ that satisfies γ = Γ(β(γ)). Two functions
find it: `solve_by_newton`, and `solve_by_algorithm_1` as published in SIX. `rig.estimation.gyroscope.accumulator`
computes p and q from any number of revolutions.
"""

import numpy as np
from numpy.typing import ArrayLike

from rig.errors import Fault
from rig.estimation.arrays import Array

MODEL = "g = K (m + b)"
PARAMETERS = ("kx", "ky", "kz", "bx", "by", "bz")

ALGORITHM_1_TOLERANCE = 1e-6  # SIX, Algorithm 1
ALGORITHM_1_LIMIT = 1000
NEWTON_LIMIT = 20


def design(means_rad_s: ArrayLike) -> Array:
    """Return X (…, 6) = [mx² my² mz² mx my mz] of mean readings (…, 3) in rad/s: the paper's Eq. (7), squares first."""
    means = np.asarray(means_rad_s, dtype=np.float64)
    return np.concatenate([means * means, means], axis=-1)


def closed_form(means_rad_s: Array, speed_rad_s: float) -> tuple[Array, Array]:
    """Return scale (3,) and bias (3,) from exactly six mean readings (6, 3) at one speed by one linear solve.

    In this module's notation, at one speed p = ω² q, and γ = ω² Γ / (1 + Γ) with Γ = Σ q_l² / (4 q_s). The design is
    not checked, unlike in `Accumulator.solve`. Raise Fault `rank_deficient`, `negative_square`.
    """
    square = speed_rad_s * speed_rad_s
    q = solve_linear(design(means_rad_s), np.ones(6))
    return extract_parameters((square - _gamma_at_one_speed(q.tolist(), square)) * q)


def solve_by_newton(p: Array, q: Array, square_rad2_s2: float) -> tuple[Array, int]:
    """Return the module's β (6,) = p − γ q, with γ = Γ(β) by Newton's method, and the number of steps.

    The first γ is the closed form for the mean squared speed (rad²/s²), which is exact if all speeds are equal. From
    there the iteration converges for any bias. Raise Fault `negative_square`.
    """
    ps, qs = p.tolist(), q.tolist()
    gamma = _gamma_at_one_speed(qs, square_rad2_s2)
    steps = 0
    step = np.inf
    while abs(step) > 1e-13 * square_rad2_s2 and steps < NEWTON_LIMIT:
        value, slope = -gamma, -1.0
        for s in range(3):
            beta_s, beta_l = ps[s] - gamma * qs[s], ps[s + 3] - gamma * qs[s + 3]
            if not beta_s > 0:
                raise negative_square(s)
            bias = beta_l / (2 * beta_s)
            value += beta_s * bias * bias
            slope += bias * (bias * qs[s] - qs[s + 3])
        step = value / slope
        gamma -= step
        steps += 1
    return p - gamma * q, steps


def solve_by_algorithm_1(p: Array, q: Array) -> tuple[Array, int]:
    """Return the module's β (6,) and the number of passes by the paper's Algorithm 1, as published.

    β ← (XᵀX)⁻¹Xᵀ(ω² − γ) = p − γ q and γ ← Γ(β), beginning with γ = 0, until Σ|Δβ| ≤ 10⁻⁶; the first β is pass 1. Each
    pass shrinks the step by β0 / (ω² − β0), so convergence needs β0 < ω²/2 (at 1 rad/s this is the paper's "β0 <
    0.5"). Raise Fault `algorithm_1_diverged` as soon as a step grows.
    """
    beta, last_change = p, np.inf
    for passes in range(2, ALGORITHM_1_LIMIT):
        gamma = float(np.sum(beta[3:] ** 2 / (4 * beta[:3]))) if beta[:3].all() else np.inf
        improved = p - gamma * q
        change = float(np.sum(np.abs(improved - beta)))
        if change <= ALGORITHM_1_TOLERANCE:
            return improved, passes
        if not change < last_change:
            break
        beta, last_change = improved, change
    raise Fault(
        "algorithm_1_diverged",
        "Algorithm 1 does not converge: the bias is too large for the turn rate (Σ k² b² against ω²/2)",
        "Use the estimator newton, or sweep faster",
    )


def extract_parameters(beta: Array) -> tuple[Array, Array]:
    """Return scale k = √β_s and bias b = β_l / (2 β_s), (3,) each, from `beta` β: squares β_s, then linear terms β_l.

    Raise Fault `negative_square`.
    """
    squares = beta[:3]
    for s, square in enumerate(squares.tolist()):
        if not square > 0:
            raise negative_square(s)
    return np.sqrt(squares), beta[3:] / (2 * squares)


def solve_linear(matrix: Array, right: Array) -> Array:
    """Return the solution of a square system. Raise Fault `rank_deficient`."""
    try:
        return np.asarray(np.linalg.solve(matrix, right), dtype=np.float64)
    except np.linalg.LinAlgError:
        raise rank_deficient("an axis") from None


def rank_deficient(axis: str) -> Fault:
    """Return the Fault of a design without full rank; `axis` is the undetermined one."""
    return Fault(
        "rank_deficient",
        f"the sweeps cannot separate scale and bias: {axis} was not swept in both directions",
        "Sweep every wrist in both directions; a second sweep in one direction cannot replace the other direction",
    )


def _gamma_at_one_speed(q: list[float], square: float) -> float:
    """Return the module's γ for sweeps at one speed, as `closed_form` defines it. Raise Fault `negative_square`."""
    total = 0.0
    for s in range(3):
        if q[s] == 0:
            raise negative_square(s)
        total += q[s + 3] ** 2 / (4 * q[s])
    return square * total / (1 + total)


def negative_square(axis: int) -> Fault:
    """Return the Fault of an axis (0–2) whose readings give no positive square of its scale factor."""
    return Fault(
        "negative_square",
        f"the squared scale factor of {'xyz'[axis]} is zero, negative or not a number",
        "The readings do not fit the speeds: check axes, units, and that all six directions were swept",
    )
