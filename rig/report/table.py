"""The result as a person reads it in the terminal."""

from collections.abc import Iterable

from rich.console import Console
from rich.table import Table

from rig.data.result_file import CheckEntry, ResultDocument
from rig.report.kinds.kind import said
from rig.report.kinds.registry import kinds
from rig.station.plain_text import plain


def print_outcome(document: ResultDocument, *, as_json: bool) -> None:
    """The document on stdout: tables for people, JSON for machines."""
    if as_json:
        print(document.text())
    else:
        print_result(document, Console(highlight=False))


def print_result(result: ResultDocument, console: Console) -> None:
    """Print what was found of each sensor with its uncertainty, kind by kind, then checks and verdict."""
    for kind in kinds():
        for found in kind.found(result):
            for each in said(kind.printed, found):
                console.print(plain(each) if isinstance(each, str) else each)
        for line in kind.unsolved(result):
            console.print(plain(line))
    console.print(_checks(result.checks))
    console.print(f"verdict: {result.verdict.upper()}", style="bold green" if result.verdict == "pass" else "bold red")


def _checks(checks: Iterable[CheckEntry]) -> Table:
    table = Table(title="checks", title_justify="left")
    for heading in ("check", "value", "limit", "unit", ""):
        table.add_column(heading, justify="right" if heading in ("value", "limit") else "left")
    for check in checks:
        value = "not measured" if check.value is None else f"{check.value:.4g}"
        limit = "not set" if check.limit is None else f"{check.limit:.4g}"
        table.add_row(plain(check.name), value, limit, plain(check.unit), "ok" if check.passed else "FAILED")
    return table
