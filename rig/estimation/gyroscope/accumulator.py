"""The normal equations of six or more averaged revolutions, and their solution with its covariance."""

from dataclasses import dataclass
from typing import Literal, Self

import numpy as np
from numpy.typing import ArrayLike

from rig.estimation.arrays import Array
from rig.estimation.gyroscope.six_observation import (
    design,
    extract_parameters,
    rank_deficient,
    solve_by_algorithm_1,
    solve_by_newton,
    solve_linear,
)
from rig.estimation.refusals import check_count, check_revolutions, check_unit

SixObservationEstimator = Literal["newton", "algorithm_1"]

# Six sweeps over all directions stay below 25 for scale factors from 0.5 to 2, 20° of mounting error and any bias; with
# one direction missing, the noise alone keeps the number finite, usually at hundreds.
MAX_CONDITION = 30.0


@dataclass(frozen=True, slots=True)
class Solution:
    """Scale factors (3,) and biases (3,) in rad/s of the six-observation model, with their covariance.

    - `covariance` (6, 6): in the order kx ky kz bx by bz, in units of 1, rad/s and (rad/s)².
    - `rank` and `condition`: of the scaled design.
    - `iterations`: Newton steps, or passes of Algorithm 1.
    """

    estimator: SixObservationEstimator
    scale: Array
    bias_rad_s: Array
    covariance: Array
    observations: int
    rank: int
    condition: float
    iterations: int


