"""A history: what is entered is found again, nothing is lost, nothing occurs twice, nothing is taken away."""

import json
import os
import sqlite3
from collections.abc import Iterator
from contextlib import closing
from dataclasses import replace
from datetime import timedelta
from pathlib import Path

import numpy as np
import pytest
from sqlalchemy import URL, event, text

from rig.config.judging.judging_sections import HistorySection
from rig.config.load import ConfigurationRefused, load
from rig.data.result_file import read_result
from rig.errors import Refused
from rig.estimation.gyroscope.budget import Budget, Contributor
from rig.history.entered.finished_run import FinishedRun, compact, content_sha256, read_finished_run
from rig.history.entered.issued_certificate import IssuedCertificate
from rig.history.series import Trend, changes_between, effects, rig_states, subjects, trends
from rig.history.storage import schema
from rig.history.storage.address import choose_history_address, resolve_address
from rig.history.storage.engine import engine_of
from rig.history.store import History, Selection, open_history
from rig.report.entries.budget import budget_entry
from rig.report.kinds.kind_registry import history_records
from support.history.past_runs import FIRST, finish_run
from support.paths import DEMO, RECORDINGS

ISSUED = IssuedCertificate(
    "RIG-20250106-AAAAAAAAAAAA", "Calibration certificate", "2025-01-06", None, "", (("certificate.html", "ab" * 32),)
)


@pytest.fixture
def history(tmp_path: Path) -> Iterator[History]:
    with open_history(str(tmp_path / "history.sqlite")) as opened:
        yield opened


@pytest.mark.slow
def test_a_run_is_found_again_with_all_its_numbers(history: History) -> None:
    run = read_finished_run(RECORDINGS / "verified")
    entered = history.enter(run)
    assert entered.new
    (kept,) = history.kept()
    assert kept.result == run.text and content_sha256(kept.result) == kept.content_sha256
    assert [recording.name for recording in kept.recordings] == ["run.h5", "verify.h5"]
    found = history.select_run(entered.run_id)
    stated = history_records(read_result(RECORDINGS / "verified"))
    assert [(f.part, f.serial_number, f.estimator, f.temperature_c) for f in found] == [
        (s.part, s.serial_number, s.estimator, s.temperature_c) for s in stated
    ]
    assert [set(each.parameters.values()) for each in found] == [set(each.parameters) for each in stated]


def test_the_mean_scale_factor_has_the_uncertainty_of_all_three() -> None:
    sensor = read_result(RECORDINGS / "verified").gyroscopes["gyro"]
    mean = {
        parameter.name: parameter for parameter in history_records(read_result(RECORDINGS / "verified"))[0].parameters
    }["k"]
    assert mean.value == pytest.approx(sum(sensor.scale) / 3)
    variance = sum(sensor.covariance[i][j] for i in range(3) for j in range(3)) / 9
    assert mean.std_statistical == pytest.approx(variance**0.5)


@pytest.mark.slow
def test_the_same_run_again_adds_nothing_but_the_place_it_lies_in_now(history: History) -> None:
    first = history.enter(finish_run(0))
    moved = finish_run(0, solved_after_s=3600)  # solved again, with the same numbers
    again = history.enter(moved)
    assert (again.run_id, again.new) == (first.run_id, False)
    assert len(history.calibrations()) == 1
    (kept,) = history.kept()
    assert kept.places == (("bench", "/runs/0"),)


@pytest.mark.slow
def test_a_result_of_the_same_recordings_replaces_the_one_before(history: History) -> None:
    """In series; it stays in the history."""
    history.enter(finish_run(0, (1.02, 1.02, 1.02), solved_after_s=3600))
    history.enter(finish_run(0, (1.01, 1.01, 1.01), solved_after_s=60))  # entered later, solved earlier
    (counted,) = history.calibrations()
    assert counted.value("kx") == 1.02
    assert [history.calibration(number).value("kx") for number in (1, 2)] == [1.02, 1.01]


