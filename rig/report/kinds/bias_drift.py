"""Bias drift: the bias in each repeat of the same attitudes (paper TRIAX, section IV)."""

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING

import numpy as np
from rich.table import Table

from rig.analysis.outcome import Outcome
from rig.data.entries.bias_drift import BiasEntry, BiasStepEntry, DriftEntry, RepeatEntry, SlopeEntry
from rig.data.entries.result_types import ErrorEntry, Vector3
from rig.data.installed_kinds import quantities
from rig.data.quantity import RATE, Quantity
from rig.data.result_file import ResultDocument
from rig.estimation.arrays import Array
from rig.report.entry import error_entry, finite_or_none, list_dof
from rig.report.findings.characteristics import DRIFT_SLOPE, DRIFTS, LARGEST_CHANGE
from rig.report.findings.finding import Finding
from rig.report.findings.history_records import HistoryRecord
from rig.report.findings.result_kind import CertifiedItem, NoOutlet, ResultKind, row_of
from rig.report.findings.unexplained import find_repeat_residuals
from rig.report.tables import dcc_results
from rig.report.tables.budget import heading_of
from rig.report.words.expanded_uncertainty import expanded, factor_words
from rig.station.plain_text import build_number_table

if TYPE_CHECKING:
    from rig.analysis.temperature.bias_drift import BiasDrift, ScaleFreeBias
    from rig.data.recording.recorded_sensor import RecordedSensor


def _entries(outcome: Outcome) -> Mapping[str, Mapping[str, DriftEntry]]:
    return {
        name: {
            quantity.name: drift_entry(quantity, drift, outcome.recordings[0].run.sensors[name])
            for quantity, drift in drifts.items()
        }
        for name, drifts in outcome.drifts.items()
    }


def drift_entry(quantity: Quantity, drift: "BiasDrift", sensor: "RecordedSensor") -> DriftEntry:
    """Return the bias of a sensor by repeat, in SI units."""
    from rig.analysis.temperature.bias_drift import SLOPE
    from rig.estimation.temperature.bias_by_repeat import FALSE_ALARM_PROBABILITY

    scale_fixed, slope = drift.scale_fixed, drift.over_temperature
    full_scale = sensor.channel(quantity).range
    assert full_scale is not None, "a gyroscope and an accelerometer state it"
    scale_free = drift.scale_free.results_by_key(_bias_entry, error_entry)
    return DriftEntry(
        unit=quantity.unit,
        repeats=tuple(
            RepeatEntry(
                time_s=float(drift.time_s[repeat]),
                temperature_c=finite_or_none(float(drift.temperature_c[repeat])),
                scale_fixed=BiasEntry(bias=_vector(scale_fixed.bias[repeat]), std=_vector(scale_fixed.std[repeat])),
                scale_free=scale_free[repeat],
            )
            for repeat in range(len(scale_fixed.bias))
        ),
        common_std=_vector(drift.common_std),
        scatter_ratio=_vector(scale_fixed.excess),
        steps=tuple(
            BiasStepEntry(
                repeat=move.repeat + 1, axis="xyz"[move.axis], change=_vector(move.change), std=_vector(move.std)
            )
            for move in scale_fixed.moves
        ),
        false_alarm_probability=FALSE_ALARM_PROBABILITY,
        largest_change=_vector(scale_fixed.largest_change),
        temperature_slope=error_entry(drift.faults[SLOPE])
        if slope is None
        else SlopeEntry(
            slope=_vector(slope.slope),
            std=_vector(slope.std),
            range_c=slope.range_c,
            correlation_with_time=slope.correlation,
            degrees_of_freedom=list_dof(drift.slope_dof),
        ),
        earth_rate_known=drift.earth_rate_known,
        degrees_of_freedom=list_dof(drift.dof),
        part=sensor.part,
        serial_number=sensor.serial_number,
        full_scale=full_scale,
        temperature_stated=sensor.temperature_stated,
    )


def _bias_entry(free: "ScaleFreeBias") -> BiasEntry:
    return BiasEntry(bias=_vector(free.bias), std=_vector(free.std))


def _vector(values: Array) -> Vector3:
    x, y, z = values.tolist()
    return x, y, z


def _find(document: ResultDocument) -> Iterator[Finding[DriftEntry]]:
    for name, drifts in document.bias_drift.items():
        yield from (Finding(name, quantities()[quantity], entry) for quantity, entry in drifts.items())


def _render(finding: Finding[DriftEntry]) -> Iterator[Table | str]:
    yield drift_table(finding.sensor, finding.quantity, finding.entry)
    yield from _lines(finding)


