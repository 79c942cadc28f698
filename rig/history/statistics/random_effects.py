"""A random-effects linear model: results with stated uncertainties and additional scatter between runs."""

from dataclasses import dataclass

import numpy as np

from rig.estimation.arrays import Array

CONFIDENCE = 0.95


@dataclass(frozen=True, slots=True)
class FittedModel:
    """The coefficients (p,) of a fitted model, and their covariance (p, p).

    `between_std` is the standard deviation of the scatter that the values' stated stds do not explain. `dof` is the
    number of values minus the number of coefficients.
    """

    coefficients: Array
    covariance: Array
    between_std: float
    dof: int

    @property
    def std(self) -> Array:
        """The standard deviations (p,) of the coefficients."""
        return np.sqrt(np.diag(self.covariance))

    @property
    def coverage_factor(self) -> float:
        """Student's t for 95 %."""
        from scipy.special import stdtrit

        return float(stdtrit(self.dof, (1 + CONFIDENCE) / 2))

    def p_value(self, index: int) -> float:
        """Return the probability that an estimate lies as far from 0 as coefficient `index` if the true value is 0."""
        from scipy.special import stdtr

        return float(2 * stdtr(self.dof, -abs(self.coefficients[index]) / self.std[index]))

    def predict(self, row: Array) -> tuple[Array, Array]:
        """Return the model's value and its std at rows (…, p) of a design."""
        value: Array = row @ self.coefficients
        variance: Array = np.einsum("...i,ij,...j->...", row, self.covariance, row)
        return value, np.sqrt(variance)


def fit(design: Array, values: Array, std: Array) -> FittedModel:
    """Return the weighted least-squares fit of values (n,) with stds (n,) to a design (n, p) of full rank, n > p.

    The variance between runs is DerSimonian and Laird's moment estimate (Control. Clin. Trials 7 (1986) 177), for any
    design as in a meta-regression. The covariance is Knapp and Hartung's (Stat. Med. 22 (2003) 2693), which with
    Student's t is also valid for few runs; it is never below the covariance that follows from the stated stds. Raise
    ValueError for n ≤ p.
    """
    n, p = design.shape
    if n <= p:
        raise ValueError(f"{n} values do not determine {p} coefficients and a scatter")
    fixed = 1 / std**2
    residuals = values - design @ _solve(design, values, fixed)
    # For weights W the expectation of Q = Σ w r² is n − p + τ² (ΣW − tr[(XᵀWX)⁻¹ XᵀW²X]).
    squares = np.linalg.solve((design.T * fixed) @ design, (design.T * fixed**2) @ design)
    excess = float(fixed @ residuals**2) - (n - p)
    between_variance = max(0.0, excess / float(fixed.sum() - np.trace(squares)))
    weights = 1 / (std**2 + between_variance)
    coefficients = _solve(design, values, weights)
    residuals = values - design @ coefficients
    scatter = max(1.0, float(weights @ residuals**2) / (n - p))
    covariance = np.asarray(scatter * np.linalg.inv((design.T * weights) @ design), dtype=np.float64)
    return FittedModel(coefficients, covariance, float(np.sqrt(between_variance)), n - p)


def _solve(design: Array, values: Array, weights: Array) -> Array:
    root = np.sqrt(weights)
    coefficients = np.linalg.lstsq(design * root[:, None], values * root, rcond=None)[0]
    return np.asarray(coefficients, dtype=np.float64)
