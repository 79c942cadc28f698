"""Scale and bias as polynomials of temperature, with the contributors to their uncertainty."""

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from rig.errors import Fault
from rig.estimation.arrays import Array
from rig.estimation.statistics.bias_process import BiasProcess
from rig.estimation.statistics.coverage import coverage_factors, effective_dof

MAX_ORDER = 3  # as in autopilots
COEFFICIENT_COUNT = 6 * (MAX_ORDER + 1)  # scale of order 0 xyz, of order 1 xyz, …, then the bias in the same order


@dataclass(frozen=True, slots=True)
class TemperatureLine:
    """A contributor as in `rig.estimation.gyroscope.budget`, with the `covariance` (24, 24) of the coefficients."""

    name: str
    kind: Literal["A", "B"]
    distribution: Literal["normal", "rectangular"]
    source: str
    dof: float
    covariance: Array


@dataclass(frozen=True, slots=True)
class ValuesAtTemperature:
    """Scale and bias (6,) at a temperature, with their standard and expanded uncertainties (6,)."""

    values: Array
    std: Array
    expanded: Array


@dataclass(frozen=True, slots=True)
class OverTemperature:
    """A sensor with the reading input/k(T) + c(T); both are polynomials Σ coefficient (T − reference)ⁿ, n from 0.

    - `scale`, `bias` (4, 3): the coefficients of k and c, SI units per Kⁿ; `orders` of k and of c.
    - `range_c`: the only range in which both are valid. `zero` (3,): the readings at the reference for zero input.
    - `lag_s`, `lag_std_s`: the thermometer's lag and its standard deviation.
    - `hysteresis`: two arrays (6,) for scale and bias in mid-range: the value while warming minus the mean of warming
      and cooling, and the standard deviation of this difference. None if the temperature changed in one direction only.
    """

    reference_c: float
    range_c: tuple[float, float]
    orders: tuple[int, int]
    scale: Array
    bias: Array
    lines: tuple[TemperatureLine, ...]
    zero: Array
    lag_s: float
    lag_std_s: float
    hysteresis: tuple[Array, Array] | None
    process: BiasProcess
    repeats: int

    @property
    def coefficients(self) -> Array:
        """The coefficients (24,) in the order of the covariance."""
        return np.concatenate([self.scale.ravel(), self.bias.ravel()])

    @property
    def covariance(self) -> Array:
        """The covariance (24, 24) of the coefficients, due to all contributors together."""
        combined: Array = np.sum([line.covariance for line in self.lines], axis=0)
        return combined

    def evaluate(self, temperature_c: float) -> ValuesAtTemperature:
        """Return the values at a temperature. Raise Fault `temperature_outside`."""
        check_inside(self.range_c, temperature_c)
        rows = powers_at(temperature_c - self.reference_c)
        variances = np.array([np.einsum("qi,ij,qj->q", rows, line.covariance, rows) for line in self.lines])
        std = np.sqrt(variances.sum(axis=0).clip(min=0.0))
        dof = effective_dof(variances, np.array([[line.dof] for line in self.lines]))
        return ValuesAtTemperature(rows @ self.coefficients, std, coverage_factors(dof) * std)

    def correct_to_reference(self, readings: Array, temperature_c: Array) -> Array:
        """Return readings (N, 3) corrected from their temperatures (N,) to the reference temperature."""
        relative, added = self.changes(temperature_c)
        moved: Array = relative * (readings - added - self.zero) + self.zero
        return moved

    def changes(self, temperature_c: Array) -> tuple[Array, Array]:
        """Return the scale over its value at the reference temperature, and the bias minus its value there, (N, 3)."""
        rows = np.vander(temperature_c - self.reference_c, MAX_ORDER + 1, increasing=True)
        return rows @ (self.scale / self.scale[0]), rows[:, 1:] @ self.bias[1:]


def check_inside(range_c: tuple[float, float], temperature_c: float) -> None:
    """Raise Fault `temperature_outside` for a temperature outside the range."""
    low, high = range_c
    if not low <= temperature_c <= high:
        raise Fault(
            "temperature_outside",
            f"the polynomials hold from {low:.1f} to {high:.1f} °C, but {temperature_c:.1f} °C is requested",
            "Request a temperature in that range, or measure over a wider one",
        )


def powers_at(difference_k: float) -> Array:
    """Return the matrix (6, 24) that maps coefficients to scale k and offset c at the reference + `difference_k`."""
    rows = np.kron(np.eye(2), np.kron(difference_k ** np.arange(MAX_ORDER + 1), np.eye(3)))
    return np.asarray(rows, dtype=np.float64)


def combine_with_reference(
    polynomials: OverTemperature, values: Array, lines: tuple[TemperatureLine, ...]
) -> OverTemperature:
    """Return the polynomials with the scale k and bias c (6,) at the reference temperature replaced by `values`.

    `values` come from another solution, of readings corrected to that temperature. `lines` are the contributors to its
    uncertainty, each with a covariance (6, 6), without the error of the correction.
    """
    scale, bias = polynomials.scale * values[:3] / polynomials.scale[0], polynomials.bias.copy()
    bias[0] = values[3:]
    ratio = np.concatenate([np.tile(values[:3] / polynomials.scale[0], MAX_ORDER + 1), np.ones(COEFFICIENT_COUNT // 2)])
    kept = tuple(replace(line, covariance=np.outer(ratio, ratio) * line.covariance) for line in polynomials.lines)
    first = np.r_[0:3, COEFFICIENT_COUNT // 2 : COEFFICIENT_COUNT // 2 + 3]

    def whole(line: TemperatureLine) -> TemperatureLine:
        covariance = np.zeros((COEFFICIENT_COUNT, COEFFICIENT_COUNT))
        covariance[np.ix_(first, first)] = line.covariance
        return replace(line, covariance=covariance)

    return replace(polynomials, scale=scale, bias=bias, lines=(*kept, *map(whole, lines)))
