"""What is off in readings beside the arm's attitudes: noise, the arm's repeatability, what the sensor itself adds.

All of it is zero on average and of known size, so it stands in the readings' covariance: found along with θ, and what
the readings do not tell of it left in θ's uncertainty (Henderson, Biometrics 31 (1975) 423).
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from rig.estimation.arrays import Array
from rig.estimation.reference.accelerometer_errors import AccelerometerErrors
from rig.estimation.reference.accelerometer_model import OWN_ERRORS, SHARE, SHARED_ERRORS, TURNS, Movement, felt, turned
from rig.estimation.reference.reference_model import matrix
from rig.estimation.statistics.bias_process import flicker_covariance, walk_covariance

ANGLES = 72  # of a turn, over which what is not linear in the acceleration is averaged


def noise(theta: Array, movement: Movement) -> Array:
    """(3 K, 3 K) covariance of all that is off in the readings but for the arm's attitudes."""
    whole = movement.noise() + _not_repeated(theta, movement) + flickering(movement) + wandering(movement)
    for patterns in (bending(theta, movement), bias_warming(movement), scale_warming(theta, movement)):
        whole += patterns.T @ patterns
    return np.asarray(whole, dtype=np.float64)


def bending(theta: Array, movement: Movement) -> Array:
    """(P, 3 K) patterns of φ and χ of each axis, by one standard uncertainty."""
    own = movement.own
    if own is None:
        return np.zeros((0, movement.readings().size))
    odd = of_sensor(theta, movement, lambda along: along**3 - own.norm_m_s2**2 * along)
    even = of_sensor(theta, movement, np.square)
    return np.concatenate(
        [each for each in (own.even_s2_m * even.T, own.odd_s4_m2 * odd.T) if each.any()] or [odd.T[:0]]
    )


def bias_warming(movement: Movement) -> Array:
    """(6, 3 K) patterns of β of each axis, by one standard uncertainty: as recorded, and what the steps hide."""
    own = movement.own
    if own is None:
        return np.zeros((0, movement.readings().size))
    return own.bias_m_s2_k * np.concatenate(
        [per_axis((movement.constant() * warmer_k)[:, None] * np.ones(3)).T for warmer_k in _warmer_k(own, movement)]
    )


def scale_warming(theta: Array, movement: Movement) -> Array:
    """(6, 3 K) patterns of κ of each axis, as those of β."""
    own = movement.own
    if own is None:
        return np.zeros((0, movement.readings().size))
    along = felt(theta, movement) @ matrix(theta).T
    return own.scale_per_k * np.concatenate(
        [per_axis(along * warmer_k[:, None]).T for warmer_k in _warmer_k(own, movement)]
    )


def _warmer_k(own: AccelerometerErrors, movement: Movement) -> tuple[Array, Array]:
    """How much warmer each piece was as recorded, and what the thermometer's steps may hide of it, both (K,)."""
    return of_pieces(own.warmer_k, movement), of_pieces(own.unseen_k, movement)


def flickering(movement: Movement) -> Array:
    """(3 K, 3 K) covariance of the flicker that the bias is known to have."""
    own = movement.own
    if own is None or not own.instability_m_s2:
        return np.zeros((movement.readings().size,) * 2)
    return own.instability_m_s2**2 * _of_bias(flicker_covariance(own.windows_s), movement)


def wandering(movement: Movement) -> Array:
    """(3 K, 3 K) covariance of what the readings themselves say of the bias: a walk, and what was disturbed."""
    own, whole = movement.own, np.zeros((movement.readings().size,) * 2)
    if own is not None and own.walk_m_s2_sqrt_s:
        whole += own.walk_m_s2_sqrt_s**2 * walking(own, movement)
    if own is not None and own.louder is not None:
        whole += np.diag(np.repeat(of_pieces(own.louder, movement), 3) * np.diag(movement.noise()))
        turning = own.turning_m_s2 * in_sweeps(movement)
        whole += turning @ turning.T
    return whole


def walking(own: AccelerometerErrors, movement: Movement) -> Array:
    """(3 K, 3 K) covariance of a bias that walks by 1 m/s² in a second, the axes each for itself."""
    return _of_bias(walk_covariance(own.windows_s), movement)


def _of_bias(covariance: Array, movement: Movement) -> Array:
    """(3 K, 3 K) covariance of a bias whose means in dwells and sweeps (N + M,) vary so, the axes each for itself."""
    steady = movement.constant() > 0
    whole = np.zeros((len(steady),) * 2)
    whole[np.ix_(steady, steady)] = covariance
    return np.asarray(np.kron(whole, np.eye(3)), dtype=np.float64)


def in_sweeps(movement: Movement) -> Array:
    """(3 K, 3) another bias of each axis in sweeps alone."""
    turning = movement.constant()
    turning[: len(movement.dwells.readings_m_s2)] = 0.0
    return per_axis(turning[:, None] * np.ones(3))


def of_pieces(values: Array, movement: Movement) -> Array:
    """(K,) values of dwells and sweeps (N + M,): mean, cosine and sine of a sweep the same."""
    dwells = len(movement.dwells.readings_m_s2)
    return np.concatenate([values[:dwells], np.repeat(values[dwells:], 3)])


def per_axis(columns: Array) -> Array:
    """(3 K, 3) columns made of (K, 3): each axis' own column, with a coefficient of its own."""
    return np.asarray((columns[:, :, None] * np.eye(3)).reshape(-1, 3), dtype=np.float64)


def of_sensor(theta: Array, movement: Movement, change: Callable[[Array], Array]) -> Array:
    """(3 K, 3) what an axis adds that reads `change` of the force along it: in a sweep, its first harmonic."""
    dwells, axes = len(movement.dwells.readings_m_s2), matrix(theta)
    felt_along = felt(theta, movement) @ (axes / np.linalg.norm(axes, axis=1, keepdims=True)).T
    mean, cos, sin = np.moveaxis(felt_along[dwells:].reshape(-1, 3, 3), 1, 0)
    angle = 2 * np.pi * np.arange(ANGLES)[:, None, None] / ANGLES
    turning = change(mean + cos * np.cos(angle) + sin * np.sin(angle))
    waves = [turning.mean(axis=0), *(2 * (turning * wave(angle)).mean(axis=0) for wave in (np.cos, np.sin))]
    return per_axis(np.concatenate([change(felt_along[:dwells]), np.stack(waves, axis=1).reshape(-1, 3)]))


def _not_repeated(theta: Array, movement: Movement) -> Array:
    """(3 K, 3 K) covariance of the small turns by which each sweep is off for itself."""
    sweeps = movement.sweeps
    if movement.repeatability_rad == 0.0:
        return np.zeros((movement.readings().size,) * 2)
    own = turned(theta, replace(movement, sweeps=sweeps.alone()))[:, OWN_ERRORS * len(movement.dwells.readings_m_s2) :]
    turns = own[:, np.arange(own.shape[1]) % SHARED_ERRORS < TURNS] * (movement.repeatability_rad / SHARE)
    return np.asarray(turns @ turns.T, dtype=np.float64)
