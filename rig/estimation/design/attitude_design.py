"""The information that a planned set of attitudes gives about an accelerometer at rest in them.

The model is that of `rig.estimation.reference.reference_model` for a reference v_ref of known norm, linearised about an
ideal sensor: F = I, bias b = 0, nonlinearity φ = 0 (Eqs. (10) and (11) of the paper TRIAX). Noise of the standard
deviation σ and an attitude error δ give the readings the covariance σ² I + δ² E Eᵀ, with the effects E of a small
rotation (`rig.estimation.reference.attitude_error`).

Attitudes R (N, 3, 3) take body to table coordinates, `up` (3,) is a unit vector of the table. The model of `order` 1
has 14 free numbers, namely F, b and the direction of v_ref; that of order 2 has 17, because it has φ (3,) as well.
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from rig.estimation.arrays import Array
from rig.estimation.reference.attitude_error import effects, find_whiteners
from rig.estimation.reference.reference_model import (
    BIAS,
    REFERENCE,
    SECOND,
    covariance_bound,
    free_directions,
    weighted_jacobian,
    whitening,
)
from rig.estimation.refusals import condition_of

Order = Literal[1, 2]
PARAMETER_COUNT = {1: 14, 2: 17}
ROUNDING_LENGTH = 1e-6  # least component of a unit vector in the undetermined directions: a smaller one is rounding
PARAMETER_NAMES = (  # the parameter of each element of θ
    *("scale of x", "angle x y", "angle x z", "angle x y", "scale of y"),
    *("angle y z", "angle x z", "angle y z", "scale of z"),
    *("the vertical",) * 3,
    *("bias of x", "bias of y", "bias of z"),
    *("second order of x", "second order of y", "second order of z"),
)
CANDIDATE_ATTITUDES = 4000


@dataclass(frozen=True, slots=True)
class Identifiability:
    """The identifiability in a set of attitudes: the `rank`, out of `needed`, and the `undetermined` parameters.

    `condition` is the condition number of the equations in g, infinite below full rank.
    """

    rank: int
    needed: int
    condition: float
    undetermined: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class ExpectedStds:
    """The smallest possible standard deviations (Cramér–Rao) of an accelerometer's parameters, each RMS of three axes.

    `scale_std` is relative; `second_order_std_s2_m`, of the nonlinearity, is None for `order` 1.
    """

    scale_std: float
    non_orthogonality_std_rad: float
    bias_std_m_s2: float
    second_order_std_s2_m: float | None


def assess_identifiability(attitudes: Array, up: Array, order: Order = 1) -> Identifiability:
    """Return rank, condition and undetermined parameters of attitudes (N, 3, 3) with the vertical `up` (3,)."""
    rows = _equations(attitudes, up, order)
    needed = PARAMETER_COUNT[order]
    conditioned = condition_of(rows, needed)
    if conditioned.rank == needed:
        return Identifiability(needed, needed, conditioned.condition, ())
    _, _, directions = np.linalg.svd(rows)
    loose = free_directions(_ideal(up, order), norm_known=True) @ directions[conditioned.rank :].T
    undetermined = np.linalg.norm(loose, axis=1) > ROUNDING_LENGTH
    parts = dict.fromkeys(part for part, is_loose in zip(PARAMETER_NAMES, undetermined, strict=False) if is_loose)
    return Identifiability(conditioned.rank, needed, float("inf"), tuple(parts))


def g_efficiency(attitudes: Array, up: Array, order: Order = 1) -> float:
    """Return the G-efficiency: the number of parameters over the worst prediction variance; 1 at best, 0 if singular.

    The attitudes count as exact, and all readings as equally noisy. The prediction variance of any orientation is N
    times the trace of the predicted reading's covariance (3, 3), in units of one reading's variance. Its mean over the
    design's own N attitudes is the number of parameters (Kiefer and Wolfowitz).
    """
    from scipy.optimize import minimize
    from scipy.spatial.transform import Rotation

    rows = _equations(attitudes, up, order)
    if assess_identifiability(attitudes, up, order).undetermined:
        return 0.0
    covariance = np.linalg.inv(rows.T @ rows)
    orientations = Rotation.from_quat(_spiral(CANDIDATE_ATTITUDES))

    def variances(bodies: Array) -> Array:
        predicted = _equations(bodies, up, order).reshape(len(bodies), 3, -1)
        return np.asarray(len(attitudes) * np.einsum("nip,pq,niq->n", predicted, covariance, predicted))

    values = variances(orientations.as_matrix())
    start = orientations[int(np.argmax(values))]

    def negative_variance(turn: Array) -> float:
        return -float(variances((start * Rotation.from_rotvec(turn)).as_matrix()[None])[0])

    climbed = minimize(negative_variance, np.zeros(3), method="Nelder-Mead", options={"xatol": 1e-6, "fatol": 1e-9})
    return PARAMETER_COUNT[order] / max(float(values.max()), -float(climbed.fun))


def predict_stds(
    attitudes: Array, reference_m_s2: Array, noise_m_s2: Array, attitude_std_rad: float, order: Order = 1
) -> ExpectedStds:
    """Return the smallest possible standard deviations of a calibration from mean readings in N attitudes.

    The readings have noise of std `noise_m_s2` (N,), the attitudes errors of std `attitude_std_rad` about each axis.
    `reference_m_s2` (3,) is the specific force at rest, in table coordinates. The attitudes must determine all
    parameters, see `assess_identifiability`.
    """
    theta, count = _ideal(reference_m_s2, order), len(attitudes)
    v_bar = np.zeros((count, 3))
    variances = np.repeat(noise_m_s2[:, None] ** 2, 3, axis=1)
    white = find_whiteners(variances, effects(theta, attitudes, v_bar), np.full(count, attitude_std_rad))
    bound = covariance_bound(theta, attitudes, v_bar, white, norm_known=True)
    between = np.zeros((3, len(theta)))  # about F = 1 the cosine between two axes is the sum of their two elements
    for row, (i, j) in enumerate(((0, 1), (1, 2), (2, 0))):
        between[row, [3 * i + j, 3 * j + i]] = 1.0
    variance = np.diag(bound)
    return ExpectedStds(
        scale_std=_rms(variance[[0, 4, 8]]),
        non_orthogonality_std_rad=_rms(np.diag(between @ bound @ between.T)),
        bias_std_m_s2=_rms(variance[BIAS]),
        second_order_std_s2_m=_rms(variance[SECOND]) if order == 2 else None,
    )


def _rms(variances: Array) -> float:
    return float(np.sqrt(np.mean(variances)))


def _ideal(reference: Array, order: Order) -> Array:
    """Return the parameters (p,) of the fit: those of an ideal sensor, with the matrix F = I, and the `reference`."""
    theta = np.zeros(18 if order == 2 else 15)
    theta[[0, 4, 8]] = 1.0
    theta[REFERENCE] = reference
    return theta


def _equations(attitudes: Array, up: Array, order: Order) -> Array:
    """Return the design matrix (3 N, 14 or 17) of readings in g for the free parameters, with equal weights."""
    theta, v_bar = _ideal(up, order), np.zeros((len(attitudes), 3))
    return weighted_jacobian(theta, attitudes, v_bar, whitening(np.ones((len(attitudes), 3))), norm_known=True)


def _spiral(count: int) -> Array:
    """Return quaternions (count, 4) spread evenly over all rotations (Alexa, Super-Fibonacci spirals, CVPR 2022)."""
    step = np.arange(count) + 0.5
    inner, outer = np.sqrt(step / count), np.sqrt(1 - step / count)
    first, second = 2 * np.pi * step / np.sqrt(2), 2 * np.pi * step / 1.533751168755204288118041  # root of ψ⁴ = ψ + 4
    return np.stack(
        [inner * np.sin(first), inner * np.cos(first), outer * np.sin(second), outer * np.cos(second)], axis=1
    )
