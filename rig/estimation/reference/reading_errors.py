"""The errors of readings other than the arm's attitude errors: noise, repeatability, the sensor's own errors.

All are zero on average with prior variances, so they are part of the readings' covariance. They are predicted together
with θ, whose uncertainty includes their undetermined part (Henderson, Biometrics 31 (1975) 423).
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from rig.estimation.arrays import Array
from rig.estimation.reference.accelerometer_errors import AccelerometerErrors
from rig.estimation.reference.accelerometer_model import (
    OWN_ERRORS,
    ROTATIONS,
    SHARED_ERRORS,
    SIZE_RATIO,
    Movement,
    arm_effects,
    find_force,
)
from rig.estimation.reference.reference_model import matrix
from rig.estimation.statistics.bias_process import flicker_covariance, flicker_harmonic_covariance, walk_covariance

ANGLES_PER_REVOLUTION = 72  # at which nonlinear functions of the acceleration are averaged


def noise(theta: Array, movement: Movement) -> Array:
    """Return the covariance (3 K, 3 K) of the readings from all errors except the arm's attitude errors."""
    covariance = (
        movement.noise() + _repeatability(theta, movement) + bias_flicker(movement) + find_drift_covariance(movement)
    )
    for patterns in (nonlinearity_patterns(theta, movement), bias_warming(movement), scale_warming(theta, movement)):
        covariance += patterns.T @ patterns
    return np.asarray(covariance, dtype=np.float64)


def nonlinearity_patterns(theta: Array, movement: Movement) -> Array:
    """Return the effects (P, 3 K) on the readings of one standard uncertainty of each axis' nonlinearity.

    The first three rows are for the quadratic, the next three for the cubic nonlinearity of `accelerometer_errors`.
    Either three are left out if the nonlinearity has no effect or no uncertainty.
    """
    sensor = movement.sensor_errors
    if sensor is None:
        return np.zeros((0, movement.readings().size))
    odd = project_errors(theta, movement, lambda force: force**3 - sensor.norm_m_s2**2 * force)
    even = project_errors(theta, movement, np.square)
    return np.concatenate(
        [pattern for pattern in (sensor.even_s2_m * even.T, sensor.odd_s4_m2 * odd.T) if pattern.any()] or [odd.T[:0]]
    )


def bias_warming(movement: Movement) -> Array:
    """Return the readings' errors (6, 3 K) due to one standard uncertainty of each bias's temperature coefficient.

    Three rows are for the recorded temperature, three for changes smaller than a step of the thermometer.
    """
    sensor = movement.sensor_errors
    if sensor is None:
        return np.zeros((0, movement.readings().size))
    return sensor.bias_m_s2_k * np.concatenate(
        [per_axis((movement.constant() * warmer_k)[:, None] * np.ones(3)).T for warmer_k in _warmer_k(sensor, movement)]
    )


def scale_warming(theta: Array, movement: Movement) -> Array:
    """Return how the temperature coefficients of the scales change all readings (6, 3 K) of K segments.

    Each row is the effect of one standard uncertainty of one axis's coefficient: three rows for the recorded
    temperature, three for temperature changes smaller than a step of the thermometer.
    """
    sensor = movement.sensor_errors
    if sensor is None:
        return np.zeros((0, movement.readings().size))
    forces = find_force(theta, movement) @ matrix(theta).T
    return sensor.scale_per_k * np.concatenate(
        [per_axis(forces * warmer_k[:, None]).T for warmer_k in _warmer_k(sensor, movement)]
    )


def _warmer_k(sensor: AccelerometerErrors, movement: Movement) -> tuple[Array, Array]:
    """Return two deviations (K,) from the mean temperature, K: the recorded ones, and those that rounding hides."""
    return repeat_by_segment(sensor.warmer_k, movement), repeat_by_segment(sensor.unseen_k, movement)


def bias_flicker(movement: Movement) -> Array:
    """Return the covariance (3 K, 3 K) of the bias's stated flicker."""
    sensor = movement.sensor_errors
    if sensor is None or not sensor.instability_m_s2:
        return np.zeros((movement.readings().size,) * 2)
    covariance = _expand_bias(flicker_covariance(sensor.windows_s), movement)
    for sweep in movement.segments()[len(movement.dwells.readings_m_s2) :]:
        covariance[sweep, sweep] += np.kron(flicker_harmonic_covariance(), np.eye(3))
    return sensor.instability_m_s2**2 * covariance