def _build_record(finding: Finding[DriftEntry], document: ResultDocument) -> HistoryRecord:
    """Return the record of a drift for a history."""
    entry = finding.entry
    temperatures = [repeat.temperature_c for repeat in entry.repeats if repeat.temperature_c is not None]
    return HistoryRecord(
        finding.sensor,
        f"{finding.quantity} bias drift",
        entry.part,
        entry.serial_number,
        entry.full_scale,
        "bias_by_repeat",
        float(np.mean(temperatures)) if temperatures else None,
    )


def _describe_item(finding: Finding[DriftEntry], _: object) -> CertifiedItem:
    entry, quantity = finding.entry, finding.quantity
    name, results = f"bias by repeat of {finding.sensor}, {quantity}", dcc_results.bias_drift(entry, quantity)
    return CertifiedItem(quantity.sensor, finding.sensor, entry.part, entry.serial_number, name, results)


def drift_table(name: str, quantity: Quantity, entry: DriftEntry) -> Table:
    """Return a table of the bias in each repeat, estimated with scale and axes fixed.

    A row has the largest U of the three axes, and the axis whose bias changed abruptly at this repeat, if any.
    """
    unit, size = quantity.drift.name, quantity.drift.size
    expansion = expanded((1.0, 1.0, 1.0), entry.degrees_of_freedom)
    biases = (f"{axis} {unit}" for axis in "xyz")
    table = build_number_table(
        ("repeat", "hours", "°C", *biases, heading_of(expansion.factors), "changed"),
        f"{name}, {quantity.sensor}: bias by repeat, scale and axes fixed",
    )
    changed_axes = {move.repeat: move.axis for move in entry.steps}
    for number, repeat in enumerate(entry.repeats, 1):
        table.add_row(
            str(number),
            f"{repeat.time_s / 3600:.2f}",
            "" if repeat.temperature_c is None else f"{repeat.temperature_c:.1f}",
            *(f"{bias / size:+.4g}" for bias in repeat.scale_fixed.bias),
            f"{max(np.multiply(expansion.factors, repeat.scale_fixed.std)) / size:.2g}",
            changed_axes.get(number, ""),
        )
    return table


def _lines(finding: Finding[DriftEntry]) -> Iterator[str]:
    """Yield the lines below the table of biases."""
    entry, quantity, shown = finding.entry, finding.quantity, finding.quantity.drift
    unit, size = shown.name, shown.size
    if entry.steps:
        for move in entry.steps:
            change = " ".join(f"{component / size:+.3g}" for component in move.change)
            yield f"changed before repeat {move.repeat}, most along {move.axis}: {change} {unit}"
    else:
        yield "the bias did not change beyond its noise"
    yield f"for a constant bias a change is reported in {100 * entry.false_alarm_probability:g} % of runs"
    if max(entry.scatter_ratio) > 1.5:
        yield f"repeats scatter {max(entry.scatter_ratio):.1f} times as much as the noise explains; U includes this"
    free_solutions = [repeat.scale_free for repeat in entry.repeats]
    refused = [solution for solution in free_solutions if isinstance(solution, ErrorEntry)]
    if refused:
        number = f"{len(refused)} of {len(free_solutions)}"
        yield f"all parameters solved in each repeat: not in {number} repeats; {refused[0].error}"
    else:
        differences = [
            np.subtract(solution.bias, repeat.scale_fixed.bias)
            for solution, repeat in zip(free_solutions, entry.repeats, strict=True)
            if not isinstance(solution, ErrorEntry)
        ]
        rms = float(np.sqrt(np.mean(np.square(differences)))) / size
        yield f"all parameters solved in each repeat: biases {rms:.3g} {unit} RMS from these"
    slope = entry.temperature_slope
    if isinstance(slope, ErrorEntry):
        yield f"over temperature: {slope.error}"
    else:
        terms = "  ".join(f"{a:+.3g} ± {b:.1g}" for _, a, b in DRIFT_SLOPE.term_of(finding).printed)
        low, high = slope.range_c
        words = factor_words(slope.degrees_of_freedom)
        yield f"over temperature: {terms} {unit} per °C ({words}), from {low:.1f} to {high:.1f} °C only"
    if quantity == RATE and not entry.earth_rate_known:
        yield "these biases include the Earth's rate; give site.latitude_deg and site.heading_deg to correct for it"


BIAS_DRIFT = ResultKind(
    name="bias drift",
    key="bias_drift",
    entries=_entries,
    find=_find,
    printed=_render,
    shown=lambda finding: row_of(LARGEST_CHANGE.term_of(finding), finding.quantity.full_label(finding.sensor)),
    followed=_build_record,
    header=NoOutlet("firmware corrects by one bias; `rig export` computes it for a temperature"),
    figures="rig.report.figures.bias_drift:write_drift_figures",
    block="at_rest.html.j2:drift",
    measured=_describe_item,
    standard=NoOutlet("it has the standard of its sensor"),
    corrected=NoOutlet("it corrects nothing; `rig export --at-temperature` takes its slopes"),
    unexplained=find_repeat_residuals,
    characteristics=DRIFTS,
)
