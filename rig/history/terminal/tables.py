"""A history as a person reads it in the terminal."""

from collections.abc import Iterable, Iterator, Mapping, Sequence

from rig.data.absent import NO_ARM, NO_BOARD
from rig.data.installed_kinds import quantities
from rig.history.series import DRIFT_DAYS, YEAR_DAYS, Change, RigState, Subject, Trend
from rig.history.statistics.charts import FEWEST, Chart
from rig.history.statistics.rig_effects import RigEffect
from rig.history.store import Kept, Past
from rig.history.terminal.change_words import signed
from rig.history.terminal.fitting_table import Column, FittingTable
from rig.history.terminal.spark import picture
from rig.report.findings.followed import BIASES, SCALES, Parameter, is_scale
from rig.report.words.rounding import figures, plus_minus

PPM = 1e6


def calibrations_table(pasts: Sequence[Past]) -> FittingTable:
    """The table of calibrations, one line each: what, when, by which rig, with which verdict."""
    started = [each.started_utc.replace("T", " ")[:16] for each in pasts]
    day = Column("day", [each[:10] for each in started], rank=2)
    columns = (
        Column("number", [str(each.id) for each in pasts], number=True),
        Column("started (UTC)", started, rank=4, shorter=day),
        Column("part", [each.part for each in pasts], rank=6),
        Column("serial", [each.serial_number for each in pasts]),
        Column("quantity", [each.quantity for each in pasts]),
        Column("rig", [rig_in_words(each) for each in pasts], rank=5),
        Column("verdict", [each.verdict if each.voided is None else f"{each.verdict}, void" for each in pasts]),
        Column("notes", [_notes(each) for each in pasts], rank=3, wraps=True),
    )
    return FittingTable("calibrations", columns)


def trends_table(subject: Subject, trends: Sequence[Trend]) -> FittingTable:
    """What each parameter was and is now, its drift, spread and chart, and until when it stays within its limit."""
    columns = (
        Column("parameter", [_with_unit(each.name, each.unit) for each in trends]),
        Column("trend", [picture(each) for each in trends], rank=1),
        Column("last ± U", [value_text(each.last) for each in trends], number=True),
        Column("runs", [str(each.count) for each in trends], rank=6, number=True),
        Column("drift a year ± U", [_drift(each) for each in trends], rank=2, number=True),
        Column("spread", [_spread(each) for each in trends], rank=5, number=True),
        Column("chart", [_chart_words(each.chart) for each in trends], rank=3),
        Column("recall", ["" if each.recall is None else each.recall.isoformat() for each in trends], rank=4),
    )
    return FittingTable(title_of(subject), columns)


def trend_lines(trends: Mapping[str, Trend]) -> Iterator[str]:
    """What the table leaves out, and what it does not know."""
    if not trends:
        return
    fewest = min(trend.count for trend in trends.values())
    yield "trend: oldest to newest, from the lowest value − U to the highest + U"
    if "k" in trends:
        yield "k: the mean of the scale factors; what is wrong with a clock moves it most"
    if fewest < FEWEST:
        yield f"drift, spread, chart and recall need {FEWEST} calibrations; there are {fewest}"
    elif all(trend.line is None for trend in trends.values()):
        yield f"drift and recall need {DRIFT_DAYS:g} days from the first calibration to the last"
    calibrated = [trend.last for name, trend in trends.items() if name in (*SCALES, *BIASES)]
    if calibrated and all(parameter.std_combined is None for parameter in calibrated):
        yield "U is that of noise alone: no result of this sensor has a budget"
    for trend in trends.values():
        if trend.chart is not None and trend.chart.out_of_control:
            chart = trend.chart
            ewma = f"EWMA {_signed(chart.ewma[-1], 2)} of ±{chart.limit[-1]:.2f}"
            yield f"{trend.name}: the newest is out of control, {ewma}, newest {_signed(chart.deviation[-1], 1)} σ"


