"""The result at the terminal: all of it, or selected parts."""

import shlex
import sys
from collections.abc import Sequence
from pathlib import Path

from rich.console import Console
from rich.table import Table

from rig.data.result_file import CheckEntry, ResultDocument
from rig.data.run_folder import CERTIFICATE
from rig.report.entries.omission_entries import omission_lines
from rig.report.findings.characteristic import Term, terms
from rig.report.findings.result_kind import outlet_items
from rig.report.kinds.kind_registry import kinds
from rig.report.terminal.run_summary import ending
from rig.report.terminal.whole_words import fit_words
from rig.report.words.expanded_uncertainty import factor_words
from rig.report.words.mounting_words import mount_lines
from rig.report.words.printed_values import plus_minus
from rig.station.plain_text import plain, say

ROUNDING = 1e-12
ALL_OF_IT = "the same command with --all"


def print_outcome(document: ResultDocument, *, as_json: bool, whole: bool = False, folder: Path | None = None) -> None:
    """Print a result that is not stored: as JSON for machines, for people in short or, if `whole`, with all tables.

    `folder` is the folder of its run, which remedies name.
    """
    console = Console(highlight=False)
    if as_json:
        print(document.text())
    elif whole:
        print_result(document, console)
    else:
        lines = ending(document, folder=folder, everything=ALL_OF_IT, certificate=None, since=(), width=console.width)
        _print_ending([*lines], document, console)


def print_kept(folder: Path, document: ResultDocument, since: Sequence[str] = (), *, as_json: bool = False) -> None:
    """Print the result of the finished run in `folder`, in short or as JSON.

    `since`: lines that compare the result with the last calibrations.
    """
    if as_json:
        print(document.text())
        for line in since:  # the JSON does not contain these lines
            say(line.replace("`", ""), sys.stderr)
        return
    console, certificate = Console(highlight=False), folder / CERTIFICATE
    lines = ending(
        document,
        folder=folder,
        everything=f"rig show {shlex.quote(str(folder))} --all",
        certificate=certificate if certificate.is_file() else None,
        since=since,
        width=console.width,
    )
    _print_ending([*lines], document, console)


def _print_ending(lines: Sequence[str], document: ResultDocument, console: Console) -> None:
    for line in lines[:-1]:
        console.print(plain(line), soft_wrap=True)
    print_verdict(document, console)


def print_result(result: ResultDocument, console: Console) -> None:
    """Print the results of each sensor with their uncertainties, kind by kind, then checks and verdict."""
    print_values(result, console)
    print_checks(result, console)
    print_verdict(result, console)


def print_values(result: ResultDocument, console: Console, sensor: str | None = None) -> None:
    """Print values, budgets and further results, of all sensors or of one."""
    for kind in kinds():
        for finding in kind.find(result):
            if sensor not in (None, finding.sensor):
                continue
            for item in (
                *outlet_items(kind.printed, finding),
                *map(_term_line, terms(kind.characteristics, finding, "terminal")),
            ):
                if isinstance(item, Table):
                    console.print(fit_words(item, console.width))
                else:
                    console.print(plain(item))
        for line in kind.unsolved(result):
            console.print(plain(line))
    for line in (*mount_lines(result), *omission_lines(result, sensor)):
        console.print(plain(line))


def _term_line(term: Term) -> str:
    """Return a characteristic in one line, each number ± U."""
    unit = "" if term.units.shown.name == "1" else f" {term.units.shown.name}"
    numbers = "  ".join(f"{label} {plus_minus(value, u)}".lstrip() for label, value, u in term.printed)
    return f"{term.name}: {numbers}{unit} (U, {factor_words(term.numbers.dof)})"


def print_checks(result: ResultDocument, console: Console, sensor: str | None = None) -> None:
    """Print the checks of all sensors or of one, sensor by sensor, those with failed checks first."""
    by_sensor: dict[str | None, list[CheckEntry]] = {}
    for check in sorted(result.checks, key=lambda check: check.passed):
        by_sensor.setdefault(check.means.sensor, []).append(check)
    for name, checks in by_sensor.items():
        if sensor in (None, name):
            console.print(fit_words(_checks(name, checks), console.width))


def print_verdict(result: ResultDocument, console: Console) -> None:
    """Print the verdict as the last line of a result."""
    console.print(f"verdict: {result.verdict.upper()}", style="bold green" if result.verdict == "pass" else "bold red")


def _checks(sensor: str | None, checks: Sequence[CheckEntry]) -> Table:
    table = Table(title=plain("checks" if sensor is None else f"checks of {sensor}"), title_justify="left")
    for heading in ("check", "value", "limit", "unit", "result"):
        table.add_column(heading, justify="right" if heading in ("value", "limit") else "left")
    for check in checks:
        name = check.name if sensor is None else check.name.removeprefix(f"{sensor}.")
        value = "not measured" if check.value is None else _number(check.value, check.limit)
        limit = "not set" if check.limit is None else f"{check.limit:.4g}"
        unit = "" if check.unit == "1" else check.unit
        table.add_row(plain(name), value, limit, plain(unit), "ok" if check.passed else "FAILED")
    return table


def _number(value: float, limit: float | None) -> str:
    """Return the printed value; a value smaller than the limit's last digit reads 0."""
    return "0" if limit is not None and abs(value) < ROUNDING * limit else f"{value:.4g}"
