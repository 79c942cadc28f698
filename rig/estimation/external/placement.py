"""A body that is laid down again: what a placement itself does to a reading, beside its noise and its tilt.

    v_m = F (s + φ s²) + b + E ε + η,   ε ~ N(0, δ² 1),   η ~ N(0, ζ² 1)

ε turns the body (`rig.estimation.reference.attitude_error`) and leaves the size of what is felt alone; η does not: a
bias that another stress or another warmth has moved, what its neighbourhood adds. Longer dwells make neither smaller. A
solution from six faces has hardly anything left over that tells ζ from δ, so no one value of them is taken: θ and its
covariance are means over both, as likely as the residuals make them: restricted likelihood, with every δ equally likely
before and ζ about a milli-g, or far from it (half-Cauchy; Gelman, Bayesian Analysis 1 (2006) 515).

Rests of which no attitude is known tell ζ as well: whichever way the body lay, the reference's size is what it is.
"""

from dataclasses import dataclass, replace

import numpy as np

from rig.estimation.arrays import Array
from rig.estimation.reference.attitude_error import AttitudeError, Placed, effects
from rig.estimation.reference.reference_model import BIAS, REFERENCE, F, free_directions, jacobian, predicted

SMALLEST_RAD, LARGEST_RAD, GRID = 1e-6, 0.1, 24  # of δ, and of ζ in terms of the reference
USUAL = 1e-3  # of the reference: half of all sensors repeat so well when they are laid down again (a milli-g)
ANY_RAD = 1.0  # standard deviation of an attitude that nobody has told


@dataclass(frozen=True, slots=True)
class LaidDown:
    """θ (p,) and its covariance (p, p), the sum of what `causes` do by name; the sizes found, one standard deviation.

    `placement_std` is ζ in the unit of the readings, `attitude_error` δ.
    """

    theta: Array
    covariance: Array
    causes: dict[str, Array]
    attitude_error: AttitudeError
    placement_std: float
    placement_uncertainty: float


NOISE, ATTITUDES, PLACEMENTS = "noise", "attitudes", "placements"


@dataclass(frozen=True, slots=True)
class _Linear:
    """The readings of N placements about a solution: `residuals` (N, 3), `design` (N, 3, q), noise (N, 3), tilt."""

    residuals: Array
    design: Array
    variances: Array
    turned: Array
    std_rad: Array

    def fits(self, delta: float, zetas: Array) -> "_Fits":
        """The fits for given sizes of the errors: steps, their covariances by causes, the restricted likelihoods."""
        spread = self.turned * np.hypot(self.std_rad, delta)[:, None, None]
        errors = {
            NOISE: np.eye(3) * self.variances[:, :, None],
            ATTITUDES: spread @ np.swapaxes(spread, -1, -2),
            PLACEMENTS: zetas[:, None, None, None] ** 2 * np.eye(3),
        }
        covariance = errors[NOISE] + errors[ATTITUDES] + errors[PLACEMENTS]
        weighted = np.linalg.solve(covariance, self.design)
        columns = self.design.shape[-1]
        across = np.swapaxes(weighted.reshape(len(zetas), -1, columns), 1, 2)
        information = across @ self.design.reshape(-1, columns)
        unit = 1 / np.sqrt(np.diagonal(information, axis1=1, axis2=2))
        unit = unit[:, :, None] * unit[:, None]
        inverse = np.linalg.inv(information * unit) * unit
        steps = (inverse @ (across @ self.residuals.ravel())[..., None])[..., 0]
        left = self.residuals[..., None] - self.design @ steps[:, None, :, None]
        chi_square = np.sum(left * np.linalg.solve(covariance, left), axis=(1, 2, 3))
        sizes = np.linalg.slogdet(covariance)[1].sum(axis=1) + np.linalg.slogdet(information)[1]
        causes = {
            name: inverse @ across @ (error @ weighted).reshape(len(zetas), -1, columns) @ inverse
            for name, error in errors.items()
        }
        return _Fits(steps, causes, -0.5 * (chi_square + sizes))


@dataclass(frozen=True, slots=True)
class _Fits:
    """Steps (k, q), their covariances (k, q, q) by causes, the logarithms (k,) of the likelihood."""

    steps: Array
    causes: dict[str, Array]
    likelihood: Array


