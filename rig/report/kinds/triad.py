"""The common parts of three-axis sensors in a result: scale factors, biases, axes, and their uncertainty budget."""

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any
from xml.etree.ElementTree import Element

import numpy as np
from rich.table import Table

from rig.analysis.outcome import Outcome
from rig.data.entries.budget import expand_uncertainties
from rig.data.entries.magnetometer import ReversalEntry
from rig.data.entries.result_types import ErrorEntry
from rig.data.quantity import Quantity
from rig.data.recording.layout_keys import NOT_STATED
from rig.data.result_file import ResultDocument
from rig.estimation.arrays import Array
from rig.estimation.sensor_axes import SensorAxes
from rig.report.findings.characteristic import Characteristic
from rig.report.findings.characteristics import NON_ORTHOGONALITY
from rig.report.findings.finding import Finding
from rig.report.findings.history_records import CalibratedEntry, HistoryRecord, scale_and_bias, select_uncertain
from rig.report.findings.linear_corrections import SensorCorrection, noise_of
from rig.report.findings.result_kind import AxisValues, CertifiedItem, DisplayRow, ResultKind, Standard
from rig.report.findings.unexplained import find_attitude_residuals
from rig.report.tables.axis_tables import line_of, scale_and_bias_table, triple
from rig.report.tables.budget import budget_table, heading_for


@dataclass(frozen=True, slots=True)
class Words:
    """The texts of a kind of three-axis sensor; the functions build them from a finding or its entry.

    - `title`: printed behind the sensor's name on the terminal.
    - `model`: returns the equation of the sensor's readings.
    - `lines`: yields the lines below the table on the terminal.
    - `digital`: yields scale and bias for the digital certificate, and the results of a reversal if there was one.
    - `temperatures_c`: returns the temperatures of the readings for the digital certificate.
    """

    title: str
    model: Callable[[Any], str]
    lines: Callable[[Finding[Any]], Iterator[str]]
    digital: Callable[[Any, ReversalEntry | None], Iterator[Element]]
    temperatures_c: Callable[[Any], Mapping[str, float | None]]


def bias_of(quantity: Quantity, entry: object) -> Sequence[float]:
    """Return the bias (3,) of an entry, in SI units."""
    bias: Sequence[float] = getattr(entry, quantity.file_key("bias"))
    return bias


def shown_of(finding: Finding[Any]) -> DisplayRow:
    """Return the row for page and notebook of a sensor with three axes."""
    quantity, entry = finding.quantity, finding.entry
    expanded, size = expand_uncertainties(entry.budget, entry.covariance), quantity.bias.size
    count = len(entry.scale)
    bias = AxisValues(
        [value / size for value in bias_of(quantity, entry)], [value / size for value in expanded[count:]]
    )
    scale, combined = AxisValues(entry.scale, expanded[:count]), entry.budget is not None
    name, unit = quantity.label(finding.sensor), quantity.bias
    return DisplayRow(finding.sensor, quantity, name, unit, bias, combined, scale, labels=quantity.axes)


def history_record(finding: Finding[Any], document: ResultDocument) -> HistoryRecord:
    """Return a history's record of scale and bias."""
    quantity, entry = finding.quantity, finding.entry
    parameters = [*scale_and_bias(finding.sensor, quantity, entry, bias_of(quantity, entry), document)]
    full_scale: float = getattr(entry, quantity.file_key("range")) or 0.0
    temperature_c: float | None = getattr(entry, "temperature_c", None)
    about = entry.part, entry.serial_number, full_scale, entry.estimator, temperature_c
    return HistoryRecord(finding.sensor, quantity.name, *about, select_uncertain(parameters))


def tables(title: str, quantity: Quantity, entry: CalibratedEntry) -> Iterator[Table]:
    """Yield a table of scale and bias of each axis ± U, and a table of the uncertainty budget."""
    budget, expanded = entry.budget, expand_uncertainties(entry.budget, entry.covariance)
    yield scale_and_bias_table(
        title, quantity, entry.scale, bias_of(quantity, entry), expanded, heading=heading_for(budget)
    )
    if budget is not None:
        yield budget_table(budget, entry.scale, quantity.bias)


def item_words(entry: Any) -> str:
    """Return the part and the serial number, if stated."""
    names = [name for name in (entry.part, entry.serial_number) if name != NOT_STATED]
    return " ".join(names) or "part and serial number not stated"


def attitude_lines(finding: Finding[Any]) -> Iterator[str]:
    """Yield lines on non-orthogonality, attitude error and, for attitudes of a file, placement error."""
    entry, quantity = finding.entry, finding.quantity
    yield line_of(NON_ORTHOGONALITY.term_of(finding), "non-orthogonality yz zx xy", "+.4f")
    if entry.attitude_error_rad is not None:
        expanded = "" if entry.attitude_error_std_rad is None else f" (± {2e3 * entry.attitude_error_std_rad:.2f})"
        yield f"estimated attitude error: {1e3 * entry.attitude_error_rad:.2f} mrad about each axis{expanded}"
    placement, unit = entry.placement, quantity.unit
    if placement is None:
        return
    if placement.placement_std is not None:
        size = f"{placement.placement_std:.2g} ± {2 * placement.placement_uncertainty:.2g} {unit}"
        count = placement.rests_without_attitude
        others = f", estimated with {count} more rests" if count else ""
        yield f"laying it down again changes each reading by {size} in addition to the attitude{others}"
        if placement.placement_uncertainty > placement.placement_std / 2:
            yield "this estimate is poor: lay it down in the same attitudes again to reduce the uncertainty"


