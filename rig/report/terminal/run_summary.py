"""The end of a run in a few lines: each sensor's values ± U, failed and nearly failed checks, further files. Pure."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rig.data.recording.layout_keys import NOT_STATED
from rig.data.result_file import CheckEntry, ResultDocument
from rig.report.entries.omission_entries import omission_lines
from rig.report.findings.result_kind import AxisValues, DisplayRow
from rig.report.kinds.kind_registry import kinds, outlets
from rig.report.words.check_words import what_failed, words_of
from rig.report.words.mounting_words import farthest_off
from rig.report.words.printed_values import format_with_u, plus_minus
from rig.station.plain_text import INDENT, wrap_line

MAX_SENSORS_WITH_MODELS = 4  # more leave no line for their formulas on a screen of 25
NEAR_LIMIT_RATIO = 0.9  # above which a passed check is named
MAX_NEAR_CHECKS = 2
ROOT_CHECKS = ("stuck_axis", "repeated_readings")  # such readings do not follow the motion: other checks fail too
MAX_LINES_ONE, MAX_LINES_MANY = 12, 25  # for one sensor, and for several
MIN_WIDTH = 80  # columns: a narrower screen has more lines


@dataclass(frozen=True, slots=True)
class _SensorValues:
    """A calibrated sensor: its kind, its label, its entry, and the row of its values (`shown`)."""

    kind: str
    label: str
    entry: Any
    shown: DisplayRow


def ending(
    result: ResultDocument,
    *,
    folder: Path | None,
    everything: str,
    certificate: Path | None,
    since: Sequence[str],
    width: int,
) -> Iterator[str]:
    """Yield the lines at the end of a run, the verdict last, at most `width` long except paths and commands.

    `since` has the comparison with the last calibrations in lines; `folder` is the run's folder, which remedies name,
    None without a folder; `everything` is the command that prints all details.
    """
    items = [*_items(result)]
    summary = "; ".join([*_describe_values(items), _count_passed(result)])
    unsolved = (line for kind in kinds() for line in kind.unsolved(result))
    needed = [*unsolved, *omission_lines(result)], [*since]
    in_short = [line for kind in kinds() for finding in kind.find(result) for line in kind.in_short(finding)]
    files = [] if certificate is None else [f"certificate: {certificate}"]
    files.append(f"all details: {everything}")
    broken = _explain_failures(result, folder)

    def lines_of(*texts: str) -> int:
        return sum(len([*_wrap(text, max(width, MIN_WIDTH))]) for text in texts)

    # Always printed: the values, one failure, the summary, `needed`. The remaining lines are for optional texts first,
    # then for further failures.
    room = (MAX_LINES_ONE if len(items) == 1 else MAX_LINES_MANY) - len([*_values(items, max(width, MIN_WIDTH))])
    room -= lines_of(*_first_failures(broken, 1), summary, *needed[0], *needed[1]) + len(files) + 1
    spare = []
    for text in (*in_short, *farthest_off(result), *_name_near(result)):
        if lines_of(text) <= room:
            spare.append(text)
            room -= lines_of(text)
    room += lines_of(*_first_failures(broken, 1))
    count = next((n for n in range(len(broken), 1, -1) if lines_of(*_first_failures(broken, n)) <= room), 1)
    brief = [text for text in in_short if text in spare]
    yield from _values(items, width)
    for text in (*_first_failures(broken, count), summary, *brief, *needed[0], *spare[len(brief) :], *needed[1]):
        yield from _wrap(text, width)
    yield from files
    yield f"verdict: {result.verdict.upper()}"


def _values(items: Sequence[_SensorValues], width: int) -> Iterator[str]:
    return _list_axes(items[0], width) if len(items) == 1 else _list_sensors(items, width)


def _items(result: ResultDocument) -> Iterator[_SensorValues]:
    """Yield the findings with calibrated values; reference sensors have none."""
    for kind, show, finding in outlets(result, lambda kind: kind.shown):
        if finding.is_reference:
            continue
        serial = getattr(finding.entry, "serial_number", None)
        label = finding.sensor if serial in (None, NOT_STATED) else f"{finding.sensor} {serial}"
        yield _SensorValues(kind.name, label, finding.entry, show(finding))


def _list_axes(item: _SensorValues, width: int) -> Iterator[str]:
    """Yield the values of a single sensor, one line for each axis."""
    shown, part = item.shown, getattr(item.entry, "part", None)
    columns = [[_heading(item), *_plus_minus(shown.numbers)]]
    if shown.scale is not None:
        columns.insert(0, ["scale factor", *_plus_minus(shown.scale)])
    widths = [max(map(len, column)) for column in columns]
    heading, *axes = (
        "".join(f"   {cell:>{size}}" for cell, size in zip(cells, widths, strict=True))
        for cells in zip(*columns, strict=True)
    )
    title = f"{item.kind} {item.label}" + ("" if part in (None, NOT_STATED) else f", {part}")
    first = len(title) if len(title) + len(heading) <= width else len(INDENT) + 1
    yield from [f"{title}{heading}"] if first == len(title) else [title, f"{'':{first}}{heading}"]
    for axis, cells in zip("xyz", axes, strict=False):
        yield f"{INDENT}{axis:{first - len(INDENT)}}{cells}"


def _list_sensors(items: Sequence[_SensorValues], width: int) -> Iterator[str]:
    """Yield the values of many sensors, kind by kind, in one line each, or two on a narrow screen."""
    table = _tabulate(items)
    if not table:
        return
    number = max(len(cell) for _, cells in table for cell in cells)
    columns = max(len(cells) for _, cells in table)
    name = max(len(label) for label, _ in table)
    if name + (number + 1) * columns > width:  # if that is enough, the longest headings get lines of their own
        name = max(len(label) for label, _ in table if label.startswith(INDENT))
    gap = next((gap for gap in (3, 2, 1) if name + (number + gap) * columns <= width), 2)
    number += gap
    fits = name + number * columns <= width
    for label, cells in table:
        numbers = "".join(f"{cell:>{number}}" for cell in cells)
        if fits and len(label) <= name:
            yield f"{label:{name}}{numbers}"
        else:
            yield from (label, f"{'':{name}}{numbers}" if fits else f"{INDENT}{numbers}")


def _tabulate(items: Sequence[_SensorValues]) -> list[tuple[str, Sequence[str]]]:
    """Return the label and cells of each line: a heading for each kind, then its sensors."""
    blocks: dict[str, list[tuple[str, AxisValues]]] = {}
    for item in items:
        heading = _heading(item)
        if item.shown.scale is not None:
            blocks.setdefault(f"{item.kind}, scale factor", []).append((item.label, item.shown.scale))
            heading = f"{item.kind}, {heading}"
        blocks.setdefault(heading, []).append((item.label, item.shown.numbers))
    table: list[tuple[str, Sequence[str]]] = []
    for heading, rows in blocks.items():
        table.append((heading, [*"xyz"[: len(rows[0][1].values)], "± U"]))
        table += [(f"{INDENT}{label}", _format_axes(three)) for label, three in rows]
    return table


def _heading(item: _SensorValues) -> str:
    """Return the heading of the numbers other than scale factors, with their unit."""
    return f"{item.shown.noun}, {item.shown.unit.name}"


def _plus_minus(three: AxisValues) -> list[str]:
    return [plus_minus(value, u) for value, u in zip(three.values, three.expanded, strict=True)]


def _format_axes(three: AxisValues) -> list[str]:
    """Return texts of the values of three axes, then of their largest U."""
    cells = [format_with_u(value, max(three.expanded)) for value in three.values]
    return [*(value for value, _ in cells), cells[0][1]]


def _describe_values(items: Sequence[_SensorValues]) -> Iterator[str]:
    """Yield lines that explain the printed numbers: U or noise, the speeds, and the model of each kind of sensor."""
    if not items:
        return
    combined = all(item.shown.combined for item in items)
    yield "± U, about 95 %" if combined else "± 2 standard deviations of the noise"
    conditions = {(item.kind, item.shown.held_at) for item in items if item.shown.held_at}
    if len(conditions) == 1:
        (kind, held_at) = conditions.pop()
        yield f"{kind}s {held_at}" if len(items) > 1 else held_at
    models = dict.fromkeys((item.kind, item.shown.model.partition(",")[0]) for item in items if item.shown.model)
    if len(items) <= MAX_SENSORS_WITH_MODELS:
        yield from (f"{kind}: {model}" if len(items) > 1 else model for kind, model in models)


def _count_passed(result: ResultDocument) -> str:
    passed = sum(check.passed for check in result.checks)
    return f"{passed} of {len(result.checks)} checks passed"


def _explain_failures(result: ResultDocument, folder: Path | None) -> list[tuple[str, str]]:
    """Return failed checks with their meaning and remedy: causes first, then the largest excess over the limit.

    Checks without a value come last: most lack it because another check failed.
    """
    failed = sorted((check for check in result.checks if not check.passed), key=_ratio_to_limit, reverse=True)
    failed.sort(key=lambda check: (check.value is None, check.means.what not in ROOT_CHECKS))
    words = [what_failed(check, folder) for check in failed]
    return [
        (f"FAILED {_value_and_limit(check)}", "" if meaning is None else f": {meaning}")
        for check, meaning in zip(failed, words, strict=True)
    ]


def _first_failures(broken: Sequence[tuple[str, str]], count: int) -> Iterator[str]:
    """Yield the first `count` failures; a last line states how many more there are."""
    more = len(broken[count:])
    for number, (measured, words) in enumerate(broken[:count], 1):
        yield measured + (f" ({more} more failed)" if more and number == count else "") + words


def _name_near(result: ResultDocument) -> Iterator[str]:
    """Yield the names of passed checks that are near their limits."""
    near = sorted(
        (check for check in result.checks if check.passed and _ratio_to_limit(check) >= NEAR_LIMIT_RATIO),
        key=_ratio_to_limit,
        reverse=True,
    )
    for check in near[:MAX_NEAR_CHECKS]:
        words = words_of(check)
        yield f"near its limit: {_value_and_limit(check)}" + ("" if words is None else f" (beyond it: {words.means})")


def _value_and_limit(check: CheckEntry) -> str:
    unit = "" if check.unit == "1" else f" {check.unit}"
    value = "not measured" if check.value is None else f"{check.value:.3g}{unit}"
    return f"{check.name}: {value}, " + (
        "no limit is set" if check.limit is None else f"allowed {check.limit:.3g}{unit}"
    )


def _ratio_to_limit(check: CheckEntry) -> float:
    """Return the value divided by its limit; infinite if either is missing."""
    if check.value is None or check.limit is None:
        return float("inf")
    if check.value == 0:
        return 0.0
    return check.value / check.limit if check.limit > 0 else float("inf")


def _wrap(text: str, width: int) -> Iterator[str]:
    """Yield the text in lines; a command between backticks is not broken."""
    for line in wrap_line(text, width):
        yield line.replace("`", "")
