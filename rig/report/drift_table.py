"""A bias by repeat as a person reads it: TRIAX, Figs. 4 and 6."""

from collections.abc import Iterator, Mapping

import numpy as np
from rich.console import Console
from rich.table import Table

from rig.data.drift_entries import DriftEntry
from rig.data.quantity import QUANTITIES, RATE
from rig.data.result_types import ErrorEntry
from rig.report.budget_table import heading_of
from rig.report.expanded import expanded, factor_words
from rig.station.plain_text import plain


def print_drifts(found: Mapping[str, Mapping[str, DriftEntry]], console: Console) -> None:
    """Every sensor's, by quantity."""
    for name, drifts in found.items():
        for quantity, drift in drifts.items():
            console.print(drift_table(name, quantity, drift))
            for line in drift_lines(quantity, drift):
                console.print(plain(line))


def drift_table(name: str, quantity: str, found: DriftEntry) -> Table:
    """The bias of each repeat, scale and axes held, and its largest ± U; a mark where it moved."""
    of = QUANTITIES[quantity]
    unit, size = of.drift.name, of.drift.size
    known = expanded((1.0, 1.0, 1.0), found.freedom)
    table = Table(title=plain(f"{name}, {of.sensor}: bias by repeat, scale and axes held", "table.title"))
    table.title_justify = "left"
    moved = {move.repeat: move.axis for move in found.moves}
    for heading in ("repeat", "hours", "°C", *(f"{axis} {unit}" for axis in "xyz"), heading_of(known.factors), "moved"):
        table.add_column(heading, justify="right")
    for number, repeat in enumerate(found.repeats, 1):
        table.add_row(
            str(number),
            f"{repeat.time_s / 3600:.2f}",
            f"{repeat.temperature_c:.1f}",
            *(f"{bias / size:+.4g}" for bias in repeat.held.bias),
            f"{max(np.multiply(known.factors, repeat.held.std)) / size:.2g}",
            moved.get(number, ""),
        )
    return table


def drift_lines(quantity: str, found: DriftEntry) -> Iterator[str]:
    """What stands below the table."""
    shown = QUANTITIES[quantity].drift
    unit, size = shown.name, shown.size
    if found.moves:
        for move in found.moves:
            change = " ".join(f"{each / size:+.3g}" for each in move.change)
            yield f"moved before repeat {move.repeat}, most along {move.axis}: {change} {unit}"
    else:
        yield "the bias did not move beyond its noise"
    yield f"a steady one is said to have moved in {100 * found.false_alarm:g} % of runs"
    if max(found.excess) > 1.5:
        yield f"repeats scatter {max(found.excess):.1f} times as much as noise would have it; U allows for that"
    anew = [repeat.anew for repeat in found.repeats]
    refused = [each for each in anew if isinstance(each, ErrorEntry)]
    if refused:
        yield f"everything found anew: not in {len(refused)} of {len(anew)} repeats; {refused[0].error}"
    else:
        apart = [
            np.subtract(each.bias, repeat.held.bias)
            for each, repeat in zip(anew, found.repeats, strict=True)
            if not isinstance(each, ErrorEntry)
        ]
        rms = float(np.sqrt(np.mean(np.square(apart)))) / size
        yield f"everything found anew in each repeat: {rms:.3g} {unit} RMS from these"
    slope = found.over_temperature
    if isinstance(slope, ErrorEntry):
        yield f"over temperature: {slope.error}"
    else:
        widths = expanded(slope.std, slope.freedom).widths
        terms = "  ".join(f"{a / size:+.3g} ± {b / size:.1g}" for a, b in zip(slope.slope, widths, strict=True))
        low, high = slope.range_c
        words = factor_words(slope.freedom)
        yield f"over temperature: {terms} {unit} per °C ({words}), from {low:.1f} to {high:.1f} °C only"
    if quantity == RATE.name and not found.earth_rate_known:
        yield "the Earth's rate is in these biases; site.latitude_deg and site.heading_deg take it out"
