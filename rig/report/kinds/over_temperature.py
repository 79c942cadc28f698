"""Scale and bias as polynomials of temperature."""

from collections.abc import Iterator, Mapping, Sequence

import numpy as np
from rich.table import Table

from rig.analysis.outcome import Outcome
from rig.data.installed_kinds import quantities
from rig.data.motion_file import Item
from rig.data.quantity import Unit
from rig.data.recorded_sensor import RecordedSensor
from rig.data.result_file import ResultDocument
from rig.data.temperature_entries import OverTemperatureEntry
from rig.estimation.coverage import COVERAGE_FACTOR
from rig.report.certificate import dcc_results
from rig.report.kinds.finding import Finding
from rig.report.kinds.followed import SCALE_SLOPES, SLOPES, Followed, known, parameters
from rig.report.kinds.kind import Measured, ResultKind, Shown, Three, Without
from rig.report.rounding import plus_minus
from rig.report.temperature_c_functions import temperature_lines
from rig.report.temperature_entry import temperature_entry
from rig.report.temperature_words import about_lines, shown_rows
from rig.station.plain_text import plain

SCALE_SLOPE, BIAS_SLOPE = slice(3, 6), slice(15, 18)  # of the covariance


def _entries(outcome: Outcome) -> Mapping[str, Mapping[str, OverTemperatureEntry]]:
    return {
        name: {
            quantity.name: temperature_entry(quantity, found, _sensor(outcome, name))
            for quantity, found in each.items()
        }
        for name, each in outcome.polynomials.items()
    }


def _sensor(outcome: Outcome, name: str) -> RecordedSensor | Item:
    if name in outcome.elsewhere:
        return outcome.elsewhere[name].item
    return outcome.recordings[0].run.sensors[name]


def _found(document: ResultDocument) -> Iterator[Finding[OverTemperatureEntry]]:
    for name, each in document.over_temperature.items():
        yield from (Finding(name, quantities()[quantity], entry) for quantity, entry in each.items())


def _printed(finding: Finding[OverTemperatureEntry]) -> Iterator[Table | str]:
    entry, unit = finding.entry, finding.quantity.bias
    title = f"{finding.quantity.beside(finding.sensor)}: over temperature, ± U"
    table = Table(title=plain(title, "table.title"))
    table.title_justify = "left"
    for heading in ("°C", *(f"k{axis}" for axis in "xyz"), *(f"b{axis} {unit.name}" for axis in "xyz")):
        table.add_column(heading, justify="right")
    for row in shown_rows(entry):
        scales = map(plus_minus, row.scale, row.expanded_scale)
        biases = (plus_minus(b / unit.size, u / unit.size) for b, u in zip(row.bias, row.expanded_bias, strict=True))
        table.add_row(f"{row.temperature_c:.1f}", *scales, *biases)
    yield table
    yield from about_lines(entry, finding.quantity)


def _shown(finding: Finding[OverTemperatureEntry]) -> Shown:
    """The slopes at the reference."""
    entry, unit = finding.entry, finding.quantity.drift
    _, bias = _slopes(entry)
    noun = f"change per kelvin at {entry.reference_c:g} °C"
    name = f"{finding.quantity.beside(finding.sensor)}: {noun}"
    three, per_kelvin = Three(*([each / unit.size for each in values] for values in bias)), f"{unit.name}/K"
    return Shown(finding.sensor, finding.quantity, name, Unit(per_kelvin, unit.size), three, combined=True, noun=noun)


def _slopes(entry: OverTemperatureEntry) -> tuple[tuple[Sequence[float], Sequence[float]], ...]:
    """Slopes of scale and of bias, with their U."""
    stds = np.sqrt(np.diag(np.array(entry.covariance)).clip(min=0.0))
    return tuple(
        (cubic[1], (COVERAGE_FACTOR * stds[part]).tolist())
        for cubic, part in ((entry.scale, SCALE_SLOPE), (entry.bias, BIAS_SLOPE))
    )


def _followed(finding: Finding[OverTemperatureEntry], _: ResultDocument) -> Followed | None:
    """The slopes at the reference; scale and bias there are those of the sensor's calibration."""
    entry = finding.entry
    scale, bias = ((values, [each / COVERAGE_FACTOR for each in expanded]) for values, expanded in _slopes(entry))
    rows = [
        *parameters(SLOPES, *bias, None, f"{entry.unit}/K"),
        *parameters(SCALE_SLOPES, *scale, None, "1/K"),
    ]
    return Followed(
        finding.sensor,
        f"{finding.quantity} over temperature",
        entry.part,
        entry.serial_number,
        entry.full_scale or 0.0,
        "polynomials",
        entry.reference_c,
        known(rows),
    )


def _measured(finding: Finding[OverTemperatureEntry], _: object) -> Measured:
    entry, of = finding.entry, finding.quantity
    name, results = f"{of.beside(finding.sensor)}, over temperature", dcc_results.over_temperature(entry, of)
    return Measured(of.sensor, finding.sensor, entry.part, entry.serial_number, name, results)


OVER_TEMPERATURE = ResultKind(
    name="over temperature",
    key="over_temperature",
    entries=_entries,
    found=_found,
    printed=_printed,
    shown=_shown,
    followed=_followed,
    header=temperature_lines,
    figures="rig.report.temperature_figures:write_temperature_figures",
    block="over_temperature.html.j2:over_temperature",
    measured=_measured,
    standard=Without("it hangs on that of the sensor whose curve it is"),
    corrected=Without("exports that know polynomials take its entries as they are"),
    unexplained=Without("its curves are drawn instead, with their points"),
)
