"""A history as a person reads it in the terminal."""

from collections.abc import Iterable, Iterator, Mapping, Sequence

from rich.table import Table

from rig.data.installed_kinds import quantities
from rig.history.series import YEAR_DAYS, Change, RigState, Subject, Trend
from rig.history.statistics.charts import FEWEST
from rig.history.statistics.rig_effects import RigEffect
from rig.history.store import Kept, Past
from rig.report.kinds.followed import Parameter, is_scale
from rig.report.rounding import rounded
from rig.station.plain_text import plain

PPM = 1e6


def calibrations_table(pasts: Iterable[Past]) -> Table:
    """The table of calibrations, one line each: what, when, by which rig, with which verdict."""
    table = _table("calibrations", "no", "started (UTC)", "sensor", "rig", "verdict", "")
    for each in pasts:
        started = each.started_utc.replace("T", " ")[:16]
        sensor = f"{each.part} {each.serial_number}" + ("" if each.quantity == "rate" else f", {each.quantity}")
        table.add_row(str(each.id), started, plain(sensor), plain(each.rig), each.verdict, plain(_notes(each)))
    return table


def trends_table(subject: Subject, trends: Iterable[Trend]) -> Table:
    """What each parameter is now, its drift, its spread, its chart, and until when it will stay within its limit."""
    headings = ("parameter", "last ± U", "runs", "drift a year ± U", "spread", "chart", "recall")
    table = _table(title_of(subject), *headings)
    for trend in trends:
        table.add_row(
            plain(trend.name if trend.unit == "1" else f"{trend.name} {trend.unit}"),
            value_text(trend.last),
            str(trend.count),
            _drift(trend),
            "" if trend.mean is None else f"{trend.mean.between_std:.2g}",
            _chart_text(trend),
            "" if trend.recall is None else trend.recall.isoformat(),
        )
    return table


def trend_lines(trends: Mapping[str, Trend]) -> Iterator[str]:
    """What the table leaves out, and what it does not know."""
    if not trends:
        return
    fewest = min(trend.count for trend in trends.values())
    if fewest < FEWEST:
        yield f"drift, spread, chart and recall need {FEWEST} calibrations; there are {fewest}"
    calibrated = [trend.last for name, trend in trends.items() if name[0] in "kb"]
    if calibrated and all(parameter.std_combined is None for parameter in calibrated):
        yield "U is that of noise alone: no result of this sensor has a budget"
    for trend in trends.values():
        if trend.chart is not None and trend.chart.out_of_control:
            yield f"{trend.name}: the newest is out of control, {_chart_text(trend)}"


def changes_table(title: str, changes: Iterable[Change]) -> Table:
    """The table of changes: each parameter beside the one before."""
    table = _table(title, "parameter", "before ± U", "now ± U", "E_n")
    for each in changes:
        table.add_row(
            plain(each.name if each.unit == "1" else f"{each.name} {each.unit}"),
            value_text(each.before),
            value_text(each.now),
            f"{'beyond U ' if each.beyond else ''}{each.normalised_error:.2f}",
        )
    return table


def parameters_table(past: Past) -> Table:
    """The table of one calibration's parameters."""
    table = _table(
        f"calibration {past.id}: {title_of(past.subject)}", "parameter", "value ± U", "unit", "u of noise", "u of all"
    )
    for each in past.parameters.values():
        combined = "not known" if each.std_combined is None else f"{each.std_combined:.3g}"
        table.add_row(each.name, value_text(each), plain(each.unit), f"{each.std_statistical:.3g}", combined)
    return table


