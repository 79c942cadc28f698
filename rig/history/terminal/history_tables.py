"""Tables of a history for the terminal."""

from collections.abc import Iterable, Iterator, Mapping, Sequence

from rig.data.absent import NO_ARM, NO_BOARD
from rig.data.installed_kinds import quantities
from rig.history.series import MIN_DRIFT_DAYS, YEAR_DAYS, Change, RigState, Subject, Trend
from rig.history.statistics.charts import MIN_RESULTS, Chart
from rig.history.statistics.rig_effects import RigEffect
from rig.history.store import KeptRun, Past
from rig.history.terminal.change_words import add_sign
from rig.history.terminal.fitting_table import FittingTable, TableColumn, picture
from rig.report.findings.history_records import BIASES, SCALES, Parameter, is_scale
from rig.report.words.printed_values import figures, format_signed, plus_minus

PPM = 1e6


def calibrations_table(pasts: Sequence[Past]) -> FittingTable:
    """Return a table of calibrations, one line each: sensor, time, rig, verdict."""
    started = [past.started_utc.replace("T", " ")[:16] for past in pasts]
    day = TableColumn("day", [time[:10] for time in started], rank=2)
    columns = (
        TableColumn("number", [str(past.id) for past in pasts], number=True),
        TableColumn("started (UTC)", started, rank=4, shorter=day),
        TableColumn("part", [past.part for past in pasts], rank=6),
        TableColumn("serial", [past.serial_number for past in pasts]),
        TableColumn("quantity", [past.quantity for past in pasts]),
        TableColumn("rig", [rig_in_words(past) for past in pasts], rank=5),
        TableColumn("verdict", [past.verdict if past.voided is None else f"{past.verdict}, void" for past in pasts]),
        TableColumn("notes", [_notes(past) for past in pasts], rank=3, wraps=True),
    )
    return FittingTable("calibrations", columns)


def trends_table(subject: Subject, trends: Sequence[Trend]) -> FittingTable:
    """Return a table with a row for each parameter: last value, drift, scatter, control chart and recall date."""
    columns = (
        TableColumn("parameter", [_add_unit(trend.name, trend.unit) for trend in trends]),
        TableColumn("trend", [picture(trend) for trend in trends], rank=1),
        TableColumn("last ± U", [value_text(trend.last) for trend in trends], number=True),
        TableColumn("runs", [str(trend.count) for trend in trends], rank=6, number=True),
        TableColumn("drift a year ± U", [_drift(trend) for trend in trends], rank=2, number=True),
        TableColumn("scatter", [_scatter(trend) for trend in trends], rank=5, number=True),
        TableColumn("chart", [_chart_words(trend.chart) for trend in trends], rank=3),
        TableColumn("recall", ["" if trend.recall is None else trend.recall.isoformat() for trend in trends], rank=4),
    )
    return FittingTable(title_of(subject), columns)


def trend_lines(trends: Mapping[str, Trend]) -> Iterator[str]:
    """Yield lines that explain the table of `trends` and the values that are missing in it."""
    if not trends:
        return
    fewest = min(trend.count for trend in trends.values())
    yield "trend: oldest to newest, from the lowest value − U to the highest + U"
    if "k" in trends:
        yield "k: the mean of the scale factors; an error of a clock changes it most"
    if fewest < MIN_RESULTS:
        yield f"drift, scatter, chart and recall need {MIN_RESULTS} calibrations; there are {fewest}"
    elif all(trend.line is None for trend in trends.values()):
        yield f"drift and recall need {MIN_DRIFT_DAYS:g} days from the first calibration to the last"
    calibrated = [trend.last for name, trend in trends.items() if name in (*SCALES, *BIASES)]
    if calibrated and all(parameter.std_combined is None for parameter in calibrated):
        yield "U includes noise only: no result of this sensor has a budget"
    for trend in trends.values():
        if trend.chart is not None and trend.chart.out_of_control:
            chart = trend.chart
            ewma = f"EWMA {format_signed(chart.ewma[-1], 2)} of ±{chart.limit[-1]:.2f}"
            newest = f"newest {format_signed(chart.deviation[-1], 1)} σ"
            yield f"{trend.name}: the newest is out of control, {ewma}, {newest}"


def changes_table(title: str, changes: Sequence[Change]) -> FittingTable:
    """Return a table of changes: each parameter before and now, the difference, and the normalised error E_n.

    A narrow terminal shows values without U, which E_n includes; the narrowest also omits the values before.
    """

    def values(heading: str, parameters: Sequence[Parameter], rank: int, shorter_rank: int) -> TableColumn:
        texts = [value_text(parameter) for parameter in parameters]
        short = TableColumn(heading, [text.partition(" ±")[0] for text in texts], shorter_rank, number=True)
        return TableColumn(f"{heading} ± U", texts, rank, number=True, shorter=short)

    differences = [add_sign(change.now.value - change.before.value) for change in changes]
    errors = [f"{'changed ' * change.has_changed}{change.normalised_error:.2f}" for change in changes]
    columns = (
        TableColumn("parameter", [_add_unit(change.name, change.unit) for change in changes]),
        values("before", [change.before for change in changes], 3, 1),
        values("now", [change.now for change in changes], 2, 0),
        TableColumn("difference", differences, rank=2, number=True, shorter=TableColumn("Δ", differences, number=True)),
        TableColumn("E_n", errors, number=True),
    )
    return FittingTable(title, columns)


