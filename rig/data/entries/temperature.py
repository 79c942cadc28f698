"""Calibrations over temperature in `result.json`."""

from typing import Annotated, Literal

from pydantic import Field

from rig.data.entries.result_types import Covariance, Entry, Freedom, Vector2, Vector3, Vector6

Cubic = Annotated[tuple[Vector3, ...], Field(min_length=4, max_length=4)]


class TemperatureContributorEntry(Entry):
    """Contributions to the uncertainty; `std` is for kx ky kz bx by bz at the reference temperature."""

    name: str
    kind: Literal["A", "B"]
    distribution: Literal["normal", "rectangular"]
    source: str
    degrees_of_freedom: Freedom
    std: Vector6


class AtTemperatureEntry(Entry):
    """Scale and bias at a temperature, with their expanded uncertainties."""

    temperature_c: float
    scale: Vector3
    bias: Vector3
    expanded_scale: Vector3
    expanded_bias: Vector3


class OverTemperatureEntry(Entry):
    """Scale and bias of one quantity of a sensor: Σ coefficient (T − reference)ⁿ, n from 0 to 3, in SI units per Kⁿ.

    - The bias has the sign that it has in the calibration, and its unit.
    - range_c: the valid range, by the part's own thermometer; table: values from one end to the other.
    - orders: of the polynomials of scale and bias, as the readings require.
    - covariance (24, 24): in the order scale n = 0 x y z, n = 1 x y z, …, then the bias.
    - hysteresis: largest difference of a warming sensor from the mean of warming and cooling; null, and not in the
      uncertainty, unless both were measured.
    - lag_s: lag of the thermometer.
    """

    part: str
    serial_number: str
    full_scale: float | None
    unit: str
    reference_c: float
    range_c: Vector2
    orders: tuple[int, int]
    scale: Cubic
    bias: Cubic
    covariance: Covariance
    contributors: tuple[TemperatureContributorEntry, ...]
    table: tuple[AtTemperatureEntry, ...]
    lag_s: float
    lag_std_s: float
    hysteresis: Vector6 | None
    hysteresis_std: Vector6 | None
    repeats: int

    def evaluate(self, temperature_c: float) -> tuple[Vector3, Vector3]:
        """Return scale and bias at a temperature, even outside the range."""
        powers = [(temperature_c - self.reference_c) ** n for n in range(4)]

        def value(cubic: Cubic) -> Vector3:
            x, y, z = (
                sum(power * coefficients[i] for power, coefficients in zip(powers, cubic, strict=True))
                for i in range(3)
            )
            return x, y, z

        return value(self.scale), value(self.bias)

    def std_at(self, temperature_c: float) -> list[float]:
        """Return the combined standard uncertainties (6,) of scale and bias at a temperature."""
        powers = [(temperature_c - self.reference_c) ** n for n in range(4)]

        def std(first: int) -> float:
            indices = [first + 3 * n for n in range(4)]
            terms = (
                one * other * self.covariance[row][column]
                for one, row in zip(powers, indices, strict=True)
                for other, column in zip(powers, indices, strict=True)
            )
            return float(max(sum(terms), 0.0) ** 0.5)

        return [std(first) for first in (0, 1, 2, 12, 13, 14)]
