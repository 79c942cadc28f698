"""What is said of a calibration over temperature wherever it is shown."""

from collections.abc import Iterator, Sequence

from rig.data.entries.temperature import AtTemperatureEntry, OverTemperatureEntry, TemperatureContributorEntry
from rig.data.quantity import Quantity
from rig.estimation.temperature.over_temperature import GRADIENT, HYSTERESIS, LAG, NOISE, ORDER
from rig.report.words.rounding import plus_minus

EACH = 4  # of the table's rows are shown


def shown_rows(entry: OverTemperatureEntry) -> Sequence[AtTemperatureEntry]:
    """The rows of both ends of the range, of its middle, and half-way between."""
    return entry.table[::EACH]


def own_contributors(entry: OverTemperatureEntry) -> Sequence[TemperatureContributorEntry]:
    """What is uncertain about the polynomials alone, not about the calibration at the reference."""
    return [line for line in entry.contributors if line.name in (NOISE, ORDER, LAG, HYSTERESIS, GRADIENT)]


def about_lines(entry: OverTemperatureEntry, quantity: Quantity) -> Iterator[str]:
    """Lines that say by what the polynomials are known, and what is not in their uncertainty."""
    low, high = entry.range_c
    scale, bias = entry.orders
    yield f"it holds from {low:.1f} to {high:.1f} °C only; the readings call for order {scale} of k and {bias} of b"
    yield f"the part's thermometer is {plus_minus(entry.lag_s, 2 * entry.lag_std_s)} s behind"
    if entry.hysteresis is None or entry.hysteresis_std is None:
        yield "warming and cooling were not told apart: it went one way only, and a hysteresis is not in U"
        return
    unit, size = quantity.bias.name, quantity.bias.size
    each = zip("xyz", entry.hysteresis[3:], entry.hysteresis_std[3:], strict=True)
    terms = "  ".join(f"{axis} {plus_minus(value / size, 2 * std / size)}" for axis, value, std in each)
    yield f"warming less the middle of both ways, at most: {terms} {unit}; U allows for it"