def parameters_table(past: Past) -> FittingTable:
    """Return a table of one calibration's parameters."""
    parameters = past.parameters.values()
    combined = ["not known" if p.std_combined is None else figures(p.std_combined) for p in parameters]
    columns = (
        TableColumn("parameter", [_add_unit(p.name, p.unit) for p in parameters]),
        TableColumn("value ± U", [value_text(p) for p in parameters], number=True),
        TableColumn("u of noise", [figures(p.std_statistical) for p in parameters], rank=2, number=True),
        TableColumn("u of all", combined, rank=1, number=True),
    )
    return FittingTable(f"calibration {past.id}: {title_of(past.subject)}", columns)


def run_lines(past: Past, kept: KeptRun) -> Iterator[str]:
    """Yield operator, board and note of a run, and its certificates with their replacements."""
    if past.board_unique_id != NO_BOARD:
        yield f"board: {past.board_unique_id}"
    if past.operator is not None:
        yield f"operator: {past.operator}"
    if past.note is not None:
        yield f"note: {past.note}"
    replaced = {certificate.replaces for certificate in kept.certificates}
    for certificate in kept.certificates:
        text = f"{certificate.title.lower()} {certificate.number}, issued {certificate.issued}"
        text += f", replaces {certificate.replaces}" if certificate.replaces is not None else ""
        text += ", replaced" if certificate.number in replaced else ""
        yield text + (f"; {certificate.marks}" if certificate.marks else "")
        yield from (f"{name} of it: SHA-256 {sha256}" for name, sha256 in certificate.files)


def states_table(states: Iterable[RigState]) -> FittingTable:
    """Return a table of the rigs' states by their check standards."""
    rows = [(state, name, chart) for state in states for name, chart in state.charts.items()]
    columns = (
        TableColumn("rig", [state.rig for state, *_ in rows]),
        TableColumn(
            "check standards", [", ".join(state.standards) for state, *_ in rows], rank=2, wraps=True, least=16
        ),
        TableColumn("parameter", [name for _, name, _ in rows]),
        TableColumn("results", [str(chart.deviation.shape[-1]) for *_, chart in rows], rank=1, number=True),
        TableColumn("chart", [_chart_words(chart) for *_, chart in rows]),
    )
    return FittingTable("rigs by their check standards", columns)


def effects_table(effects: Mapping[str, Sequence[RigEffect]]) -> FittingTable:
    """Return a table of the differences between rigs."""
    rows = [(name, effect) for name, rig_effects in effects.items() for effect in rig_effects]
    columns = (
        TableColumn("parameter", [name for name, _ in rows]),
        TableColumn("rig", [effect.rig for _, effect in rows]),
        TableColumn("reads more than", [effect.reference for _, effect in rows]),
        TableColumn("by ± U", [_effect(name, effect) for name, effect in rows], number=True),
        TableColumn("shared sensors", [str(effect.sensors) for _, effect in rows], rank=1, number=True),
    )
    return FittingTable("effects of rigs, separated from those of sensors", columns)


def title_of(subject: Subject) -> str:
    """Return a subject's sensor, quantity and range in words."""
    part, serial_number, quantity, full_scale, simulated = subject
    unit = next((q.unit for q in quantities().values() if q.name in quantity.split()), "")
    range_text = f"±{full_scale:.4g} {unit}" if full_scale else "range not stated"
    return f"{part} {serial_number}, {quantity}, {range_text}" + (", simulated" if simulated else "")


def value_text(parameter: Parameter) -> str:
    """Return a parameter's printed value ± U."""
    return plus_minus(parameter.value, parameter.expanded)


def rig_in_words(past: Past) -> str:
    """Return the rig's name, or the source of readings without a rig."""
    return "readings from files" if past.rig == NO_ARM else past.rig


def _add_unit(name: str, unit: str) -> str:
    return name if unit == "1" else f"{name} {unit}"


def _notes(past: Past) -> str:
    notes = ("simulated" if past.simulated else "", "check standard" if past.check_standard else "")
    unfit = ("" if past.fit else "measurement unfit", f"void: {past.voided}" if past.voided is not None else "")
    return ", ".join(note for note in (*notes, *unfit) if note)


def _drift(trend: Trend) -> str:
    if trend.line is None:
        return ""
    a_year = float(trend.line.coefficients[1]) * YEAR_DAYS
    expanded = trend.line.coverage_factor * float(trend.line.std[1]) * YEAR_DAYS
    return plus_minus(a_year, expanded) + (" *" if trend.drifts else "")


def _scatter(trend: Trend) -> str:
    return "" if trend.mean is None else figures(trend.mean.between_std)


def _chart_words(chart: Chart | None) -> str:
    if chart is None:
        return ""
    if chart.out_of_control:
        return "OUT OF CONTROL"
    alarms = int(chart.alarm.sum())
    return f"in control; {alarms} alarm{'s' * (alarms > 1)} before" if alarms else "in control"


def _effect(name: str, effect: RigEffect) -> str:
    size, unit = (PPM, " ppm") if is_scale(name) else (1.0, " rad/s" if name in BIASES else "")
    certain = " *" if abs(effect.value) > effect.expanded else ""
    return f"{plus_minus(effect.value * size, effect.expanded * size)}{unit}{certain}"