def method_lines(entry: Any, quantity: Quantity, from_what: str = "") -> Iterator[str]:
    """Yield a line for each method not chosen, its name followed by `from_what`: its solution, or why it has none."""
    for method, other in entry.other_methods.items():
        if isinstance(other, ErrorEntry):
            yield f"{method}{from_what}: {other.error}"
        else:
            bias = triple(np.divide(bias_of(quantity, other), quantity.bias.size), f"+.{quantity.decimals}f")
            yield f"{method}{from_what}: k {triple(other.scale, '.6f')}, b {bias} {quantity.bias.name}"


def describe_unsolved(document: ResultDocument, quantity: Quantity) -> Iterator[str]:
    """Yield the reasons why a quantity has no solution."""
    for name, faults in document.unsolved.items():
        if (fault := faults.get(quantity.name)) is not None:
            yield f"{name}, {quantity.sensor}, not calibrated: {fault.error}"


def _build_correction(finding: Finding[Any]) -> SensorCorrection:
    """Return the correction of readings, in the right-angled frame of the entry's matrix."""
    quantity, entry = finding.quantity, finding.entry
    noise = [(getattr(dwell, quantity.file_key("noise")), dwell.samples) for dwell in entry.dwells]
    to_sensor = None
    if getattr(entry, "placement", None) is not None:  # only then `matrix` has the frame of a gyroscope's mounting
        to_sensor = SensorAxes.from_matrix(np.array(entry.matrix)).mounting
    return SensorCorrection(
        sensor=finding.sensor,
        quantity=quantity,
        part=entry.part,
        serial_number=entry.serial_number,
        full_scale=getattr(entry, quantity.file_key("range")),
        temperature_c=getattr(entry, "temperature_c", None),
        scale=np.array(entry.scale),
        matrix=np.linalg.inv(np.array(entry.correction_matrix)),
        offset=np.array(bias_of(quantity, entry)),
        noise=noise_of(entry.dwells, noise),
        second_order=getattr(entry, "second_order_s2_m", None) is not None,
        mounting=to_sensor,
        in_gyroscope_frame=getattr(entry, "alignment", None) is not None,
    )


def triad_kind(
    quantity: Quantity,
    key: str,
    entries: Callable[[Outcome], Mapping[str, object]],
    words: Words,
    *,
    header: Callable[[Finding[Any], Mapping[str, Array]], Iterable[str]],
    block: str,
    standard: Standard,
    characteristics: tuple[Characteristic, ...],
) -> ResultKind[Any]:
    """Return how results of a sensor calibrated in attitudes are shown: its `key` in the document, and its `words`."""

    def find(document: ResultDocument) -> Iterator[Finding[Any]]:
        all_entries: Mapping[str, Any] = getattr(document, key)
        solved = ((name, entry) for name, entry in all_entries.items() if not isinstance(entry, ErrorEntry))
        return (Finding(name, quantity, entry) for name, entry in solved)

    def explain_unsolved(document: ResultDocument) -> Iterator[str]:
        all_entries: Mapping[str, Any] = getattr(document, key)
        for name, entry in all_entries.items():
            if isinstance(entry, ErrorEntry):
                yield f"{quantity.label(name)}, not calibrated: {entry.error}"
        yield from describe_unsolved(document, quantity)

    def render(finding: Finding[Any]) -> Iterator[Table | str]:
        entry = finding.entry
        title = f"{quantity.label(finding.sensor)}{words.title}: {item_words(entry)}"
        yield from tables(f"{title}, {words.model(entry)}, {entry.estimator}", quantity, entry)
        yield from words.lines(finding)

    def describe_item(finding: Finding[Any], reversals: Mapping[str, ReversalEntry]) -> CertifiedItem:
        entry, name = finding.entry, f"calibration of {quantity.sensor} {finding.sensor}"
        results = words.digital(entry, reversals.get(finding.sensor))
        temperatures = words.temperatures_c(entry)
        return CertifiedItem(
            quantity.sensor, finding.sensor, entry.part, entry.serial_number, name, results, temperatures
        )

    return ResultKind(
        name=quantity.sensor,
        key=key,
        entries=entries,
        find=find,
        unsolved=explain_unsolved,
        printed=render,
        shown=lambda finding: replace(shown_of(finding), model=finding.entry.model),
        followed=history_record,
        header=header,
        figures="rig.report.figures.attitudes:write_attitude_figures",
        block=block,
        measured=describe_item,
        standard=standard,
        corrected=_build_correction,
        unexplained=find_attitude_residuals,
        characteristics=characteristics,
    )
