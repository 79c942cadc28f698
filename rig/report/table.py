"""The result as a person reads it in the terminal: whole, or what of it is asked for."""

from collections.abc import Sequence

from rich.console import Console
from rich.table import Table

from rig.data.result_file import CheckEntry, ResultDocument
from rig.report.kinds.kind import said
from rig.report.kinds.registry import kinds
from rig.station.plain_text import plain

ROUNDING = 1e-12


def print_outcome(document: ResultDocument, *, as_json: bool) -> None:
    """The document on stdout: tables for people, JSON for machines."""
    if as_json:
        print(document.text())
    else:
        print_result(document, Console(highlight=False))


def print_result(result: ResultDocument, console: Console) -> None:
    """Print what was found of each sensor with its uncertainty, kind by kind, then checks and verdict."""
    print_values(result, console)
    print_checks(result, console)
    print_verdict(result, console)


def print_values(result: ResultDocument, console: Console, sensor: str | None = None) -> None:
    """Print what was found, of one sensor alone if one is named: values, budgets, and what stands beside."""
    for kind in kinds():
        for found in kind.found(result):
            for each in said(kind.printed, found) if sensor in (None, found.sensor) else ():
                console.print(plain(each) if isinstance(each, str) else each)
        for line in kind.unsolved(result):
            console.print(plain(line))


def print_checks(result: ResultDocument, console: Console, sensor: str | None = None) -> None:
    """Print the checks sensor by sensor, those that failed first; of one sensor alone if one is named."""
    by_sensor: dict[str | None, list[CheckEntry]] = {}
    for check in result.checks:
        by_sensor.setdefault(check.means.sensor, []).append(check)
    for name, checks in by_sensor.items():
        if sensor in (None, name):
            console.print(_checks(name, checks))


def print_verdict(result: ResultDocument, console: Console) -> None:
    """Print the verdict, which is the last line of whatever ends with it."""
    console.print(f"verdict: {result.verdict.upper()}", style="bold green" if result.verdict == "pass" else "bold red")


def _checks(sensor: str | None, checks: Sequence[CheckEntry]) -> Table:
    table = Table(title=plain("checks" if sensor is None else f"checks of {sensor}"), title_justify="left")
    for heading in ("check", "value", "limit", "unit", "result"):
        table.add_column(heading, justify="right" if heading in ("value", "limit") else "left")
    for check in sorted(checks, key=lambda each: each.passed):
        name = check.name if sensor is None else check.name.removeprefix(f"{sensor}.")
        value = "not measured" if check.value is None else _number(check.value, check.limit)
        limit = "not set" if check.limit is None else f"{check.limit:.4g}"
        unit = "" if check.unit == "1" else check.unit
        table.add_row(plain(name), value, limit, plain(unit), "ok" if check.passed else "FAILED")
    return table


def _number(value: float, limit: float | None) -> str:
    """The value in print: what is below all digits of its limit is rounding, and none."""
    return "0" if limit is not None and abs(value) < ROUNDING * limit else f"{value:.4g}"