@pytest.mark.slow
def test_u_in_a_history_and_its_comparisons_are_those_that_the_results_state(history: History) -> None:
    def scarce(day: float, bias_rad_s: float, dof: float) -> FinishedRun:
        run = finish_run(day, bias_rad_s=(bias_rad_s, 0.0, 0.0))
        sensor = run.document.gyroscopes["gyro"]
        line = Contributor("noise", "A", "normal", None, "", "", dof, np.array(sensor.covariance))
        found = {"budget": budget_entry(Budget((line,))), "covariance_combined": sensor.covariance}
        document = run.document.model_copy(update={"gyroscopes": {"gyro": sensor.model_copy(update=found)}})
        return replace(run, document=document, text=compact(json.loads(document.text())))

    u = 2e-5
    history.enter(scarce(0, 0.01, np.inf))
    history.enter(scarce(1, 0.01 + 3.2 * u, 5.0))
    before, now = history.calibrations()
    assert before.parameters["bx"].expanded == pytest.approx(2 * u)
    assert now.parameters["bx"].expanded == pytest.approx(2.649 * u, rel=1e-3)
    (change,) = (each for each in changes_between([before], [now])[now.subject] if each.name == "bx")
    assert change.normalised_error == pytest.approx(3.2 / np.hypot(2, 2.649), rel=1e-3) and not change.has_changed
    assert (change.before.dof, change.now.dof) == (np.inf, 5.0)
    assert now.parameters["k"].coverage_factor == now.parameters["kx"].coverage_factor
    assert list(history.broken()) == []


@pytest.mark.slow
def test_a_voided_calibration_stands_there_with_its_reason_and_counts_no_more(history: History) -> None:
    history.enter(finish_run(0))
    history.enter(finish_run(1))
    history.void(1, "wrong serial number")
    found = history.calibrations()
    assert [each.voided for each in found] == ["wrong serial number", None]
    assert [[each.id for each in series] for series in subjects(found).values()] == [[2]]
    with pytest.raises(Refused, match="already_voided"):
        history.void(1, "again")
    with pytest.raises(Refused, match="not_in_history"):
        history.void(99, "there is none")


def test_a_measurement_that_failed_its_own_checks_is_no_part_of_a_series(history: History) -> None:
    history.enter(finish_run(0, passed=False))
    (found,) = history.calibrations()
    assert not found.fit
    assert subjects([found]) == {}


@pytest.mark.slow
def test_calibrations_are_found_by_sensor_day_and_rig(history: History) -> None:
    history.enter(finish_run(9, serial_number="G-1", rig="bench A"))
    history.enter(finish_run(3, serial_number="G-2", rig="bench B"))
    history.enter(finish_run(5, serial_number="G-1", rig="bench B"))

    def days(selection: Selection) -> list[int]:
        return [round(float((trend.times[0] - FIRST).days)) for trend in first_trends(history, selection)]

    assert days(Selection()) == [3, 5, 9]
    assert days(Selection(serial_number="G-1")) == [5, 9]
    assert days(Selection(since=(FIRST + timedelta(days=5)).date())) == [5, 9]
    assert days(Selection(rig="bench B")) == [3, 5]
    assert days(Selection(rig="arm of bench A")) == [9]
    assert days(Selection(part="kvh1775")) == []


def first_trends(history: History, selection: Selection) -> list[Trend]:
    return [next(iter(trends([past]).values())) for past in history.calibrations(selection)]


def test_one_sensor_among_many_is_looked_up_not_searched_for(history: History) -> None:
    question = "EXPLAIN QUERY PLAN SELECT id FROM calibration WHERE serial_number = 'G-1'"
    with history.engine.connect() as connection:
        plan = " ".join(str(row) for row in connection.execute(text(question)))
    assert "calibration_of_serial_number" in plan and "SCAN" not in plan


@pytest.mark.parametrize("marked", [True, False])
def test_a_history_from_before_version_1_is_refused_and_stays_as_it_was(marked: bool, tmp_path: Path) -> None:
    file = tmp_path / "history.sqlite"
    with closing(sqlite3.connect(file)) as old:
        old.executescript(
            "CREATE TABLE meta (key VARCHAR(40) NOT NULL PRIMARY KEY, value VARCHAR(400));"
            "INSERT INTO meta VALUES ('version', '1');"
            "CREATE TABLE run (id INTEGER PRIMARY KEY, result TEXT NOT NULL);"
            f"PRAGMA application_id = {schema.APPLICATION_ID * marked};"
        )
    before = file.read_bytes()
    with pytest.raises(Refused, match=r"history_too_old: .*rig history import"), open_history(str(file)):
        pass
    assert file.read_bytes() == before


@pytest.mark.slow
def test_who_ran_the_rig_and_what_was_noted_is_found_again(history: History) -> None:
    history.enter(replace(finish_run(0), operator="A. Person", note="after the move to room 3"))
    history.enter(finish_run(1))
    found = [(calibration.operator, calibration.note) for calibration in history.calibrations()]
    assert found == [("A. Person", "after the move to room 3"), (None, None)]