def find_drift_covariance(movement: Movement) -> Array:
    """Return the covariance (3 K, 3 K) of readings due to what the residuals show beyond noise.

    That is a random walk of the bias, extra noise of disturbed segments, and another bias in sweeps than in dwells.
    """
    sensor, covariance = movement.sensor_errors, np.zeros((movement.readings().size,) * 2)
    if sensor is not None and sensor.walk_m_s2_sqrt_s:
        covariance += sensor.walk_m_s2_sqrt_s**2 * unit_walk(sensor, movement)
    if sensor is not None and sensor.louder is not None:
        covariance += np.diag(np.repeat(repeat_by_segment(sensor.louder, movement), 3) * np.diag(movement.noise()))
        turning = sensor.turning_m_s2 * select_sweeps(movement)
        covariance += turning @ turning.T
    return covariance


def unit_walk(sensor: AccelerometerErrors, movement: Movement) -> Array:
    """Return the covariance (3 K, 3 K) of a random walk of each axis' bias whose std after one second is 1 m/s²."""
    return _expand_bias(walk_covariance(sensor.windows_s), movement)


def _expand_bias(covariance: Array, movement: Movement) -> Array:
    """Return the covariance (3 K, 3 K) of readings due to biases of `covariance` (N + M, N + M) on each axis alone."""
    steady = movement.constant() > 0
    expanded = np.zeros((len(steady),) * 2)
    expanded[np.ix_(steady, steady)] = covariance
    return np.asarray(np.kron(expanded, np.eye(3)), dtype=np.float64)


def select_sweeps(movement: Movement) -> Array:
    """Return the readings (3 K, 3) due to a unit bias of each axis in sweeps alone, not in dwells."""
    turning = movement.constant()
    turning[: len(movement.dwells.readings_m_s2)] = 0.0
    return per_axis(turning[:, None] * np.ones(3))


def repeat_by_segment(values: Array, movement: Movement) -> Array:
    """Return `values` (N + M,) of N dwells, then M sweeps, with each sweep's value three times (N + 3 M,).

    A sweep has three readings of each axis: mean, cosine and sine.
    """
    dwells = len(movement.dwells.readings_m_s2)
    return np.concatenate([values[:dwells], np.repeat(values[dwells:], 3)])


def per_axis(columns: Array) -> Array:
    """Return the effects (3 K, 3) on all readings of an error on each axis; `columns` (K, 3): those on its own axis."""
    return np.asarray((columns[:, :, None] * np.eye(3)).reshape(-1, 3), dtype=np.float64)


def project_errors(theta: Array, movement: Movement, change: Callable[[Array], Array]) -> Array:
    """Return the effects (3 K, 3), on the readings, of an error of one axis that depends on the force along this axis.

    `change` returns the error for forces of any shape. In sweeps the effects are mean, cosine and sine of the error.
    """
    dwells, axes = len(movement.dwells.readings_m_s2), matrix(theta)
    felt_along = find_force(theta, movement) @ (axes / np.linalg.norm(axes, axis=1, keepdims=True)).T
    mean, cos, sin = np.moveaxis(felt_along[dwells:].reshape(-1, 3, 3), 1, 0)
    angle = 2 * np.pi * np.arange(ANGLES_PER_REVOLUTION)[:, None, None] / ANGLES_PER_REVOLUTION
    turning = change(mean + cos * np.cos(angle) + sin * np.sin(angle))
    waves = [turning.mean(axis=0), *(2 * (turning * wave(angle)).mean(axis=0) for wave in (np.cos, np.sin))]
    return per_axis(np.concatenate([change(felt_along[:dwells]), np.stack(waves, axis=1).reshape(-1, 3)]))


def _repeatability(theta: Array, movement: Movement) -> Array:
    """Return the covariance (3 K, 3 K) due to small rotations of sweeps, independent for each sweep."""
    sweeps = movement.sweeps
    if movement.repeatability_rad == 0.0:
        return np.zeros((movement.readings().size,) * 2)
    rotations = arm_effects(theta, replace(movement, sweeps=sweeps.alone()))[
        :, OWN_ERRORS * len(movement.dwells.readings_m_s2) :
    ]
    turns = rotations[:, np.arange(rotations.shape[1]) % SHARED_ERRORS < ROTATIONS] * (
        movement.repeatability_rad / SIZE_RATIO
    )
    return np.asarray(turns @ turns.T, dtype=np.float64)
