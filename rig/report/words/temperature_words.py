"""A calibration over temperature in words, for all outputs."""

from collections.abc import Iterator, Sequence

import numpy as np

from rig.data.entries.temperature import AtTemperatureEntry, OverTemperatureEntry, TemperatureContributorEntry
from rig.data.quantity import Quantity
from rig.estimation.arrays import Array, divide_or_infinity
from rig.estimation.temperature.line_names import GRADIENT, HYSTERESIS, LAG, NOISE, ORDER
from rig.report.words.expanded_uncertainty import spell_factors
from rig.report.words.printed_values import plus_minus

ROW_STEP = 4  # every fourth row of the table is shown


def shown_rows(entry: OverTemperatureEntry) -> Sequence[AtTemperatureEntry]:
    """Return the rows for the ends, the middle and the quarters of the range."""
    return entry.table[::ROW_STEP]


def coverage_at_rows(rows: Sequence[AtTemperatureEntry], entry: OverTemperatureEntry) -> Array:
    """Return the coverage factors U/u (n, 6) of kx ky kz bx by bz in n rows of an entry's table."""
    expanded = np.array([[*row.expanded_scale, *row.expanded_bias] for row in rows])
    return divide_or_infinity(expanded, [entry.std_at(row.temperature_c) for row in rows])


def coverage_words(entry: OverTemperatureEntry) -> str:
    """Return the coverage factors, in words, of the printed rows of an entry's table."""
    return spell_factors(coverage_at_rows(shown_rows(entry), entry).ravel().tolist())


def polynomial_contributors(entry: OverTemperatureEntry) -> Sequence[TemperatureContributorEntry]:
    """Return the contributors of the polynomials, without those of the calibration at the reference temperature."""
    return [line for line in entry.contributors if line.name in (NOISE, ORDER, LAG, HYSTERESIS, GRADIENT)]


def about_lines(entry: OverTemperatureEntry, quantity: Quantity) -> Iterator[str]:
    """Yield lines on the range and orders of the polynomials, the thermometer's delay, and the hysteresis."""
    low, high = entry.range_c
    scale, bias = entry.orders
    yield f"it is valid from {low:.1f} to {high:.1f} °C only; polynomials of order {scale} for k and {bias} for b"
    yield f"delay of the part's thermometer: {plus_minus(entry.lag_s, 2 * entry.lag_std_s)} s"
    if entry.hysteresis is None or entry.hysteresis_std is None:
        yield "the temperature changed in one direction only: hysteresis was not measured and is not in U"
        return
    unit, size = quantity.bias.name, quantity.bias.size
    rows = zip("xyz", entry.hysteresis[3:], entry.hysteresis_std[3:], strict=True)
    terms = "  ".join(f"{axis} {plus_minus(value / size, 2 * std / size)}" for axis, value, std in rows)
    yield f"hysteresis, warming minus the mean of warming and cooling, at most: {terms} {unit}; included in U"