@pytest.mark.slow
def test_a_certificate_is_entered_once_by_its_number_and_with_every_file_it_was_written_to(history: History) -> None:
    run = replace(finish_run(0), certificate=ISSUED)
    first = history.enter(run)
    assert not history.enter(run).new
    later = replace(ISSUED, files=(("certificate.pdf", "cd" * 32),))
    amended = replace(ISSUED, number="RIG-20250106-BBBBBBBBBBBB", replaces=ISSUED.number, files=())
    for each in (later, later, amended):
        assert history.certify(run.content_sha256, each)
    (kept,) = history.kept(first.run_id)
    assert kept.certificates == (replace(ISSUED, files=(*ISSUED.files, *later.files)), amended)
    assert not history.certify("0" * 64, ISSUED)  # of a run nobody entered


@pytest.mark.slow
def test_rows_are_only_added(history: History) -> None:
    """What a role may do that can neither change nor remove anything (docs/how-to/finished-runs/shared-history.md)."""
    said: list[str] = []
    event.listen(history.engine, "before_cursor_execute", lambda *each: said.append(each[2].split()[0].upper()))
    run = replace(finish_run(0), certificate=ISSUED, operator="A. Person")
    history.enter(run)
    history.enter(run)
    history.certify(run.content_sha256, replace(ISSUED, files=(("certificate.pdf", "cd" * 32),)))
    history.void(1, "to see what it takes")
    assert "INSERT" in said and set(said) <= {"SELECT", "INSERT", "BEGIN"}


@pytest.mark.slow
def test_a_history_of_a_newer_program_is_refused_and_not_touched(tmp_path: Path) -> None:
    file = tmp_path / "history.sqlite"
    with open_history(str(file)) as history:
        history.enter(finish_run(0))
    other = sqlite3.connect(file)
    other.execute("UPDATE meta SET value = ? WHERE key = 'schema_version'", [str(schema.VERSION + 1)])
    other.commit()
    with pytest.raises(Refused, match=rf"history_too_new: .*version {schema.VERSION + 1}"), open_history(str(file)):
        pass
    assert other.execute("SELECT count(*) FROM run").fetchone() == (1,)
    other.close()


def test_what_is_no_history_is_not_made_one(tmp_path: Path) -> None:
    file = tmp_path / "mail.sqlite"
    other = sqlite3.connect(file)
    other.execute("CREATE TABLE letters (id INTEGER)")
    other.commit()
    other.close()
    with pytest.raises(Refused, match=r"not_a_history: .*another kind of database"), open_history(str(file)):
        pass
    words = tmp_path / "words.txt"
    words.write_text("no database at all, but long enough to be looked at\n" * 100, encoding="utf-8")
    with pytest.raises(Refused, match=r"not_a_history: .*not an SQLite database"), open_history(str(words)):
        pass


