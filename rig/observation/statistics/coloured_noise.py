"""How far the mean of residuals scatters that are not white: neighbours alike average out worse, vibration better."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rig.estimation.arrays import Array

LAGS = 20
WHITE = 45.3  # χ² of 20 degrees of freedom at 0.999
MEMORIES = (1, 2, 4, 8, 16, 32)  # residuals that tell something of the next; 32: a whole wave of 7 Hz at 238 a second
SAMPLES_EACH = 12  # are needed to find one coefficient
PREDICTED = 1e-12  # of their squares that a prediction leaves of residuals which it repeats, and of 1 − Σ a then


@dataclass(frozen=True, slots=True)
class Left:
    """What a mean of residuals scatters by: the `factor` on its variance, and with how many degrees of freedom."""

    factor: float
    freedom: float


def widening(residuals: Array) -> float:
    """Factor ≥ 1 on the variance of a mean of these residuals (n,): 1 for white noise, 1 + 2 Σ ρ for coloured noise.

    The lag correlations ρ count only if they are significant together (Box–Pierce), so that white noise is left alone.
    """
    rho = _correlations(residuals)
    return 1.0 if rho is None else max(1.0, 1 + 2 * float(rho.sum()))


def noise_left(residuals: Array) -> float:
    """Factor on the variance of a mean by an autoregressive model, below 1 where most of the residuals is a vibration.

    A mean over many periods has nearly nothing left of one, whatever its correlations add up to. What is left of the
    mean is the spectrum at zero: of an autoregression with coefficients a and innovations e, var(e) / (1 − Σ a)². Its
    memory is the one that Akaike's criterion asks for.
    """
    return left_of(residuals).factor


def left_of(residuals: Array, memories: Sequence[int] = MEMORIES) -> Left:
    """The factor of `noise_left`, and the degrees of freedom of the variance it makes.

    White residuals have one less than there are. Of others twice the inverse of the spectrum's relative variance (JCGM
    100, G.4.2): 2/n of the innovations, 4 var(Σ a) / (1 − Σ a)² of the coefficients.
    """
    if _correlations(residuals) is None:
        return Left(1.0, max(len(residuals) - 1.0, 1.0))
    centred = residuals - residuals.mean()
    memories = [memory for memory in memories if memory * SAMPLES_EACH <= len(centred)]
    products, count = _products(centred, memories[-1]), len(centred) - memories[-1]
    criterion, spectrum_at_zero, memory = min(_autoregression(products, count, memory) for memory in memories)
    if np.isinf(criterion) and criterion > 0:
        return Left(1.0, max(len(residuals) - 1.0, 1.0))
    return Left(spectrum_at_zero / float(np.mean(centred**2)), _freedom(centred, memory))


def _freedom(centred: Array, memory: int) -> float:
    products, count = _products(centred, memory), len(centred) - memory
    coefficients, power = _predicted(products)
    damped = 1 - float(coefficients.sum())
    information = np.linalg.pinv(products[:-1, :-1], hermitian=True)
    of_the_sum = power / (count - memory) * float(information.sum())
    return max(2 / (2 / count + 4 * of_the_sum / damped**2), 1.0) if damped else 1.0


def _autoregression(products: Array, count: int, memory: int) -> tuple[float, float, int]:
    """Akaike's criterion and the spectrum at zero, by `_products` of so many residuals; this memory.

    Residuals that only repeat the one before, such as coarse readings of which few differ, tell no spectrum: 0 / 0.
    """
    coefficients, power = _predicted(products[-memory - 1 :, -memory - 1 :])
    likelihood = count * float(np.log(power / count)) if power else -np.inf
    criterion = likelihood + 2 * memory
    damped = (1 - float(coefficients.sum())) ** 2
    if power <= PREDICTED * products[-1, -1] and damped <= PREDICTED:
        return np.inf, np.nan, memory
    return criterion, power / (count - memory) / damped if damped else np.inf, memory  # what never returns has no mean


def _products(residuals: Array, memory: int) -> Array:
    """(memory + 1, memory + 1) sums of products of residuals (n,) and of the `memory` before each, the nearest last."""
    lagged = np.array([residuals[lag : len(residuals) - memory + lag] for lag in range(memory + 1)])
    products: Array = lagged @ lagged.T
    return products


def _predicted(products: Array) -> tuple[Array, float]:
    """The best linear prediction of residuals from the k before each, by their `_products`.

    Its coefficients (k,), and the squares' sum of its errors, which are called innovations.
    """
    before, now = products[:-1, :-1], products[:-1, -1]
    coefficients = np.asarray(np.linalg.lstsq(before, now, rcond=None)[0], dtype=np.float64)
    return coefficients, max(float(products[-1, -1] - coefficients @ now), 0.0)


def innovations(residuals: Array, memory: int) -> Array:
    """(n - memory,) errors of the best linear prediction of residuals (n,) from the `memory` before each."""
    coefficients, _ = _predicted(_products(residuals, memory))
    return residuals[memory:] - np.lib.stride_tricks.sliding_window_view(residuals[:-1], memory) @ coefficients


def _correlations(residuals: Array) -> Array | None:
    """(LAGS,) lag correlations; None where they are those of white noise, or the residuals are too few to say."""
    count = len(residuals)
    centred = residuals - residuals.mean()
    power = float(centred @ centred)
    if count <= 2 * LAGS or power == 0:
        return None
    rho: Array = np.array([centred[lag:] @ centred[:-lag] for lag in range(1, LAGS + 1)]) / power
    return rho if count * float(rho @ rho) > WHITE else None
