"""The most likely θ of `rig.estimation.reference.accelerometer_model`, and how well the readings tell it."""

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
    effects,
    jacobian,
    new_and_always,
    predicted,
    shared_out,
)
from rig.estimation.reference.attitude_error import PASSES, SETTLED
from rig.estimation.reference.reading_errors import in_sweeps, noise, walking
from rig.estimation.reference.reference_model import REFERENCE, STEP_LIMIT, STEP_TOLERANCE, free_directions
from rig.estimation.reference.shared_errors import Apart, apart, likeliest_error
from rig.estimation.statistics.expected_sizes import Scattered, expected_disturbances, expected_sizes

# Of one disturbed dwell or sweep in a run against none, and of another bias in all sweeps, before the readings say so.
ODDS = 1 / 19


@dataclass(frozen=True, slots=True)
class Fit:
    """θ (22,), how readings are told apart, J (3 K, q) of what is free, its directions (22, q), δ, and the steps."""

    theta: Array
    readings: Apart
    jacobian: Array
    free: Array
    std_rad: float
    iterations: int

    def covariance(self) -> Array:
        """(22, 22) covariance of θ by the Fisher information."""
        return np.asarray(self.free @ self._inverse() @ self.free.T, dtype=np.float64)

    def response(self) -> Array:
        """(22, 3 K): how θ changes with the readings."""
        white = self.readings.white(self.std_rad)
        return np.asarray(self.free @ self._inverse() @ (white @ self.jacobian).T @ white, dtype=np.float64)

    def _inverse(self) -> Array:
        """(q, q) inverse of the Fisher information."""
        weighted = self.readings.white(self.std_rad) @ self.jacobian
        size = np.linalg.norm(weighted, axis=0)
        inverse: Array = np.linalg.inv((weighted / size).T @ (weighted / size)) / np.outer(size, size)
        return inverse


def covariance_bound(
    theta: Array, movement: Movement, attitude_std_rad: float, *, second_order: bool = False
) -> tuple[Array, Array]:
    """(22, 22) Cramér–Rao bound at the true θ (22,) and δ, for movement and noise as given, and (22, 3 K) the response.

    The readings themselves do not matter.
    """
    free = free_ways(theta, held_still(movement, second_order=second_order))
    readings = apart(noise(theta, movement), effects(theta, movement))
    fit = Fit(theta, readings, jacobian(theta, movement) @ free, free, attitude_std_rad, 0)
    return fit.covariance(), fit.response()


def slopes(theta: Array, movement: Movement, *, second_order: bool) -> Array:
    """(3 K, q) derivative of the readings in the ways θ (22,) may move."""
    return np.asarray(jacobian(theta, movement) @ free_ways(theta, held_still(movement, second_order=second_order)))


def most_likely(start: Array, movement: Movement, held: list[int], attitude_std_rad: float | None) -> Fit:
    """The most likely θ and δ from `start` (22,), alternately, until δ stands still; `held` elements of θ stay."""
    theta, steps = start, 0
    delta, last = attitude_std_rad or 0.0, np.inf
    readings = apart(noise(theta, movement), effects(theta, movement))
    for _ in range(PASSES):
        theta, taken = _least_squares(theta, movement, held, readings.white(delta))
        steps += taken
        if attitude_std_rad is not None or abs(delta - last) <= SETTLED * delta:
            break
        slopes = jacobian(theta, movement) @ free_ways(theta, held)
        residuals = (movement.readings() - predicted(theta, movement)).ravel()
        readings = apart(noise(theta, movement), effects(theta, movement))
        last, delta = delta, likeliest_error(readings, residuals, slopes)
    free = free_ways(theta, held)
    return Fit(theta, readings, jacobian(theta, movement) @ free, free, delta, steps)


def _least_squares(theta: Array, movement: Movement, held: list[int], white: Array) -> tuple[Array, int]:
    """θ by Gauss–Newton, and the steps it took."""
    readings, norm = movement.readings(), np.linalg.norm(theta[REFERENCE])
    rounding = 1e-13 * float(np.linalg.norm(white @ readings.ravel()))
    steps, moved = 0, np.inf
    while steps < STEP_LIMIT and moved > STEP_TOLERANCE + rounding:
        free = free_ways(theta, held)
        slopes = white @ jacobian(theta, movement) @ free
        size = sizes_of(slopes)
        residuals = white @ (readings - predicted(theta, movement)).ravel()
        step = np.linalg.lstsq(slopes / size, residuals)[0]
        theta = theta + free @ (step / size)
        theta[REFERENCE] *= norm / np.linalg.norm(theta[REFERENCE])
        steps, moved = steps + 1, float(np.linalg.norm(step))
    return theta, steps


def as_expected(
    fit: Fit, movement: Movement, own: AccelerometerErrors, held: list[int], own_shares: Sequence[float]
) -> tuple[Movement, Fit]:
    """Movement and fit with the sizes to be expected by what the fit leaves, and disturbances."""
    left = (movement.readings() - predicted(fit.theta, movement)).ravel()
    known, alike = noise(fit.theta, movement), np.diag(movement.noise())
    of_arm = partial(shared_out, *new_and_always(fit.theta, movement))
    scattered = Scattered(left, fit.jacobian, known, of_arm, walking(own, movement), alike)
    sizes = expected_sizes(scattered, own_shares)
    unit = float(np.sqrt(np.median(alike)))
    alone = [np.diag(np.sqrt(alike))[:, piece] for piece in movement.pieces()]
    causes = [*alone, unit * in_sweeps(movement)]
    odds = [*np.full(len(alone), ODDS / len(alone)), ODDS]
    *louder, turning = expected_disturbances(scattered, sizes, causes, odds)
    disturbed = replace(
        own, walk_m_s2_sqrt_s=sizes.walk, louder=np.array(louder), turning_m_s2=float(np.sqrt(turning)) * unit
    )
    movement = replace(movement, own=disturbed, own_share=sizes.own_share)
    found = most_likely(fit.theta, movement, held, sizes.std_rad)
    readings = apart(noise(found.theta, movement), effects(found.theta, movement))
    return movement, replace(found, readings=readings, iterations=fit.iterations + found.iterations)


def held_still(movement: Movement, *, second_order: bool) -> list[int]:
    """The elements of θ that are not looked for."""
    held = [] if second_order else list(range(PARAMETERS))[SECOND]
    return held if len(movement.sweeps.speeds_rad_s) else [*range(LEVER.start, LEVER.stop), DELAY, *held]


def free_ways(theta: Array, held: list[int]) -> Array:
    """(22, q) the ways θ may move: v_ref across itself, what is held not at all."""
    whole = free_directions(theta, norm_known=True)
    free: Array = np.delete(whole, [each - 1 for each in held], axis=1)  # one column of v_ref stands before them
    return free


def sizes_of(columns: Array) -> Array:
    """(q,) norms of columns; 1 for a column of zeros."""
    sizes: Array = np.linalg.norm(columns, axis=0)
    return np.where(sizes > 0, sizes, 1.0)