def changes_table(title: str, changes: Sequence[Change]) -> FittingTable:
    """Return the table of changes: each parameter before and now, the difference, and E_n.

    Where there is little room the values stand without U, which E_n holds.
    """

    def values(heading: str, parameters: Sequence[Parameter], rank: int) -> Column:
        alone = Column(heading, [value_text(each).partition(" ±")[0] for each in parameters], number=True)
        return Column(f"{heading} ± U", [value_text(each) for each in parameters], rank, number=True, shorter=alone)

    columns = (
        Column("parameter", [_with_unit(each.name, each.unit) for each in changes]),
        values("before", [each.before for each in changes], 2),
        values("now", [each.now for each in changes], 1),
        Column("difference", [signed(each.now.value - each.before.value) for each in changes], number=True),
        Column("E_n", [f"{'changed ' * each.has_changed}{each.normalised_error:.2f}" for each in changes], number=True),
    )
    return FittingTable(title, columns)


def parameters_table(past: Past) -> FittingTable:
    """The table of one calibration's parameters."""
    found = past.parameters.values()
    combined = ["not known" if each.std_combined is None else figures(each.std_combined) for each in found]
    columns = (
        Column("parameter", [_with_unit(each.name, each.unit) for each in found]),
        Column("value ± U", [value_text(each) for each in found], number=True),
        Column("u of noise", [figures(each.std_statistical) for each in found], rank=2, number=True),
        Column("u of all", combined, rank=1, number=True),
    )
    return FittingTable(f"calibration {past.id}: {title_of(past.subject)}", columns)


def run_lines(past: Past, kept: Kept) -> Iterator[str]:
    """Who ran the rig, on which board the sensor was, what was noted, and the certificates, with what voids one."""
    if past.board_unique_id != NO_BOARD:
        yield f"board: {past.board_unique_id}"
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


def states_table(states: Iterable[RigState]) -> FittingTable:
    """What check standards say of rigs."""
    rows = [(state, name, chart) for state in states for name, chart in state.charts.items()]
    columns = (
        Column("rig", [state.rig for state, *_ in rows]),
        Column("check standards", [", ".join(state.standards) for state, *_ in rows], rank=2, wraps=True, least=16),
        Column("parameter", [name for _, name, _ in rows]),
        Column("results", [str(chart.deviation.shape[-1]) for *_, chart in rows], rank=1, number=True),
        Column("chart", [_chart_words(chart) for *_, chart in rows]),
    )
    return FittingTable("rigs by their check standards", columns)


def effects_table(effects: Mapping[str, Sequence[RigEffect]]) -> FittingTable:
    """What rigs differ in."""
    rows = [(name, effect) for name, each in effects.items() for effect in each]
    columns = (
        Column("parameter", [name for name, _ in rows]),
        Column("rig", [effect.rig for _, effect in rows]),
        Column("finds more than", [effect.reference for _, effect in rows]),
        Column("by ± U", [_effect(name, effect) for name, effect in rows], number=True),
        Column("shared sensors", [str(effect.sensors) for _, effect in rows], rank=1, number=True),
    )
    return FittingTable("effects of rigs, separated from those of sensors", columns)


def title_of(subject: Subject) -> str:
    """What was calibrated, in words."""
    part, serial_number, quantity, full_scale, simulated = subject
    unit = next((each.unit for each in quantities().values() if each.name in quantity.split()), "")
    of = f"±{full_scale:.4g} {unit}" if full_scale else "range not stated"
    return f"{part} {serial_number}, {quantity}, {of}" + (", simulated" if simulated else "")


def value_text(parameter: Parameter) -> str:
    """A parameter's value ± U in print."""
    return plus_minus(parameter.value, parameter.expanded)


def rig_in_words(past: Past) -> str:
    """The rig's name, or what there was in its place."""
    return "readings from files" if past.rig == NO_ARM else past.rig


def _with_unit(name: str, unit: str) -> str:
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


def _spread(trend: Trend) -> str:
    return "" if trend.mean is None else figures(trend.mean.between_std)


def _chart_words(chart: Chart | None) -> str:
    if chart is None:
        return ""
    if chart.out_of_control:
        return "OUT OF CONTROL"
    alarms = int(chart.alarm.sum())
    return f"in control; {alarms} alarm{'s' * (alarms > 1)} before" if alarms else "in control"


def _signed(value: float, decimals: int) -> str:
    return f"{value:+.{decimals}f}".replace("-", "−")


def _effect(name: str, effect: RigEffect) -> str:
    size, unit = (PPM, " ppm") if is_scale(name) else (1.0, " rad/s" if name in BIASES else "")
    certain = " *" if abs(effect.value) > effect.expanded else ""
    return f"{plus_minus(effect.value * size, effect.expanded * size)}{unit}{certain}"