def run_lines(past: Past, kept: Kept) -> Iterator[str]:
    """Who ran the rig, what was noted, and the certificates, with what makes one invalid."""
    if past.operator is not None:
        yield f"operator: {past.operator}"
    if past.note is not None:
        yield f"note: {past.note}"
    replaced = {each.replaces for each in kept.certificates}
    for each in kept.certificates:
        said = f"{each.title.lower()} {each.number}, issued {each.issued}"
        said += f", replaces {each.replaces}" if each.replaces is not None else ""
        said += ", replaced" if each.number in replaced else ""
        yield said + (f"; {each.marks}" if each.marks else "")
        yield from (f"{name} of it: SHA-256 {sha256}" for name, sha256 in each.files)


def states_table(states: Iterable[RigState]) -> Table:
    """What check standards say of rigs."""
    table = _table("rigs by their check standards", "rig", "check standards", "parameter", "results", "chart")
    for state in states:
        for name, chart in state.charts.items():
            said = "OUT OF CONTROL" if chart.out_of_control else "in control"
            if chart.alarm.any() and not chart.out_of_control:
                said = f"in control; {int(chart.alarm.sum())} alarms before"
            standards = plain(", ".join(state.standards))
            table.add_row(plain(state.rig), standards, name, str(chart.deviation.shape[-1]), said)
    return table


def effects_table(effects: Mapping[str, Sequence[RigEffect]]) -> Table:
    """What rigs differ in."""
    headings = ("parameter", "rig", "finds more than", "by ± U", "unit", "shared sensors")
    table = _table("effects of rigs, told apart from those of sensors", *headings)
    for name, each in effects.items():
        for effect in each:
            size, unit = (PPM, "ppm") if is_scale(name) else (1.0, "rad/s" if name[0] == "b" else "")
            found = rounded(effect.value * size, effect.expanded * size)
            table.add_row(
                name,
                plain(effect.rig),
                plain(effect.reference),
                f"{found.value_text} ± {found.uncertainty_text}" + (" *" if _certain(effect) else ""),
                unit,
                str(effect.sensors),
            )
    return table


def title_of(subject: Subject) -> str:
    """What was calibrated, in words."""
    part, serial_number, quantity, full_scale, simulated = subject
    unit = next((each.unit for each in quantities().values() if each.name in quantity.split()), "")
    of = f"±{full_scale:.4g} {unit}" if full_scale else "range not stated"
    return f"{part} {serial_number}, {quantity}, {of}" + (", simulated" if simulated else "")


def value_text(parameter: Parameter) -> str:
    """A parameter's value ± U in print."""
    found = rounded(parameter.value, parameter.expanded)
    return f"{found.value_text} ± {found.uncertainty_text}"


def _table(title: str, *headings: str) -> Table:
    table = Table(title=plain(title, "table.title"), title_justify="left")
    for heading in headings:
        number = "±" in heading or heading in ("no", "runs", "E_n")
        table.add_column(heading, justify="right" if number else "left", no_wrap=number or "UTC" in heading)
    return table


def _notes(past: Past) -> str:
    notes = ("simulated" if past.simulated else "", "check standard" if past.check_standard else "")
    unfit = ("" if past.fit else "measurement unfit", f"void: {past.voided}" if past.voided is not None else "")
    return ", ".join(note for note in (*notes, *unfit) if note)


def _drift(trend: Trend) -> str:
    if trend.line is None:
        return ""
    found = rounded(
        float(trend.line.coefficients[1]) * YEAR_DAYS,
        trend.line.coverage_factor * float(trend.line.std[1]) * YEAR_DAYS,
    )
    return f"{found.value_text} ± {found.uncertainty_text}" + (" *" if trend.drifts else "")


def _chart_text(trend: Trend) -> str:
    if trend.chart is None:
        return ""
    if trend.chart.out_of_control:
        found = trend.chart
        return f"EWMA {found.ewma[-1]:+.2f} of ±{found.limit[-1]:.2f}, newest {found.deviation[-1]:+.1f} σ"
    alarms = int(trend.chart.alarm.sum())
    return f"in control; {alarms} alarms before" if alarms else "in control"


def _certain(effect: RigEffect) -> bool:
    return abs(effect.value) > effect.expanded
