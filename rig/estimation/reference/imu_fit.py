"""The maximum likelihood estimate of θ of `rig.estimation.reference.accelerometer_model`, and its information."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np

from rig.estimation.arrays import Array
from rig.estimation.reference.accelerometer_errors import AccelerometerErrors
from rig.estimation.reference.accelerometer_model import (
    DELAY,
    LEVER,
    PARAMETERS,
    SECOND,
    Movement,
    combine_effects,
    effects,
    jacobian,
    predicted,
    split_effects,
)
from rig.estimation.reference.attitude_error import CONVERGED_CHANGE_RATIO, MAX_ITERATIONS
from rig.estimation.reference.reading_errors import noise, select_sweeps, unit_walk
from rig.estimation.reference.reference_model import REFERENCE, STEP_LIMIT, STEP_TOLERANCE, free_directions
from rig.estimation.reference.shared_errors import Decorrelation, decorrelate, estimate_common_error
from rig.estimation.statistics.expected_variances import ResidualInputs, estimate_disturbances, estimate_variances

DISTURBANCE_ODDS = 1 / 19  # prior: one dwell or sweep is disturbed, or all sweeps have another bias, against neither


@dataclass(frozen=True, slots=True)
class Fit:
    """A fit: parameters `theta` (22,), attitude error `std_rad`, and Jacobian (3 K, q) in `free` directions (22, q)."""

    theta: Array
    readings: Decorrelation
    jacobian: Array
    free: Array
    std_rad: float
    iterations: int

    def covariance(self) -> Array:
        """Return the covariance (22, 22) of the parameters from the Fisher information."""
        return np.asarray(self.free @ self._inverse() @ self.free.T, dtype=np.float64)

    def response(self) -> Array:
        """Return the derivative (22, 3 K) of the parameters with respect to the readings."""
        whitener = self.readings.whitener(self.std_rad)
        return np.asarray(self.free @ self._inverse() @ (whitener @ self.jacobian).T @ whitener, dtype=np.float64)

    def _inverse(self) -> Array:
        """Return the inverse (q, q) of the Fisher information."""
        weighted = self.readings.whitener(self.std_rad) @ self.jacobian
        size = np.linalg.norm(weighted, axis=0)
        inverse: Array = np.linalg.inv((weighted / size).T @ (weighted / size)) / np.outer(size, size)
        return inverse


def covariance_bound(
    theta: Array, movement: Movement, attitude_std_rad: float, *, second_order: bool = False
) -> tuple[Array, Array]:
    """Return the Cramér–Rao bound (22, 22) of the parameters, and their derivatives (22, 3 K) with respect to readings.

    `theta` (22,) and `attitude_std_rad` are the true values. Both results depend on movement and noise, not on the
    readings.
    """
    free = find_free_directions(theta, list_fixed(movement, second_order=second_order))
    readings = decorrelate(noise(theta, movement), effects(theta, movement))
    fit = Fit(theta, readings, jacobian(theta, movement) @ free, free, attitude_std_rad, 0)
    return fit.covariance(), fit.response()


def slopes(theta: Array, movement: Movement, *, second_order: bool) -> Array:
    """Return the derivative (3 K, q) of the readings in the free directions of the parameters `theta` (22,)."""
    return np.asarray(
        jacobian(theta, movement) @ find_free_directions(theta, list_fixed(movement, second_order=second_order))
    )


def most_likely(start: Array, movement: Movement, fixed: list[int], attitude_std_rad: float | None) -> Fit:
    """Return the most likely parameters and attitude error, by alternating steps from `start` (22,) until convergence.

    `fixed`: indices of parameters that keep their value. `attitude_std_rad`: the attitude error if it is given.
    """
    theta, steps = start, 0
    delta, last = attitude_std_rad or 0.0, np.inf
    readings = decorrelate(noise(theta, movement), effects(theta, movement))
    for _ in range(MAX_ITERATIONS):
        theta, iterations = _least_squares(theta, movement, fixed, readings.whitener(delta))
        steps += iterations
        if attitude_std_rad is not None or abs(delta - last) <= CONVERGED_CHANGE_RATIO * delta:
            break
        slopes = jacobian(theta, movement) @ find_free_directions(theta, fixed)
        residuals = (movement.readings() - predicted(theta, movement)).ravel()
        readings = decorrelate(noise(theta, movement), effects(theta, movement))
        last, delta = delta, estimate_common_error(readings, residuals, slopes)
    free = find_free_directions(theta, fixed)
    return Fit(theta, readings, jacobian(theta, movement) @ free, free, delta, steps)


def _least_squares(theta: Array, movement: Movement, fixed: list[int], whitener: Array) -> tuple[Array, int]:
    """Return the least-squares parameters by Gauss–Newton steps from `theta`, and the number of steps."""
    readings, norm = movement.readings(), np.linalg.norm(theta[REFERENCE])
    rounding = 1e-13 * float(np.linalg.norm(whitener @ readings.ravel()))
    steps, moved = 0, np.inf
    while steps < STEP_LIMIT and moved > STEP_TOLERANCE + rounding:
        free = find_free_directions(theta, fixed)
        slopes = whitener @ jacobian(theta, movement) @ free
        size = sizes_of(slopes)
        residuals = whitener @ (readings - predicted(theta, movement)).ravel()
        step = np.linalg.lstsq(slopes / size, residuals)[0]
        theta = theta + free @ (step / size)
        theta[REFERENCE] *= norm / np.linalg.norm(theta[REFERENCE])
        steps, moved = steps + 1, float(np.linalg.norm(step))
    return theta, steps


def refit_with_components(
    fit: Fit, movement: Movement, sensor: AccelerometerErrors, fixed: list[int], independent_fractions: Sequence[float]
) -> tuple[Movement, Fit]:
    """Return the movement with variance components estimated from the residuals of `fit`, and the fit with these."""
    residuals = (movement.readings() - predicted(fit.theta, movement)).ravel()
    modelled, variances = noise(fit.theta, movement), np.diag(movement.noise())
    of_arm = partial(combine_effects, *split_effects(fit.theta, movement))
    scattered = ResidualInputs(residuals, fit.jacobian, modelled, of_arm, unit_walk(sensor, movement), variances)
    components = estimate_variances(scattered, independent_fractions)
    unit = float(np.sqrt(np.median(variances)))
    separate = [np.diag(np.sqrt(variances))[:, segment] for segment in movement.segments()]
    causes = [*separate, unit * select_sweeps(movement)]
    odds = [*np.full(len(separate), DISTURBANCE_ODDS / len(separate)), DISTURBANCE_ODDS]
    *louder, turning = estimate_disturbances(scattered, components, causes, odds)
    disturbed = replace(
        sensor, walk_m_s2_sqrt_s=components.walk, louder=np.array(louder), turning_m_s2=float(np.sqrt(turning)) * unit
    )
    movement = replace(movement, sensor_errors=disturbed, independent_fraction=components.independent_fraction)
    refit = most_likely(fit.theta, movement, fixed, components.std_rad)
    readings = decorrelate(noise(refit.theta, movement), effects(refit.theta, movement))
    return movement, replace(refit, readings=readings, iterations=fit.iterations + refit.iterations)


def list_fixed(movement: Movement, *, second_order: bool) -> list[int]:
    """Return the indices, among the 22 parameters, of those that are not estimated."""
    fixed = [] if second_order else list(range(PARAMETERS))[SECOND]
    return fixed if len(movement.sweeps.speeds_rad_s) else [*range(LEVER.start, LEVER.stop), DELAY, *fixed]


def find_free_directions(theta: Array, fixed: list[int]) -> Array:
    """Return the free directions (22, q) of `theta`, which change neither v_ref's norm nor the `fixed` elements."""
    directions = free_directions(theta, norm_known=True)
    free: Array = np.delete(directions, [index - 1 for index in fixed], axis=1)  # v_ref has one column fewer
    return free


def sizes_of(columns: Array) -> Array:
    """Return the norms of columns (q,); 1 for a column of zeros."""
    sizes: Array = np.linalg.norm(columns, axis=0)
    return np.where(sizes > 0, sizes, 1.0)
