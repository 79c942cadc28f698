"""Six or more averaged revolutions gathered into normal equations, and their solution with its covariance."""

from dataclasses import dataclass
from typing import Literal, Self

import numpy as np
from numpy.typing import ArrayLike

from rig.errors import Fault
from rig.estimation.six_observation import (
    Array,
    by_algorithm_1,
    by_newton,
    design,
    parameters,
    rank_deficient,
    solve_linear,
)

Estimator = Literal["newton", "algorithm_1"]

# Six sweeps over all directions stay below 140 even with a bias of three times the turn rate; with one direction
# missing, the noise alone keeps the number finite, at 700 and more.
MAX_CONDITION = 300.0


@dataclass(frozen=True, slots=True)
class Solution:
    """Scale factors (3,), biases (3,) in rad/s, and how they were found.

    `covariance` (6, 6) stands in the order kx ky kz bx by bz: its blocks are in 1, rad/s and (rad/s)². `rank` and
    `condition` are those of the scaled design; `iterations` counts Newton steps or passes of Algorithm 1.
    """

    estimator: Estimator
    scale: Array
    bias_rad_s: Array
    covariance: Array
    observations: int
    rank: int
    condition: float
    iterations: int


@dataclass(frozen=True, slots=True)
class Accumulator:
    """The weighted normal equations of any number of revolutions, in constant memory; add each as it comes.

    With x̃ = [x 1]: `normal` (7, 7) = Σ w x̃ᵀx̃, `right` (7,) = Σ w ω² x̃. `moments` (3, 3, 6, 6) = Σ w² v_j m_j^a xᵀx
    for axis j and a = 0, 1, 2: the covariance needs them, because the variance of ω² − ‖K(m + b)‖² is
    Σ_j 4 k_j⁴ (m_j + b_j)² v_j, and k and b are known only afterwards. `speed_noise` (6, 6) = Σ w² (2 ω σ_ω)² xᵀx.
    """

    normal: Array
    right: Array
    moments: Array
    speed_noise: Array
    count: int

    @classmethod
    def empty(cls) -> Self:
        """No revolution yet."""
        return cls(np.zeros((7, 7)), np.zeros(7), np.zeros((3, 3, 6, 6)), np.zeros((6, 6)), 0)

    def add(
        self,
        mean_rad_s: ArrayLike,
        variance_rad2_s2: ArrayLike,
        speed_rad_s: float,
        speed_std_rad_s: float = 0.0,
        weight: float | None = None,
    ) -> Self:
        """With one more revolution: mean reading (3,), variance of that mean (3,), mean speed 2π/T and its deviation.

        The weight is the inverse variance of ω² − ‖m + b‖² at k = 1, b = 0 unless given (1 is what SIX uses).
        Raises Fault `not_finite`, `bad_speed`, `zero_reading`, `bad_variance`.
        """
        mean = np.asarray(mean_rad_s, dtype=np.float64)
        variance = np.asarray(variance_rad2_s2, dtype=np.float64)
        _check(mean, variance, speed_rad_s)
        by_speed = (2 * speed_rad_s * speed_std_rad_s) ** 2
        w = 1 / (float(np.sum(4 * mean**2 * variance)) + by_speed) if weight is None else weight
        row = np.append(design(mean), 1.0)
        square = np.outer(row, row)
        powers = variance[:, None] * mean[:, None] ** np.arange(3)
        return type(self)(
            self.normal + w * square,
            self.right + w * speed_rad_s**2 * row,
            self.moments + w**2 * powers[:, :, None, None] * square[:6, :6],
            self.speed_noise + w**2 * by_speed * square[:6, :6],
            self.count + 1,
        )

    def combine(self, other: Self) -> Self:
        """As if all of both had been added to one."""
        return type(self)(
            self.normal + other.normal,
            self.right + other.right,
            self.moments + other.moments,
            self.speed_noise + other.speed_noise,
            self.count + other.count,
        )

    def solve(self, estimator: Estimator = "newton") -> Solution:
        """The parameters with their covariance.

        Raises Fault `too_few_observations`, `rank_deficient`, `negative_square`, `algorithm_1_diverged`.
        """
        if self.count < 6:
            raise Fault(
                "too_few_observations",
                f"{self.count} averaged revolutions are too few for six parameters",
                "Sweep every wrist in both directions; resume the run if it was interrupted",
            )
        rank, condition, weakest_axis = self._condition()
        if rank < 6:
            raise rank_deficient("xyz"[weakest_axis])
        both_sides = np.stack([self.right[:6], self.normal[:6, 6]], axis=1)
        p, q = solve_linear(self.normal[:6, :6], both_sides).T
        if estimator == "newton":
            beta, iterations = by_newton(p, q, float(self.right[6] / self.normal[6, 6]))
        else:
            beta, iterations = by_algorithm_1(p, q)
        scale, bias = parameters(beta)
        covariance = self._covariance(scale, bias)
        return Solution(estimator, scale, bias, covariance, self.count, rank, condition, iterations)

    def _condition(self) -> tuple[int, float, int]:
        """Rank and condition number of the design, and the axis (0–2) it knows least about.

        Readings are measured in their own RMS length first, so that squares and linear terms compare while an axis
        without signal stays small. Singular values below the largest / MAX_CONDITION do not count towards the rank.
        """
        length = np.sqrt(np.trace(self.normal[3:6, 3:6]) / self.normal[6, 6])
        unit = np.repeat([length**-2, length**-1], 3)
        values, vectors = np.linalg.eigh(self.normal[:6, :6] * np.outer(unit, unit))
        singular = np.sqrt(np.maximum(values, 0.0))
        weakest = vectors[:, 0] ** 2
        rank = int(np.sum(singular * MAX_CONDITION > singular[-1]))
        condition = float(singular[-1] / singular[0]) if singular[0] > 0 else float("inf")
        return rank, condition, int(np.argmax(weakest[:3] + weakest[3:]))

    def _covariance(self, scale: Array, bias: Array) -> Array:
        """(6, 6), to first order in the means' errors e: δβ = (XᵀW X + XᵀW 1 ∂Γ/∂β)⁻¹ XᵀW e, then k and b from β."""
        powers = np.stack([bias**2, 2 * bias, np.ones(3)], axis=1) * 4 * scale[:, None] ** 4
        noise = np.einsum("ja,jakl->kl", powers, self.moments) + self.speed_noise
        gamma_by_beta = np.concatenate([-(bias**2), bias])
        to_beta = np.linalg.inv(self.normal[:6, :6] + np.outer(self.normal[:6, 6], gamma_by_beta))
        squares, linear = np.arange(3), np.arange(3, 6)
        to_parameters = np.zeros((6, 6))
        to_parameters[squares, squares] = 1 / (2 * scale)
        to_parameters[linear, squares] = -bias / scale**2
        to_parameters[linear, linear] = 1 / (2 * scale**2)
        chain = to_parameters @ to_beta
        covariance: Array = np.asarray(chain @ noise @ chain.T, dtype=np.float64)
        return covariance


def _check(mean: Array, variance: Array, speed_rad_s: float) -> None:
    if mean.shape != (3,) or variance.shape != (3,):
        raise ValueError(f"mean and variance must be (3,), not {mean.shape} and {variance.shape}")
    if not np.isfinite([*mean, *variance, speed_rad_s]).all():
        raise Fault(
            "not_finite",
            "a revolution's mean reading, variance or speed is not a number",
            "Look at the samples of that sweep and record it again",
        )
    if speed_rad_s <= 0:
        raise Fault(
            "bad_speed",
            f"a revolution's speed is {speed_rad_s:g} rad/s",
            "Give the speed as positive; a rest is not a revolution",
        )
    if not mean.any():
        raise Fault(
            "zero_reading",
            "the gyroscope reads exactly zero during a revolution",
            "Check that the sensor is connected and awake",
        )
    if not (variance > 0).all():
        raise Fault(
            "bad_variance",
            "the variance of a mean reading is not positive",
            "Give the variance of each axis' mean in (rad/s)²",
        )