def test_a_history_is_in_the_user_s_folder_unless_somebody_says_otherwise(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("XDG_DATA_HOME", "/somewhere/share")
    usual = choose_history_address(HistorySection(), {})
    assert usual is not None and usual.where == Path("/somewhere/share/calibration-rig/history.sqlite")
    said = choose_history_address(HistorySection(url="/data/rig.sqlite"), {})
    assert said is not None and said.where == Path("/data/rig.sqlite")
    told = choose_history_address(HistorySection(url="/data/rig.sqlite"), {"RIG_HISTORY": "/tmp/other.sqlite"})
    assert told is not None and told.where == Path("/tmp/other.sqlite")
    assert choose_history_address(HistorySection(off=True), {}) is None
    assert choose_history_address(HistorySection(off=True), {"RIG_HISTORY": "/tmp/other.sqlite"}) is None
    assert choose_history_address(HistorySection(), {"RIG_HISTORY": "off"}) is None


def test_a_password_is_not_told_and_not_taken_from_a_file_that_recordings_keep() -> None:
    secret = resolve_address("postgresql://rig:secret@lab/history")
    assert isinstance(secret.where, URL) and secret.where.password == "secret" and "secret" not in secret.label
    for url in ("postgresql://rig:secret@lab/history", "postgresql://lab/history?password=secret", "mysql://lab/x"):
        with pytest.raises(ConfigurationRefused) as refused:
            load(DEMO, [f"history.url={url}"])
        assert "password" in str(refused.value) or "must be a file or begin with" in str(refused.value)
    assert load(DEMO, ["history.url=postgresql://rig@lab/history"]).config.history.url is not None


def test_a_server_that_is_not_there_is_named(tmp_path: Path) -> None:
    with pytest.raises(Refused, match="history_unreachable"), open_history(f"postgresql://rig@/x?host={tmp_path}"):
        pass
    with pytest.raises(Refused, match="history_address"):
        engine_of(resolve_address("nonsense://x"))


@pytest.mark.slow
def test_what_has_changed_is_named(history: History) -> None:
    history.enter(finish_run(0))
    history.enter(finish_run(30, (1.01 + 4e-4, 0.99, 1.0)))
    before, now = history.calibrations()
    assert [each.name for each in changes_between([before], [now])[now.subject] if each.has_changed] == ["k", "kx"]


@pytest.mark.slow
def test_a_sensor_s_drift_and_recall_come_out_of_its_history(history: History) -> None:
    for i in range(10):
        history.enter(finish_run(30 * i, (1.01 + 1e-5 * 30 * i, 0.99, 1.0)))
    (series,) = subjects(history.calibrations(Selection(serial_number="G-1"))).values()
    found = trends(series)
    assert found["kx"].line is not None and found["kx"].drifts and not found["kz"].drifts
    assert found["kx"].line.coefficients[1] == pytest.approx(1e-5, rel=1e-6)
    limit = found["kx"].last.max_deviation
    assert limit is not None and found["kx"].recall is not None
    reached = FIRST + timedelta(days=(limit - 0.01) / 1e-5)
    assert abs((found["kx"].recall - reached.date()).days) < 30
    assert found["bx"].recall is None  # the result states no limit for it


@pytest.mark.slow
def test_a_limit_stands_beside_its_parameter_whatever_its_check_is_called(history: History) -> None:
    entered = finish_run(0)
    (scale,) = (check for check in entered.document.checks if check.means.parameter == "scale")
    said = {"name": "gyro.k_minus_1", "kind": "conformity", "sensor": "gyro", "quantity": "rate", "parameter": "scale"}
    beyond = scale.model_copy(update={**said, "limit": 0.005, "passed": False})
    document = entered.document.model_copy(update={"checks": (beyond,)})
    history.enter(replace(entered, document=document, text=compact(json.loads(document.text()))))
    (found,) = history.calibrations()
    assert found.fit, "a value beyond its limit is a result like any other"
    assert (found.parameters["kx"].max_deviation, found.parameters["bx"].max_deviation) == (0.005, None)


@pytest.mark.slow
def test_check_standards_chart_their_rig_and_shared_sensors_tell_rigs_apart(history: History) -> None:
    """Two sensors watch rig A, whose clock jumps by 300 ppm; B calibrates them too, 40 ppm off."""
    scatter = [((7 * i) % 11 - 5) * 8e-6 for i in range(24)]
    for i, each in enumerate(scatter):
        for serial_number, later in (("G-1", 0.0), ("G-2", 0.2)):
            for rig, factor in (("bench A", 1 + 3e-4 * (i >= 20)), ("bench B", 1 + 4e-5)):
                scale = tuple(factor * k + each for k in (1.01, 0.99, 1.0))
                run = finish_run(
                    i + later, scale, serial_number=serial_number, rig=rig, check_standard=rig == "bench A"
                )
                history.enter(run)
    states = {state.rig: state for state in rig_states(history.calibrations())}
    assert states["bench A"].charts["k"].out_of_control
    assert not states["bench B"].charts["k"].alarm.any()
    assert states["bench A"].standards == ("G-1", "G-2")
    quiet = [
        calibration
        for calibration in history.calibrations()
        if calibration.started_utc < (FIRST + timedelta(days=20)).isoformat()
    ]
    (effect,) = effects(quiet)["k"]
    sign = 1 if effect.rig == "bench B" else -1
    assert abs(sign * effect.value - 4e-5) < 3 * effect.std < 4e-5


@pytest.mark.slow
def test_a_history_that_may_only_be_read_is_read_and_nothing_is_laid_beside_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """In somebody else's folder, or on a medium that takes no more."""
    file = tmp_path / "history.sqlite"
    with open_history(str(file)) as history:
        history.enter(read_finished_run(RECORDINGS / "verified"))
    before = file.read_bytes()
    monkeypatch.setattr(os, "access", lambda *_: False)  # root may write everywhere
    with open_history(str(file)) as history:
        assert [*tmp_path.iterdir()] == [file] and len(history.calibrations()) == 2 and not [*history.broken()]
    with pytest.raises(Refused, match=r"history_unreachable: .* readonly database"), open_history(str(file)) as history:
        history.void(1, "no reason")
    assert [*tmp_path.iterdir()] == [file] and file.read_bytes() == before


@pytest.mark.slow
def test_a_history_that_is_only_read_while_another_writes_it_is_as_that_one_left_it(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    file = tmp_path / "history.sqlite"
    with open_history(str(file)):
        pass
    with closing(sqlite3.connect(file)) as another:
        another.execute("SELECT count(*) FROM run").fetchall()  # who has it open too, so that the log stays
        with open_history(str(file)) as written:
            written.enter(read_finished_run(RECORDINGS / "verified"))
        assert file.with_name(f"{file.name}-wal").stat().st_size > 0
        monkeypatch.setattr(os, "access", lambda *_: False)
        with open_history(str(file)) as history:
            assert len(history.calibrations()) == 2
