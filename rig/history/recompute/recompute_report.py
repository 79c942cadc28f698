"""Reports of a recomputation: CSV for machines, a page of notable results, and a summary for a terminal."""

import csv
import io
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from rig.history.documents import cell
from rig.history.entered.issued_certificate import IssuedCertificate
from rig.history.recompute.recompute_journal import RecomputeQuestion
from rig.history.recompute.result_comparison import (
    ComparedResult,
    ParameterMove,
    RecomputedResult,
    RecomputeOutcome,
    Unsolved,
)
from rig.history.store import Past
from rig.history.terminal.fitting_table import FittingTable, TableColumn
from rig.history.terminal.history_tables import value_text
from rig.report.words.printed_values import figures

CSV, PAGE = "recomputed.csv", "recomputed.html"
COLUMNS = (
    "run", "calibration", "started_utc", "rig", "part", "serial_number", "quantity", "state", "why", "verdict",
    "verdict_now", "failed_now", "moved", "parameter", "unit", "before", "before_expanded", "now", "now_expanded",
    "shift_over_u", "growth_over_u", "certificates_to_withdraw", "certificates_unconfirmed", "omitted", "folder",
)  # fmt: skip
STATE_WORDS = {
    "refused": "refused by today's method",
    "unjudged": "without the requested setting or estimator",
    "missing": "missing",
    "damaged": "damaged",
    "lost": "lost with a worker",
    "failed": "failed",
}


def recompute_csv(outcome: RecomputeOutcome) -> str:
    """Return CSV with a line for each calibration (its most changed parameter) and for each run that has none."""
    out = io.StringIO(newline="")
    writer = csv.DictWriter(out, COLUMNS, lineterminator="\n", restval="")
    writer.writeheader()
    for comparison in outcome.compared:
        for row in _rows(comparison):
            writer.writerow({name: cell(value) for name, value in row.items() if value is not None})
    return out.getvalue()


