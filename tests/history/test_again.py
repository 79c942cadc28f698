"""Everything again: which results move, which verdicts change, which certificates would have to be withdrawn."""

import csv
import io
from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path

import pytest
from sqlalchemy import text

from rig.errors import Refused
from rig.history.entered.finished_run import FinishedRun
from rig.history.recompute.recompute_journal import JOURNAL, RecomputeJournal, RecomputeQuestion
from rig.history.recompute.recompute_report import counts, recompute_csv, recompute_page
from rig.history.recompute.result_comparison import (
    Answer,
    ComparedResult,
    RecomputedResult,
    Unsolved,
    match_answers,
    pending_recordings,
)
from rig.history.recompute.selection import list_stated_results
from rig.history.store import History, Selection, open_history
from rig.report.kinds.kind_registry import history_records
from support.history.kept_recordings import certify
from support.history.past_runs import BIAS_RAD_S, SCALE, STD, finish_run

QUESTION = RecomputeQuestion("1", ("reckoning=2",), None)
U = 2 * STD[0]  # of a scale factor


@pytest.fixture
def history(tmp_path: Path) -> Iterator[History]:
    with open_history(str(tmp_path / "history.sqlite")) as opened:
        yield opened


def given(run: FinishedRun, verdict: str = "pass") -> RecomputedResult:
    return RecomputedResult(verdict, (), history_records(run.document))


def again(history: History, answers: Sequence[tuple[FinishedRun, Answer]], of_u: float = 0.1) -> list[ComparedResult]:
    by_key = {run.content_sha256: answer for run, answer in answers}
    return list(match_answers(list_stated_results(history, Selection()), by_key, of_u).compared)


def scaled(by: float) -> Sequence[float]:
    return (SCALE[0] + by, *SCALE[1:])


@pytest.mark.slow
def test_what_the_recordings_give_as_it_was_stated_is_not_looked_at(history: History) -> None:
    run = finish_run(0)
    history.enter(run)
    certify(history, run, "RIG-1")
    (found,) = again(history, [(run, given(run))])
    assert found.same and not found.withdrawn and not found.unconfirmed
    assert all(move.size == 0 for move in found.moves[1])


@pytest.mark.slow
@pytest.mark.parametrize(("by", "of_u", "moved"), [(0.4 * U, 0.5, ()), (0.6 * U, 0.5, (1,)), (-0.6 * U, 0.5, (1,))])
def test_a_value_moves_by_its_part_of_the_stated_u(
    by: float, of_u: float, moved: tuple[int, ...], history: History
) -> None:
    run = finish_run(0)
    history.enter(run)
    certify(history, run, "RIG-1")
    (found,) = again(history, [(run, given(finish_run(0, scaled(by))))], of_u)
    assert found.moved == moved and [each.number for each in found.withdrawn] == ["RIG-1"] * len(moved)
    largest = found.moves[1][0]
    assert largest.before.name == "kx" and largest.shift == pytest.approx(abs(by) / U)


def test_a_u_that_was_too_small_and_a_value_that_is_gone_are_moves_too(history: History) -> None:
    run = finish_run(0)
    history.enter(run)
    (calibration,) = history_records(run.document)
    wider = tuple(
        replace(parameter, std_statistical=1.5 * parameter.std_statistical) for parameter in calibration.parameters
    )
    for parameters, size in ((wider, 0.5), (calibration.parameters[1:], float("inf")), ((), float("inf"))):
        (found,) = again(history, [(run, RecomputedResult("pass", (), (replace(calibration, parameters=parameters),)))])
        assert found.moved == (1,) and found.moves[1][0].size == pytest.approx(size)
    narrower = tuple(
        replace(parameter, std_statistical=0.5 * parameter.std_statistical) for parameter in calibration.parameters
    )
    (found,) = again(history, [(run, RecomputedResult("pass", (), (replace(calibration, parameters=narrower),)))])
    assert found.same


