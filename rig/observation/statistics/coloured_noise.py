"""The variance of a mean with coloured residuals: similar neighbours raise the variance, a vibration lowers it."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rig.estimation.arrays import Array

LAGS = 20
WHITENESS_LIMIT = 45.3  # χ² of 20 degrees of freedom at 0.999
ORDERS = (1, 2, 4, 8, 16, 32)  # of the autoregression; 32 cover a whole wave of 7 Hz at 238 Hz
COEFFICIENT_SAMPLES = 12  # samples needed for each coefficient
MIN_UNPREDICTED = 1e-12  # fraction of the sum of squares; less remains if residuals repeat; then 1 − Σ a is as small


@dataclass(frozen=True, slots=True)
class VarianceInflation:
    """The `factor` that multiplies the variance of a mean of residuals, and the degrees of freedom of the product."""

    factor: float
    dof: float


def correlation_inflation(residuals: Array) -> float:
    """Return the factor, at least 1, by which correlations of residuals (n,) increase the variance of their mean.

    It is 1 + 2 Σ ρ, summed over the lags, with the correlation ρ at each lag. Return 1 unless the correlations are
    significant together (Box–Pierce), so that white noise is not inflated.
    """
    rho = _correlations(residuals)
    return 1.0 if rho is None else max(1.0, 1 + 2 * float(rho.sum()))


def fit_noise_factor(residuals: Array) -> float:
    """Return the variance of a mean of residuals (n,), relative to that of white noise, by an autoregressive model.

    The white noise has the same scatter. The result is below 1 if the residuals are mostly vibration. Over many periods
    a vibration averages out, but the sum of its estimated correlations does not show that. So the variance of a long
    mean is taken from the model's spectrum at zero frequency. This is var(e) / (1 − Σ a)², with the coefficients a and
    innovations e. Akaike's criterion selects the order.
    """
    return fit_autoregression(residuals).factor


def fit_autoregression(residuals: Array, memories: Sequence[int] = ORDERS) -> VarianceInflation:
    """Return the factor of `fit_noise_factor`, and the degrees of freedom of the resulting variance.

    `memories` are the orders to choose from. White residuals have n − 1 degrees of freedom, others 2 / v (JCGM 100,
    G.4.2). Here v is the relative variance of the spectrum at zero: 2/n from the innovations, plus
    4 var(Σ a) / (1 − Σ a)² from the coefficients a.
    """
    if _correlations(residuals) is None:
        return VarianceInflation(1.0, max(len(residuals) - 1.0, 1.0))
    centred = residuals - residuals.mean()
    memories = [memory for memory in memories if memory * COEFFICIENT_SAMPLES <= len(centred)]
    products, count = _products(centred, memories[-1]), len(centred) - memories[-1]
    criterion, spectrum_at_zero, memory = min(_autoregression(products, count, memory) for memory in memories)
    if np.isinf(criterion) and criterion > 0:
        return VarianceInflation(1.0, max(len(residuals) - 1.0, 1.0))
    return VarianceInflation(spectrum_at_zero / float(np.mean(centred**2)), _spectrum_dof(centred, memory))


def _spectrum_dof(centred: Array, memory: int) -> float:
    products, count = _products(centred, memory), len(centred) - memory
    coefficients, power = _predict(products)
    damped = 1 - float(coefficients.sum())
    information = np.linalg.pinv(products[:-1, :-1], hermitian=True)
    of_the_sum = power / (count - memory) * float(information.sum())
    return max(2 / (2 / count + 4 * of_the_sum / damped**2), 1.0) if damped else 1.0


def _autoregression(products: Array, count: int, memory: int) -> tuple[float, float, int]:
    """Return Akaike's criterion, the spectrum at zero and the order `memory`, from `_products` of `count` residuals.

    Residuals that only repeat, such as coarse readings, are predicted without error, and their spectrum would be 0 / 0.
    The criterion is then infinite, so that this order is not chosen.
    """
    coefficients, power = _predict(products[-memory - 1 :, -memory - 1 :])
    likelihood = count * float(np.log(power / count)) if power else -np.inf
    criterion = likelihood + 2 * memory
    damped = (1 - float(coefficients.sum())) ** 2
    if power <= MIN_UNPREDICTED * products[-1, -1] and damped <= MIN_UNPREDICTED:
        return np.inf, np.nan, memory
    # A process that never returns has no mean.
    return criterion, power / (count - memory) / damped if damped else np.inf, memory


def _products(residuals: Array, memory: int) -> Array:
    """Return the matrix (memory + 1, memory + 1) of the sums Σ r[t + i] r[t + j] over t, for residuals r (n,)."""
    lagged = np.array([residuals[lag : len(residuals) - memory + lag] for lag in range(memory + 1)])
    products: Array = lagged @ lagged.T
    return products


def _predict(products: Array) -> tuple[Array, float]:
    """Return the coefficients (k,) of the best linear prediction of residuals from the k previous ones.

    Return also the sum of squares of the prediction errors, the innovations. Both follow from the `products` of
    residuals (`_products`).
    """
    before, now = products[:-1, :-1], products[:-1, -1]
    coefficients = np.asarray(np.linalg.lstsq(before, now, rcond=None)[0], dtype=np.float64)
    return coefficients, max(float(products[-1, -1] - coefficients @ now), 0.0)


def innovations(residuals: Array, memory: int) -> Array:
    """Return the errors (n − memory,) of the best linear prediction of residuals (n,) from `memory` previous ones."""
    coefficients, _ = _predict(_products(residuals, memory))
    return residuals[memory:] - np.lib.stride_tricks.sliding_window_view(residuals[:-1], memory) @ coefficients


def _correlations(residuals: Array) -> Array | None:
    """Return the correlations (LAGS,) of residuals 1, 2, … steps apart; None if these are white or too few."""
    count = len(residuals)
    centred = residuals - residuals.mean()
    power = float(centred @ centred)
    if count <= 2 * LAGS or power == 0:
        return None
    rho: Array = np.array([centred[lag:] @ centred[:-lag] for lag in range(1, LAGS + 1)]) / power
    return rho if count * float(rho @ rho) > WHITENESS_LIMIT else None