def recompute_page(outcome: RecomputeOutcome, question: RecomputeQuestion, history: str) -> str:
    """Return HTML that loads nothing from outside: the question, the numbers, and notable results."""
    from jinja2 import Environment, FileSystemLoader, StrictUndefined

    environment = Environment(
        loader=FileSystemLoader(Path(__file__).parent),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    template = environment.get_template("recompute.html.j2")
    return template.render(
        outcome=outcome, question=question, history=history, lines=list(_lines(outcome)), counts=list(counts(outcome))
    )


def counts(outcome: RecomputeOutcome) -> Iterator[str]:
    """Yield lines that state how many results were solved and have changed, and how many certificates are affected."""
    unsolved = [f"{count} {STATE_WORDS[state]}" for state, count in sorted(outcome.unsolved.items())]
    unsolved += [f"{outcome.unreached} not reached"] if outcome.unreached else []
    yield f"{len(outcome.compared)} results: {', '.join([f'{outcome.solved} solved', *unsolved])}"
    yield (
        f"calibrations that moved by more than {figures(outcome.of_u)} U: {outcome.moved}; "
        f"verdicts that changed: {outcome.verdicts_changed}; certificates to withdraw: {len(outcome.withdrawn)}"
    )
    if outcome.unconfirmed:
        yield f"certificates unconfirmed, because their recordings were not solved: {len(outcome.unconfirmed)}"


def notable_table(outcome: RecomputeOutcome, most: int) -> FittingTable:
    """Return a table of the first notable results, at most `most` rows, in the order of time."""
    lines = list(_lines(outcome))[:most]
    columns = (
        TableColumn("number", [line["number"] for line in lines], number=True),
        TableColumn("day", [line["started"][:10] for line in lines], rank=3),
        TableColumn("serial", [line["serial"] for line in lines]),
        TableColumn("quantity", [line["quantity"] for line in lines], rank=4),
        TableColumn("verdict", [line["verdict"] for line in lines]),
        TableColumn("moved most", [line["moved"] for line in lines], rank=1),
        TableColumn("withdraw", [line["withdraw"] for line in lines], rank=2),
        TableColumn("why not solved", [line["why"] for line in lines], wraps=True, least=20),
    )
    return FittingTable("needs attention", columns)


def _lines(outcome: RecomputeOutcome) -> Iterator[dict[str, str]]:
    for comparison in outcome.notable:
        for past in comparison.stated.calibrations or (None,):
            yield _line(comparison, past)


def _line(compared: ComparedResult, past: Past | None) -> dict[str, str]:
    """Return the cells of the calibration `past` or, if `past` is None, of a result without calibrations."""
    move = _most_moved(compared, past)
    has_moved = past is not None and past.id in compared.moved
    return {
        "number": "" if past is None else str(past.id),
        "started": compared.stated.started_utc.replace("T", " ")[:16],
        "serial": "" if past is None else past.serial_number,
        "quantity": "" if past is None else past.quantity,
        "rig": compared.stated.rig,
        "verdict": _verdict(compared),
        "moved": _move_words(move) if has_moved and move is not None else "",
        "change": "" if not has_moved or move is None else _change(move),
        "withdraw": _numbers(compared.withdrawn),
        "why": f"{STATE_WORDS[compared.answer.state]}: {compared.answer.why}" if isinstance(compared.answer, Unsolved)
        else "not reached" if compared.answer is None else compared.answer.left_out or "",
    }  # fmt: skip


def _verdict(compared: ComparedResult) -> str:
    if not isinstance(compared.answer, RecomputedResult) or not compared.verdict_changed:
        return compared.stated.verdict
    by = f" ({', '.join(compared.answer.failed)})" if compared.answer.failed else ""
    return f"{compared.stated.verdict}, now {compared.answer.verdict}{by}"


def _move_words(move: ParameterMove) -> str:
    if move.now is None:
        return f"{move.before.name}: no longer in the result"
    if move.shift >= move.growth:
        return f"{move.before.name} by {figures(move.shift)} U"
    return f"U of {move.before.name} grew by {figures(move.growth)}"


def _change(move: ParameterMove) -> str:
    return value_text(move.before) + ("" if move.now is None else f" → {value_text(move.now)}") + f" {move.before.unit}"


def _numbers(certificates: tuple[IssuedCertificate, ...]) -> str:
    return ", ".join(certificate.number for certificate in certificates)


def _most_moved(compared: ComparedResult, past: Past | None) -> ParameterMove | None:
    moves = () if past is None else compared.moves.get(past.id, ())
    return moves[0] if moves else None


def _rows(compared: ComparedResult) -> Iterator[dict[str, Any]]:
    """Yield a row for each calibration of the run, or one row if it has none."""
    answer = compared.answer
    columns: dict[str, Any] = {
        "run": compared.stated.run_id,
        "started_utc": compared.stated.started_utc,
        "rig": compared.stated.rig,
        "verdict": compared.stated.verdict,
        "certificates_to_withdraw": _numbers(compared.withdrawn),
        "certificates_unconfirmed": _numbers(compared.unconfirmed),
        "folder": compared.stated.places[0][1] if compared.stated.places else None,
    }
    if isinstance(answer, RecomputedResult):
        columns |= {
            "state": "solved",
            "verdict_now": answer.verdict,
            "failed_now": ", ".join(answer.failed),
            "omitted": answer.left_out,
        }
    else:
        columns |= {"state": "unreached"} if answer is None else {"state": answer.state, "why": answer.why}
    for past in compared.stated.calibrations:
        move = _most_moved(compared, past)
        yield {
            **columns,
            "calibration": past.id,
            "part": past.part,
            "serial_number": past.serial_number,
            "quantity": past.quantity,
            **({} if not isinstance(answer, RecomputedResult) else {"moved": past.id in compared.moved}),
            **({} if move is None else _move_columns(move)),
        }
    if not compared.stated.calibrations:
        yield columns


def _move_columns(move: ParameterMove) -> dict[str, Any]:
    now = move.now
    return {
        "parameter": move.before.name,
        "unit": move.before.unit,
        "before": move.before.value,
        "before_expanded": move.before.expanded,
        **({} if now is None else {"now": now.value, "now_expanded": now.expanded}),
        "shift_over_u": move.shift,
        "growth_over_u": move.growth,
    }