@pytest.mark.parametrize(
    ("answer", "withdrawn", "unconfirmed"),
    [
        (Unsolved("refused", "a stuck axis"), 1, 0),
        (Unsolved("unjudged", "it has no limits"), 0, 1),
        (Unsolved("missing", "the folder is gone"), 0, 1),
        (Unsolved("damaged", "another SHA-256"), 0, 1),
        (Unsolved("lost", "its worker died"), 0, 1),
        (None, 0, 1),
    ],
)
def test_a_certificate_falls_with_what_the_method_refuses_and_is_unconfirmed_by_what_nobody_solved(
    answer: Answer | None, withdrawn: int, unconfirmed: int, history: History
) -> None:
    run = finish_run(0)
    history.enter(run)
    certify(history, run, "RIG-1")
    (found,) = again(history, [] if answer is None else [(run, answer)])
    assert (len(found.withdrawn), len(found.unconfirmed)) == (withdrawn, unconfirmed) and not found.same


@pytest.mark.slow
def test_certificates_that_are_marked_or_replaced_are_not_withdrawn_once_more(history: History) -> None:
    run = finish_run(0)
    history.enter(run)
    certify(history, run, "RIG-1")
    certify(history, run, "RIG-2", replaces="RIG-1")
    certify(history, run, "RIG-3", marks="Simulated laboratory: no real item was calibrated")
    (found,) = again(history, [(run, given(run, "fail"))])
    assert found.verdict_changed and [each.number for each in found.withdrawn] == ["RIG-2"]


@pytest.mark.slow
def test_a_replaced_result_is_solved_again_only_where_a_certificate_relies_on_it(history: History) -> None:
    first, later = finish_run(0, solved_after_s=60), finish_run(0, scaled(U), solved_after_s=3600)
    history.enter(first)
    history.enter(later)
    assert [result.run_id for result in list_stated_results(history, Selection())] == [2]
    certify(history, first, "RIG-1")
    assert [(result.run_id, len(result.calibrations)) for result in list_stated_results(history, Selection())] == [
        (1, 1),
        (2, 1),
    ]


@pytest.mark.slow
def test_what_was_voided_does_not_count_and_a_selection_is_heeded(history: History) -> None:
    for day in range(3):
        history.enter(finish_run(day, serial_number=f"G-{day}"))
    history.void(2, "it was dropped")
    assert [result.run_id for result in list_stated_results(history, Selection())] == [1, 3]
    assert [result.run_id for result in list_stated_results(history, Selection(serial_number="G-2"))] == [3]
    assert [result.run_id for result in list_stated_results(history, Selection(serial_number="G-1"))] == []


def test_the_journal_gives_the_same_numbers_back_and_forgets_what_a_kill_left_half_written(tmp_path: Path) -> None:
    answer = given(finish_run(0, (1 / 3, 0.1, 1e-7), BIAS_RAD_S))
    with RecomputeJournal(tmp_path, QUESTION) as journal:
        journal.note("one", answer)
        journal.note("two", Unsolved("missing", "the folder is gone"))
    whole = (tmp_path / JOURNAL).read_bytes()
    (tmp_path / JOURNAL).write_bytes(whole + b'{"key": "three", "gi')
    with RecomputeJournal(tmp_path, QUESTION) as journal:
        assert journal.solved == {"one": answer}
    assert (tmp_path / JOURNAL).read_bytes() == whole


def test_answers_to_another_question_are_not_mixed(tmp_path: Path) -> None:
    with RecomputeJournal(tmp_path, QUESTION):
        pass
    for other in (replace(QUESTION, estimator="newton"), replace(QUESTION, rig_version="2")):
        with pytest.raises(Refused, match="another_question"):
            RecomputeJournal(tmp_path, other)


@pytest.mark.slow
def test_what_is_solved_is_not_solved_again_and_what_is_not_is_tried_again(history: History) -> None:
    runs = [finish_run(day) for day in range(3)]
    for run in runs:
        history.enter(run)
    stated = list_stated_results(history, Selection())
    solved: dict[str, Answer] = {
        runs[0].content_sha256: given(runs[0]),
        runs[1].content_sha256: Unsolved("damaged", "another SHA-256"),
    }
    assert [each.run_id for each in pending_recordings(stated, solved)] == [2, 3]