@dataclass(frozen=True, slots=True)
class Accumulator:
    """Weighted normal equations of any number of revolutions, in constant memory.

    With x̃ = [x 1], x = [mx² my² mz² mx my mz], a mean reading m, its variance v, the speed ω and a weight w:

    - `geometry` (7, 7) = Σ x̃ᵀx̃: the geometry of the sweeps, regardless of their noise.
    - `normal` (7, 7) = Σ w x̃ᵀx̃, `right` (7,) = Σ w ω² x̃.
    - `moments` (3, 3, 7, 7) = Σ w² v_j m_j^a x̃ᵀx̃ for axis j and a = 0, 1, 2. The variance of ω² − ‖K(m + b)‖² is Σ_j
      4 k_j⁴ (m_j + b_j)² v_j; the scale factors k and biases b are known only after the solution.
    - `speed_noise` (7, 7) = Σ w² (2 ω σ_ω)² x̃ᵀx̃.
    """

    geometry: Array
    normal: Array
    right: Array
    moments: Array
    speed_noise: Array
    count: int

    @classmethod
    def empty(cls) -> Self:
        """Return the sums before the first revolution."""
        return cls(np.zeros((7, 7)), np.zeros((7, 7)), np.zeros(7), np.zeros((3, 3, 7, 7)), np.zeros((7, 7)), 0)

    def add(
        self,
        mean_rad_s: ArrayLike,
        variance_rad2_s2: ArrayLike,
        speed_rad_s: float,
        speed_std_rad_s: float = 0.0,
        weight: float | None = None,
    ) -> Self:
        """Return the sums with one more revolution.

        `mean_rad_s` (3,) is the revolution's mean reading, with the variance `variance_rad2_s2` (3,); `speed_rad_s` is
        its mean speed 2π/T, with the standard deviation `speed_std_rad_s`. The default `weight` is the inverse variance
        of ω² − ‖m + b‖² for unit scale factors and equal noise on all axes; all weights of the paper SIX are 1. Raise
        Fault `not_finite`, `bad_speed`, `zero_reading`, `bad_variance`.
        """
        mean = np.asarray(mean_rad_s, dtype=np.float64)
        variance = np.asarray(variance_rad2_s2, dtype=np.float64)
        speed, speed_std = np.array([speed_rad_s], dtype=np.float64), np.array([speed_std_rad_s], dtype=np.float64)
        check_revolutions(mean[None], speed, variance[None], speed_std)
        by_speed = (2 * speed_rad_s * speed_std_rad_s) ** 2
        w = 1 / (4 * speed_rad_s**2 * float(variance.mean()) + by_speed) if weight is None else weight
        row = np.append(design(mean), 1.0)
        square = np.outer(row, row)
        powers = variance[:, None] * mean[:, None] ** np.arange(3)
        return type(self)(
            self.geometry + square,
            self.normal + w * square,
            self.right + w * speed_rad_s**2 * row,
            self.moments + w**2 * powers[:, :, None, None] * square,
            self.speed_noise + w**2 * by_speed * square,
            self.count + 1,
        )

    def solve(self, estimator: SixObservationEstimator = "newton") -> Solution:
        """Return scale factors and biases with their covariance.

        `newton` subtracts the mean of all readings first, because otherwise the design of the paper's Eq. (7) is
        singular if the scaled bias is as large as the speed. `algorithm_1` is as published, without that. Raise Fault
        `too_few_observations`, `rank_deficient`, `negative_square`, `algorithm_1_diverged`, `wrong_unit`.
        """
        check_count(self.count, 6, 6)
        centre = self.geometry[6, 3:6] / self.count
        rank, condition, weakest_axis = self._condition(_translation(centre))
        if rank < 6:
            raise rank_deficient("xyz"[weakest_axis])
        if estimator == "algorithm_1":
            centre = np.zeros(3)
        translation = _translation(centre)
        normal, right = translation @ self.normal @ translation.T, translation @ self.right
        both_sides = np.stack([right[:6], normal[:6, 6]], axis=1)
        p, q = solve_linear(normal[:6, :6], both_sides).T
        if estimator == "newton":
            beta, iterations = solve_by_newton(p, q, float(right[6] / normal[6, 6]))
        else:
            beta, iterations = solve_by_algorithm_1(p, q)
        scale, bias = extract_parameters(beta)
        check_unit(scale)
        covariance = self._covariance(scale, bias, centre)
        return Solution(estimator, scale, bias - centre, covariance, self.count, rank, condition, iterations)

    def _condition(self, translation: Array) -> tuple[int, float, int]:
        """Return rank and condition number of the design after a translation, and its weakest axis (0–2).

        Readings are scaled by their RMS length first, so that squares and linear terms become comparable, and an axis
        without signal stays small. The rank counts the singular values above the largest / MAX_CONDITION.
        """
        normal = translation @ self.geometry @ translation.T
        length = np.sqrt(np.trace(normal[3:6, 3:6]) / self.count)
        unit = np.repeat([length**-2, length**-1], 3)
        values, vectors = np.linalg.eigh(normal[:6, :6] * np.outer(unit, unit))
        singular = np.sqrt(np.maximum(values, 0.0))
        weakest = vectors[:, 0] ** 2
        rank = int(np.sum(singular * MAX_CONDITION > singular[-1]))
        condition = float(singular[-1] / singular[0]) if singular[0] > 0 else float("inf")
        return rank, condition, int(np.argmax(weakest[:3] + weakest[3:]))

    def _covariance(self, scale: Array, bias: Array, centre: Array) -> Array:
        """Return the covariance (6, 6) of scale and bias, to first order in the errors e of the equations.

        β of `six_observation` changes by δβ = (XᵀW X + XᵀW 1 ∂Γ/∂β)⁻¹ XᵀW e. X has the rows x, W the weights, 1 is a
        column of ones, and Γ(β) = β0. Scale and bias follow from β. `bias` (3,) is that of the readings minus `centre`
        (3,); the covariance does not depend on the centre.
        """
        translation = _translation(centre)[:6]
        powers = np.stack([(bias - centre) ** 2, 2 * (bias - centre), np.ones(3)], axis=1) * 4 * scale[:, None] ** 4
        noise = translation @ (np.einsum("ja,jakl->kl", powers, self.moments) + self.speed_noise) @ translation.T
        gamma_by_beta = np.concatenate([-(bias**2), bias])
        normal = translation @ self.normal
        to_beta = np.linalg.inv(normal @ translation.T + np.outer(normal[:, 6], gamma_by_beta))
        squares, linear = np.arange(3), np.arange(3, 6)
        to_parameters = np.zeros((6, 6))
        to_parameters[squares, squares] = 1 / (2 * scale)
        to_parameters[linear, squares] = -bias / scale**2
        to_parameters[linear, linear] = 1 / (2 * scale**2)
        chain = to_parameters @ to_beta
        covariance: Array = np.asarray(chain @ noise @ chain.T, dtype=np.float64)
        return covariance


def _translation(centre: Array) -> Array:
    """Return the matrix (7, 7) that maps x̃(m) = [m² m 1] to x̃(m − c), by (m − c)² = m² − 2 c m + c²."""
    translation = np.eye(7)
    axes = np.arange(3)
    translation[axes, axes + 3] = -2 * centre
    translation[:3, 6] = centre**2
    translation[3:6, 6] = -centre
    return translation
