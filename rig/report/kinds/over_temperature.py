"""Scale and bias as polynomials of temperature."""

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING

from rich.table import Table

from rig.analysis.outcome import Outcome
from rig.data.entries.temperature import OverTemperatureEntry
from rig.data.installed_kinds import quantities
from rig.data.result_file import ResultDocument
from rig.report.c_code.temperature import temperature_lines
from rig.report.findings.characteristics import BIAS_SLOPE_AT_REFERENCE, POLYNOMIALS
from rig.report.findings.finding import Finding
from rig.report.findings.history_records import HistoryRecord
from rig.report.findings.result_kind import CertifiedItem, DisplayRow, NoOutlet, ResultKind, row_of
from rig.report.tables import dcc_results
from rig.report.words.printed_values import plus_minus
from rig.report.words.temperature_words import about_lines, coverage_words, shown_rows
from rig.station.plain_text import build_number_table

if TYPE_CHECKING:
    from rig.data.recording.motion_file import Item
    from rig.data.recording.recorded_sensor import RecordedSensor


def _entries(outcome: Outcome) -> Mapping[str, Mapping[str, OverTemperatureEntry]]:
    """Return the entries of all polynomials, by sensor and quantity."""
    if not outcome.polynomials:
        return {}
    from rig.report.entries.temperature import temperature_entry

    return {
        name: {
            quantity.name: temperature_entry(quantity, polynomials, _sensor(outcome, name))
            for quantity, polynomials in by_quantity.items()
        }
        for name, by_quantity in outcome.polynomials.items()
    }


def _sensor(outcome: Outcome, name: str) -> "RecordedSensor | Item":
    if name in outcome.external:
        return outcome.external[name].item
    return outcome.recordings[0].run.sensors[name]


def _find(document: ResultDocument) -> Iterator[Finding[OverTemperatureEntry]]:
    for name, entries in document.over_temperature.items():
        yield from (Finding(name, quantities()[quantity], entry) for quantity, entry in entries.items())


def _render(finding: Finding[OverTemperatureEntry]) -> Iterator[Table | str]:
    entry, unit = finding.entry, finding.quantity.bias
    title = f"{finding.quantity.full_label(finding.sensor)}: over temperature, ± U ({coverage_words(entry)})"
    headings = ("°C", *(f"k{axis}" for axis in "xyz"), *(f"b{axis} {unit.name}" for axis in "xyz"))
    table = build_number_table(headings, title)
    for row in shown_rows(entry):
        scales = map(plus_minus, row.scale, row.expanded_scale)
        biases = (plus_minus(b / unit.size, u / unit.size) for b, u in zip(row.bias, row.expanded_bias, strict=True))
        table.add_row(f"{row.temperature_c:.1f}", *scales, *biases)
    yield table
    yield from about_lines(entry, finding.quantity)


def _build_row(finding: Finding[OverTemperatureEntry]) -> DisplayRow:
    """Return the row of the bias's slopes at the reference temperature."""
    noun = f"change per kelvin at {finding.entry.reference_c:g} °C"
    return row_of(BIAS_SLOPE_AT_REFERENCE.term_of(finding), finding.quantity.full_label(finding.sensor), noun)


def _build_record(finding: Finding[OverTemperatureEntry], _: ResultDocument) -> HistoryRecord | None:
    """Return the record to which a history adds the slopes. Scale and bias are in the calibration's own record."""
    entry = finding.entry
    return HistoryRecord(
        finding.sensor,
        f"{finding.quantity} over temperature",
        entry.part,
        entry.serial_number,
        entry.full_scale or 0.0,
        "polynomials",
        entry.reference_c,
    )


def _describe_item(finding: Finding[OverTemperatureEntry], _: object) -> CertifiedItem:
    entry, quantity = finding.entry, finding.quantity
    name, results = (
        f"{quantity.full_label(finding.sensor)}, over temperature",
        dcc_results.over_temperature(entry, quantity),
    )
    return CertifiedItem(quantity.sensor, finding.sensor, entry.part, entry.serial_number, name, results)


OVER_TEMPERATURE = ResultKind(
    name="over temperature",
    key="over_temperature",
    entries=_entries,
    find=_find,
    printed=_render,
    shown=_build_row,
    followed=_build_record,
    header=temperature_lines,
    figures="rig.report.figures.temperature:write_temperature_figures",
    block="over_temperature.html.j2:over_temperature",
    measured=_describe_item,
    standard=NoOutlet("it has the standard of its sensor"),
    corrected=NoOutlet("exports that support polynomials take its entries as they are"),
    unexplained=NoOutlet("its curves are drawn with their points instead"),
    characteristics=POLYNOMIALS,
)
