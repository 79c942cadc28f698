"""Errors of repeated placements: what a placement adds to a reading in addition to noise and tilt.

    v_m = F (s + φ s²) + b + E ε + η,   ε ~ N(0, δ² I),   η ~ N(0, ζ² I)

v_m is the mean reading in a placement, and s the reference in body axes; the parameters θ are the matrix F, the
nonlinearity φ, the bias b and the reference. ε is a small rotation of the body, with the effect E ε on the reading
(`rig.estimation.reference.attitude_error`), and does not change the norm of the reference. η changes the norm, for
example by a bias that depends on stress or temperature, or by a local disturbance. Longer dwells reduce neither ε nor
η. A solution from six faces has hardly any redundancy to separate ζ from δ. So θ and its covariance are averages over ζ
and δ. The weights are the restricted likelihood times the prior, which is uniform in δ and half-Cauchy in ζ with a
scale of a milli-g (Gelman, Bayesian Analysis 1 (2006) 515).

Rests in an unknown attitude determine ζ as well, because the reference's norm is the same in every attitude.
"""

from dataclasses import dataclass, replace

import numpy as np

from rig.estimation.arrays import Array
from rig.estimation.external.abrupt_change import AbruptChange
from rig.estimation.external.placement_model import ERROR_MEDIAN_RATIO, MAX_CORRELATED, build_placement_model
from rig.estimation.reference.attitude_error import AttitudeError, AttitudeReadings, effects
from rig.estimation.reference.reference_model import BIAS, REFERENCE, F, free_directions, jacobian, predicted
from rig.estimation.statistics.coverage import COVERAGE_FACTOR

MIN_ERROR_RAD, MAX_ERROR_RAD, GRID_POINTS = 1e-6, 0.1, 24  # grid of δ, and of ζ relative to the reference
UNKNOWN_ATTITUDE_STD_RAD = 1.0


@dataclass(frozen=True, slots=True)
class PlacementSolution:
    """The parameters `theta` (p,), estimated with placement errors; their covariance is the sum of named `causes`.

    `placement_std` is the std ζ of the errors η in the unit of the readings, `placement_uncertainty` the standard
    uncertainty of this std. `attitude_error` states the std δ of the rotations ε, and the uncertainty of that.
    """

    theta: Array
    covariance: Array
    causes: dict[str, Array]
    attitude_error: AttitudeError
    placement_std: float
    placement_uncertainty: float

    def add_change(self, change: AbruptChange) -> "PlacementSolution":
        """Return the solution with a covariance so large that U covers the sensor before and after an abrupt change."""
        more, changed = np.zeros_like(self.covariance), np.r_[F, BIAS]
        more[np.ix_(changed, changed)] = change.find_covariance(self.theta[F].reshape(3, 3))
        return replace(self, covariance=self.covariance + more, causes=self.causes | {CHANGE: more})


NOISE, ATTITUDES, PLACEMENTS, CHANGE = "noise", "attitudes", "placements", "abrupt change"


