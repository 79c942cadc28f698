"""Biases by repeat: attitudes that were gone through again and again (TRIAX, section IV)."""

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING

import numpy as np
from rich.table import Table

from rig.analysis.outcome import Outcome
from rig.data.entries.drift import BiasEntry, BiasStepEntry, DriftEntry, RepeatEntry, SlopeEntry
from rig.data.entries.result_types import ErrorEntry, Vector3
from rig.data.installed_kinds import quantities
from rig.data.quantity import RATE, Quantity
from rig.data.recording.recorded_sensor import RecordedSensor
from rig.data.result_file import ResultDocument
from rig.estimation.arrays import Array
from rig.report.entries.error import error_entry
from rig.report.entry import counted
from rig.report.findings.characteristics import DRIFT_SLOPE, DRIFTS, LARGEST_CHANGE
from rig.report.findings.finding import Finding
from rig.report.findings.followed import Followed
from rig.report.findings.kind import Measured, ResultKind, Shown, Without, row_of
from rig.report.findings.unexplained import of_repeats
from rig.report.tables import dcc_results
from rig.report.tables.budget import heading_of
from rig.report.words.expanded import expanded, factor_words
from rig.station.plain_text import plain

if TYPE_CHECKING:
    from rig.analysis.temperature.bias_drift import Anew, BiasDrift


def _entries(outcome: Outcome) -> Mapping[str, Mapping[str, DriftEntry]]:
    return {
        name: {
            quantity.name: drift_entry(quantity, drift, outcome.recordings[0].run.sensors[name])
            for quantity, drift in each.items()
        }
        for name, each in outcome.drifts.items()
    }


def drift_entry(quantity: Quantity, drift: "BiasDrift", sensor: RecordedSensor) -> DriftEntry:
    """The bias of that sensor by repeat, in SI units."""
    from rig.analysis.temperature.bias_drift import SLOPE
    from rig.estimation.temperature.bias_by_repeat import FALSE_ALARM

    held, slope = drift.held, drift.over_temperature
    anew = drift.anew.by_key(_anew, error_entry)
    return DriftEntry(
        unit=quantity.unit,
        repeats=tuple(
            RepeatEntry(
                time_s=float(drift.time_s[repeat]),
                temperature_c=_known(float(drift.temperature_c[repeat])),
                scale_fixed=BiasEntry(bias=_vector(held.bias[repeat]), std=_vector(held.std[repeat])),
                scale_free=anew[repeat],
            )
            for repeat in range(len(held.bias))
        ),
        common_std=_vector(drift.common_std),
        scatter_ratio=_vector(held.excess),
        steps=tuple(
            BiasStepEntry(
                repeat=move.repeat + 1, axis="xyz"[move.axis], change=_vector(move.change), std=_vector(move.std)
            )
            for move in held.moves
        ),
        false_alarm_probability=FALSE_ALARM,
        largest_change=_vector(held.largest_change),
        temperature_slope=error_entry(drift.faults[SLOPE])
        if slope is None
        else SlopeEntry(
            slope=_vector(slope.slope),
            std=_vector(slope.std),
            range_c=slope.range_c,
            correlation_with_time=slope.correlation,
            degrees_of_freedom=counted(drift.slope_freedom),
        ),
        earth_rate_known=drift.earth_rate_known,
        degrees_of_freedom=counted(drift.freedom),
        part=sensor.part,
        serial_number=sensor.serial_number,
        full_scale=sensor.channel(quantity).range,
        temperature_stated=sensor.temperature_stated,
    )


def _known(temperature_c: float) -> float | None:
    return None if np.isnan(temperature_c) else temperature_c


def _anew(anew: "Anew") -> BiasEntry:
    return BiasEntry(bias=_vector(anew.bias), std=_vector(anew.std))


def _vector(values: Array) -> Vector3:
    x, y, z = values.tolist()
    return x, y, z


def _found(document: ResultDocument) -> Iterator[Finding[DriftEntry]]:
    for name, drifts in document.bias_drift.items():
        yield from (Finding(name, quantities()[quantity], entry) for quantity, entry in drifts.items())


def _printed(finding: Finding[DriftEntry]) -> Iterator[Table | str]:
    yield drift_table(finding.sensor, finding.quantity, finding.entry)
    yield from _lines(finding)


def _shown(finding: Finding[DriftEntry]) -> Shown:
    """The largest change that there was."""
    return row_of(LARGEST_CHANGE.of(finding), finding.quantity.full_label(finding.sensor))