@pytest.mark.slow
def test_the_report_says_all_in_csv_and_what_is_to_be_looked_at_on_the_page(history: History) -> None:
    run, hostile = finish_run(0), finish_run(1, serial_number="=<b>G-2</b>")
    for each in (run, hostile):
        history.enter(each)
    certify(history, hostile, "RIG-1")
    answers: dict[str, Answer] = {
        run.content_sha256: given(run),
        hostile.content_sha256: RecomputedResult(
            "fail", ("gyro.scale_std",), history_records(finish_run(1, scaled(U)).document)
        ),
    }
    outcome = match_answers(list_stated_results(history, Selection()), answers, 0.1)
    rows = list(csv.DictReader(io.StringIO(recompute_csv(outcome))))
    assert [(row["calibration"], row["state"], row["verdict"], row["verdict_now"], row["moved"]) for row in rows] == [
        ("1", "solved", "pass", "pass", "False"),
        ("2", "solved", "pass", "fail", "True"),
    ]
    assert float(rows[1]["shift_over_u"]) == pytest.approx(1.0) and rows[1]["parameter"] == "kx"
    assert rows[1]["serial_number"] == "'=<b>G-2</b>" and rows[1]["certificates_to_withdraw"] == "RIG-1"
    page = recompute_page(outcome, QUESTION, "history.sqlite")
    assert "pass, now fail (gyro.scale_std)" in page and "&lt;b&gt;G-2" in page and "<b>" not in page
    assert ">G-1<" not in page and "RIG-1" in page
    assert list(counts(outcome)) == [
        "2 results: 2 solved",
        "calibrations that moved by more than 0.1 U: 1; verdicts that changed: 1; certificates to withdraw: 1",
    ]


def replicated(history: History, run: FinishedRun, count: int) -> None:
    """As many runs as `count`, all like the one, which is entered: rows of an index alone, no journal of them."""
    history.enter(run)
    numbers = f"WITH RECURSIVE n(i) AS (SELECT 2 UNION ALL SELECT i + 1 FROM n WHERE i < {count}) "
    other = {"content_sha256": "printf('%064d', i)", "measurement_sha256": "printf('%064d', i)", "result": "'{}'"}
    keys = {
        "run": "id",
        "location": "run_id",
        "recording": "run_id",
        "calibration": "run_id",
        "parameter": "calibration_id",
    }
    with history.engine.begin() as connection:
        for table, key in keys.items():
            columns = [row[1] for row in connection.execute(text(f"PRAGMA table_info({table})"))]
            of = {**(other if table == "run" else {}), key: "i", "id": "i"}
            taken = ", ".join(of.get(name, name) for name in columns)
            connection.execute(text(f"INSERT INTO {table} {numbers} SELECT {taken} FROM n, {table} WHERE {key} = 1"))


@pytest.mark.thorough
@pytest.mark.slow
def test_ten_thousand_results_are_planned_in_a_handful_of_questions(history: History, tmp_path: Path) -> None:
    replicated(history, finish_run(0), 10_000)
    stated = list_stated_results(history, Selection())
    assert len(stated) == 10_000 and len({each.content_sha256 for each in stated}) == 10_000
    assert all(len(each.calibrations) == len(each.recordings) == len(each.places) == 1 for each in stated)
    answer = given(finish_run(0))
    with RecomputeJournal(tmp_path, QUESTION) as journal:
        for each in stated[:4000]:
            journal.note(each.content_sha256, answer)
    with RecomputeJournal(tmp_path, QUESTION) as journal:
        left = pending_recordings(stated, journal.solved)
        assert [each.run_id for each in left] == [each.run_id for each in stated[4000:]]
        outcome = match_answers(stated, journal.solved)
    assert (outcome.solved, outcome.unreached, outcome.moved) == (4000, 6000, 0)
    assert recompute_csv(outcome).count("\n") == 10_001