@dataclass(frozen=True, slots=True)
class _LinearisedPlacements:
    """The linearised readings of N placements.

    - residuals (N, 3): readings minus model; variances (N, 3) of their noise.
    - design (N, 3, q): derivatives of the readings with respect to q free directions of the parameters.
    - turned (N, 3, 3): the effects of a small rotation; std_rad (N,): the attitudes' stated standard deviations.
    """

    residuals: Array
    design: Array
    variances: Array
    turned: Array
    std_rad: Array

    def fits(self, delta: float, zetas: Array) -> "_PlacementFits":
        """Return the fits after one Gauss–Newton step with attitude errors of std `delta`.

        There is one fit for each of `zetas` (k,), the std of the placement errors.
        """
        tilts = self.turned * np.hypot(self.std_rad, delta)[:, None, None]
        errors = {
            NOISE: np.eye(3) * self.variances[:, :, None],
            ATTITUDES: tilts @ np.swapaxes(tilts, -1, -2),
            PLACEMENTS: zetas[:, None, None, None] ** 2 * np.eye(3),
        }
        covariance = errors[NOISE] + errors[ATTITUDES] + errors[PLACEMENTS]
        weighted = np.linalg.solve(covariance, self.design)
        columns = self.design.shape[-1]
        across = np.swapaxes(weighted.reshape(len(zetas), -1, columns), 1, 2)  # JᵀV⁻¹ (k, q, 3 N)
        information = across @ self.design.reshape(-1, columns)
        unit = 1 / np.sqrt(np.diagonal(information, axis1=1, axis2=2))  # the scaled matrix is well conditioned
        unit = unit[:, :, None] * unit[:, None]
        inverse = np.linalg.inv(information * unit) * unit
        steps = (inverse @ (across @ self.residuals.ravel())[..., None])[..., 0]
        residuals = self.residuals[..., None] - self.design @ steps[:, None, :, None]
        chi_square = np.sum(residuals * np.linalg.solve(covariance, residuals), axis=(1, 2, 3))
        log_determinants = np.linalg.slogdet(covariance)[1].sum(axis=1) + np.linalg.slogdet(information)[1]
        causes = {
            name: inverse @ across @ (error @ weighted).reshape(len(zetas), -1, columns) @ inverse
            for name, error in errors.items()
        }
        return _PlacementFits(steps, causes, -0.5 * (chi_square + log_determinants))


@dataclass(frozen=True, slots=True)
class _PlacementFits:
    """The fits for k sizes of the placement errors.

    `steps` (k, q) are the parameters' changes. `causes` are parts (k, q, q) of the steps' covariances, by name;
    `likelihood` (k,) is the logarithm of the restricted likelihood.
    """

    steps: Array
    causes: dict[str, Array]
    likelihood: Array


def laid_down(theta: Array, placed: AttitudeReadings, unplaced: Array, unplaced_variances: Array) -> PlacementSolution:
    """Return the solution with placement errors, one step from the solution `theta` (p,) without them.

    `unplaced` (k, 3) are readings in unknown attitudes.
    """
    all_rests = _add_unplaced(theta, placed, unplaced, unplaced_variances)
    free = free_directions(theta, norm_known=all_rests.norm_known)
    linear = _LinearisedPlacements(
        all_rests.readings - predicted(theta, all_rests.attitudes, all_rests.v_bar),
        jacobian(theta, all_rests.attitudes, all_rests.v_bar) @ free,
        all_rests.variances,
        effects(theta, all_rests.attitudes, all_rests.v_bar),
        all_rests.attitude_std_rad,
    )
    size = float(np.linalg.norm(theta[REFERENCE]))
    sizes = np.geomspace(MIN_ERROR_RAD, MAX_ERROR_RAD, GRID_POINTS)
    grid = np.array([(delta, size * ratio) for delta in sizes for ratio in sizes])
    fits = [linear.fits(delta, size * sizes) for delta in sizes.tolist()]
    likelihood = np.concatenate([fit.likelihood for fit in fits]) + _find_log_prior(grid, size)
    weights = np.exp(likelihood - likelihood.max())
    weights /= weights.sum()
    steps = np.concatenate([fit.steps for fit in fits])
    step = weights @ steps  # the posterior mean; the scatter of the steps is part of the placements' covariance
    causes = {
        name: free @ np.tensordot(weights, np.concatenate([fit.causes[name] for fit in fits]), 1) @ free.T
        for name in (NOISE, ATTITUDES, PLACEMENTS)
    }
    causes[PLACEMENTS] = causes[PLACEMENTS] + free @ ((steps - step).T * weights @ (steps - step)) @ free.T
    averaged = theta + free @ step
    if all_rests.norm_known:
        averaged[REFERENCE] *= size / np.linalg.norm(averaged[REFERENCE])
    delta, zeta = weights @ grid
    stds = np.sqrt(weights @ (grid - weights @ grid) ** 2)
    laid = PlacementSolution(
        theta=averaged,
        covariance=np.sum(list(causes.values()), axis=0),
        causes=causes,
        attitude_error=AttitudeError(float(delta), float(stds[0])),
        placement_std=float(zeta),
        placement_uncertainty=float(stds[1]),
    )
    return laid if len(all_rests.readings) > MAX_CORRELATED else _relate_errors(laid, all_rests, len(placed.readings))