def _followed(finding: Finding[DriftEntry], document: ResultDocument) -> Followed:
    """What is followed of a drift."""
    entry = finding.entry
    warm = [repeat.temperature_c for repeat in entry.repeats if repeat.temperature_c is not None]
    return Followed(
        finding.sensor,
        f"{finding.quantity} bias drift",
        entry.part,
        entry.serial_number,
        entry.full_scale,
        "bias_by_repeat",
        float(np.mean(warm)) if warm else None,
    )


def _measured(finding: Finding[DriftEntry], _: object) -> Measured:
    entry, of = finding.entry, finding.quantity
    name, results = f"bias by repeat of {finding.sensor}, {of}", dcc_results.bias_drift(entry, of)
    return Measured(of.sensor, finding.sensor, entry.part, entry.serial_number, name, results)


def drift_table(name: str, of: Quantity, entry: DriftEntry) -> Table:
    """The bias of each repeat, scale and axes held, and its largest ± U; a mark where it moved."""
    unit, size = of.drift.name, of.drift.size
    known = expanded((1.0, 1.0, 1.0), entry.degrees_of_freedom)
    table = Table(title=plain(f"{name}, {of.sensor}: bias by repeat, scale and axes held", "table.title"))
    table.title_justify = "left"
    moved = {move.repeat: move.axis for move in entry.steps}
    for heading in ("repeat", "hours", "°C", *(f"{axis} {unit}" for axis in "xyz"), heading_of(known.factors), "moved"):
        table.add_column(heading, justify="right")
    for number, repeat in enumerate(entry.repeats, 1):
        table.add_row(
            str(number),
            f"{repeat.time_s / 3600:.2f}",
            "" if repeat.temperature_c is None else f"{repeat.temperature_c:.1f}",
            *(f"{bias / size:+.4g}" for bias in repeat.scale_fixed.bias),
            f"{max(np.multiply(known.factors, repeat.scale_fixed.std)) / size:.2g}",
            moved.get(number, ""),
        )
    return table


def _lines(finding: Finding[DriftEntry]) -> Iterator[str]:
    """What stands below the table."""
    entry, quantity, shown = finding.entry, finding.quantity, finding.quantity.drift
    unit, size = shown.name, shown.size
    if entry.steps:
        for move in entry.steps:
            change = " ".join(f"{each / size:+.3g}" for each in move.change)
            yield f"moved before repeat {move.repeat}, most along {move.axis}: {change} {unit}"
    else:
        yield "the bias did not move beyond its noise"
    yield f"a steady one is said to have moved in {100 * entry.false_alarm_probability:g} % of runs"
    if max(entry.scatter_ratio) > 1.5:
        yield f"repeats scatter {max(entry.scatter_ratio):.1f} times as much as noise would have it; U allows for that"
    anew = [repeat.scale_free for repeat in entry.repeats]
    refused = [each for each in anew if isinstance(each, ErrorEntry)]
    if refused:
        yield f"everything found anew: not in {len(refused)} of {len(anew)} repeats; {refused[0].error}"
    else:
        apart = [
            np.subtract(each.bias, repeat.scale_fixed.bias)
            for each, repeat in zip(anew, entry.repeats, strict=True)
            if not isinstance(each, ErrorEntry)
        ]
        rms = float(np.sqrt(np.mean(np.square(apart)))) / size
        yield f"everything found anew in each repeat: {rms:.3g} {unit} RMS from these"
    slope = entry.temperature_slope
    if isinstance(slope, ErrorEntry):
        yield f"over temperature: {slope.error}"
    else:
        terms = "  ".join(f"{a:+.3g} ± {b:.1g}" for _, a, b in DRIFT_SLOPE.of(finding).printed)
        low, high = slope.range_c
        words = factor_words(slope.degrees_of_freedom)
        yield f"over temperature: {terms} {unit} per °C ({words}), from {low:.1f} to {high:.1f} °C only"
    if quantity == RATE and not entry.earth_rate_known:
        yield "the Earth's rate is in these biases; site.latitude_deg and site.heading_deg take it out"


BIAS_DRIFT = ResultKind(
    name="bias drift",
    key="bias_drift",
    entries=_entries,
    found=_found,
    printed=_printed,
    shown=_shown,
    followed=_followed,
    header=Without("firmware corrects by one bias; `rig export` makes that of a temperature"),
    figures="rig.report.figures.drift:write_drift_figures",
    block="at_rest.html.j2:drift",
    measured=_measured,
    standard=Without("it hangs on that of the sensor whose bias it is"),
    corrected=Without("it corrects nothing; `rig export --at-temperature` takes its slopes"),
    unexplained=of_repeats,
    characteristics=DRIFTS,
)