def laid_down(theta: Array, placed: Placed, elsewhere: Array, elsewhere_variances: Array) -> LaidDown:
    """What is laid down beside a solution θ (p,): by what that leaves, and means (k, 3) of rests without attitude."""
    whole = _with(theta, placed, elsewhere, elsewhere_variances)
    free = free_directions(theta, norm_known=whole.norm_known)
    linear = _Linear(
        whole.readings - predicted(theta, whole.attitudes, whole.v_bar),
        jacobian(theta, whole.attitudes, whole.v_bar) @ free,
        whole.variances,
        effects(theta, whole.attitudes, whole.v_bar),
        whole.attitude_std_rad,
    )
    size = float(np.linalg.norm(theta[REFERENCE]))
    sizes = np.geomspace(SMALLEST_RAD, LARGEST_RAD, GRID)
    looked = np.array([(delta, size * ratio) for delta in sizes for ratio in sizes])
    fits = [linear.fits(delta, size * sizes) for delta in sizes.tolist()]
    likelihood = np.concatenate([fit.likelihood for fit in fits]) + _before(looked, size)
    weights = np.exp(likelihood - likelihood.max())
    weights /= weights.sum()
    steps = np.concatenate([fit.steps for fit in fits])
    step = weights @ steps
    causes = {
        name: free @ np.tensordot(weights, np.concatenate([fit.causes[name] for fit in fits]), 1) @ free.T
        for name in (NOISE, ATTITUDES, PLACEMENTS)
    }
    causes[PLACEMENTS] = causes[PLACEMENTS] + free @ ((steps - step).T * weights @ (steps - step)) @ free.T
    found = theta + free @ step
    if whole.norm_known:
        found[REFERENCE] *= size / np.linalg.norm(found[REFERENCE])
    delta, zeta = weights @ looked
    spread = np.sqrt(weights @ (looked - weights @ looked) ** 2)
    return LaidDown(
        theta=found,
        covariance=np.sum(list(causes.values()), axis=0),
        causes=causes,
        attitude_error=AttitudeError(float(delta), float(spread[0])),
        placement_std=float(zeta),
        placement_uncertainty=float(spread[1]),
    )


def _before(looked: Array, size: float) -> Array:
    """(n,) logarithm of how likely δ and ζ are before anything is seen, on a grid of their logarithms."""
    delta, zeta = looked.T
    known: Array = np.log(delta) + np.log(zeta) - np.log1p((zeta / (USUAL * size)) ** 2)
    return known


def _with(theta: Array, placed: Placed, elsewhere: Array, variances: Array) -> Placed:
    """The rests without an attitude beside the others, each turned so that it reads what it reads."""
    if not len(elsewhere) or not placed.norm_known:
        return placed
    felt = (elsewhere - theta[BIAS]) @ np.linalg.inv(theta[F].reshape(3, 3)).T
    attitudes = np.array([_turning(each, theta[REFERENCE]) for each in felt])
    return replace(
        placed,
        readings=np.concatenate([placed.readings, elsewhere]),
        variances=np.concatenate([placed.variances, variances]),
        attitudes=np.concatenate([placed.attitudes, attitudes]),
        v_bar=np.concatenate([placed.v_bar, np.zeros_like(elsewhere)]),
        attitude_std_rad=np.concatenate([placed.attitude_std_rad, np.full(len(elsewhere), ANY_RAD)]),
    )


def _turning(felt: Array, reference: Array) -> Array:
    """The smallest rotation (3, 3), body to table, by which the reference (3,) is felt in a direction (3,)."""
    from scipy.spatial.transform import Rotation

    one, other = (each / np.linalg.norm(each) for each in (felt, reference))
    axis, cosine = np.cross(one, other), float(one @ other)
    sine = float(np.linalg.norm(axis))
    if sine < 1e-9:
        axis, sine = np.cross(one, np.eye(3)[np.argmin(np.abs(one))]), 1.0
        axis /= np.linalg.norm(axis)
        return np.asarray(Rotation.from_rotvec(axis * (0.0 if cosine > 0 else np.pi)).as_matrix(), dtype=np.float64)
    return np.asarray(Rotation.from_rotvec(axis / sine * np.arctan2(sine, cosine)).as_matrix(), dtype=np.float64)