def _relate_errors(laid: PlacementSolution, all_rests: AttitudeReadings, stated: int) -> PlacementSolution:
    """Return the solution of a model in which errors of the first `stated` attitudes may vary smoothly with attitude.

    The covariance is computed at the most probable standard deviations of the errors. It is then enlarged until its
    95 % intervals are those of the posterior that is marginalized over these standard deviations.
    """
    model, theta = build_placement_model(laid.theta, all_rests, stated), laid.theta.copy()
    maxima = model.find_maxima()
    fit, free = model.solve(maxima[0]), free_directions(theta, norm_known=all_rests.norm_known)
    covariance = free @ fit.covariance @ free.T
    varying = np.flatnonzero(np.diag(covariance) > 0)
    ratio = np.ones(len(theta))
    ratio[varying] = model.expand(maxima, free[varying]) / (COVERAGE_FACTOR * np.sqrt(np.diag(covariance)[varying]))
    weights = np.linalg.solve(model.covariance(maxima[0]), model.mixed.design) @ fit.covariance @ free.T * ratio
    tilts, related, changed = np.square(maxima[0])[:, None, None] * model.mixed.components
    noise = np.diag(all_rests.variances.ravel())
    parts = {NOISE: noise, ATTITUDES: model.mixed.fixed - noise + tilts + related, PLACEMENTS: changed}
    causes = {name: np.asarray(weights.T @ part @ weights, dtype=np.float64) for name, part in parts.items()}
    theta += free @ fit.theta
    if all_rests.norm_known:
        theta[REFERENCE] *= np.linalg.norm(laid.theta[REFERENCE]) / np.linalg.norm(theta[REFERENCE])
    return replace(laid, theta=theta, covariance=np.sum(list(causes.values()), axis=0), causes=causes)


def _find_log_prior(grid: Array, size: float) -> Array:
    """Return the log prior density (n,), over their logarithms, of n pairs of standard deviations `grid` (n, 2).

    The prior is uniform in the first, that of attitude errors, and half-Cauchy in the second, that of placement
    errors. `size` is the norm of the reference.
    """
    delta, zeta = grid.T
    log_prior: Array = np.log(delta) + np.log(zeta) - np.log1p((zeta / (ERROR_MEDIAN_RATIO * size)) ** 2)
    return log_prior


def _add_unplaced(theta: Array, placed: AttitudeReadings, unplaced: Array, variances: Array) -> AttitudeReadings:
    """Return all rests; those without an attitude, `unplaced` (k, 3), get the attitude that fits best with `theta`."""
    if not len(unplaced) or not placed.norm_known:
        return placed
    forces = (unplaced - theta[BIAS]) @ np.linalg.inv(theta[F].reshape(3, 3)).T
    attitudes = np.array([_align(force, theta[REFERENCE]) for force in forces])
    return replace(
        placed,
        readings=np.concatenate([placed.readings, unplaced]),
        variances=np.concatenate([placed.variances, variances]),
        attitudes=np.concatenate([placed.attitudes, attitudes]),
        v_bar=np.concatenate([placed.v_bar, np.zeros_like(unplaced)]),
        attitude_std_rad=np.concatenate([placed.attitude_std_rad, np.full(len(unplaced), UNKNOWN_ATTITUDE_STD_RAD)]),
    )


def _align(force: Array, reference: Array) -> Array:
    """Return the smallest rotation (3, 3), body to table, from a force (3,) to the direction of the reference."""
    from scipy.spatial.transform import Rotation

    one, other = (vector / np.linalg.norm(vector) for vector in (force, reference))
    axis, cosine = np.cross(one, other), float(one @ other)
    sine = float(np.linalg.norm(axis))
    if sine < 1e-9:
        axis, sine = np.cross(one, np.eye(3)[np.argmin(np.abs(one))]), 1.0
        axis /= np.linalg.norm(axis)
        return np.asarray(Rotation.from_rotvec(axis * (0.0 if cosine > 0 else np.pi)).as_matrix(), dtype=np.float64)
    return np.asarray(Rotation.from_rotvec(axis / sine * np.arctan2(sine, cosine)).as_matrix(), dtype=np.float64)
