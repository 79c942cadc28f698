"""What was entered stays as it was: the database says no, and whoever gets around that is found out."""

import json
import os
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest
from sqlalchemy import select, text
from sqlalchemy.exc import DBAPIError

from rig.cli import main
from rig.history.entered.finished_run import content_sha256, read_finished_run
from rig.history.entered.issued_certificate import IssuedCertificate
from rig.history.integrity import WRONG_STATES, examine_history
from rig.history.storage import journal, schema
from rig.history.storage.journal import Head
from rig.history.storage.sqlite_engine import WRITE_OPTION
from rig.history.storage.triggers import create_triggers
from rig.history.store import History, open_history
from rig.report.certificate.certificate_page import certificate_page
from rig.report.certificate.content import certificate_of
from rig.report.certificate.statements import folder_statements
from support.history.kept_rows import drop_triggers, forge
from support.history.past_runs import finish_run
from support.history.postgres import new_database
from support.paths import CONFIGS, RECORDINGS

ISSUED = IssuedCertificate(
    "RIG-1", "Calibration certificate", "2025-01-06", None, "", (("certificate.html", "ab" * 32),)
)
GAPS = ("run", "location", "calibration")
TABLES = [table.name for table in schema.metadata.sorted_tables]


def fill(history: History) -> None:
    history.enter(replace(finish_run(0), certificate=ISSUED, documents=(("config.yaml", "cd" * 32),)))
    history.void(1, "another sensor was mounted")


@pytest.fixture(params=["sqlite", pytest.param("postgresql", marks=pytest.mark.slow)])
def place(request: pytest.FixtureRequest, tmp_path: Path) -> str:
    if request.param == "sqlite":
        return str(tmp_path / "history.sqlite")
    return new_database(request.getfixturevalue("server"))


@pytest.mark.slow
def test_no_row_is_changed_taken_away_or_replaced(place: str) -> None:
    with open_history(place) as history:
        fill(history)
        sqlite = history.engine.dialect.name == "sqlite"
        for table in TABLES:
            column = schema.metadata.tables[table].columns.values()[-1].name
            attempts = [f"UPDATE {table} SET {column} = {column}", f"DELETE FROM {table}"]
            attempts += (
                [f"INSERT OR REPLACE INTO {table} SELECT * FROM {table}"] if sqlite else [f"TRUNCATE {table} CASCADE"]
            )
            for attempt in attempts:
                with (
                    pytest.raises(DBAPIError, match="a history keeps its rows"),
                    history.engine.connect().execution_options(**{WRITE_OPTION: True}) as connection,
                    connection.begin(),
                ):
                    connection.execute(text(attempt))
        assert list(history.broken()) == [] and history.calibration(1).voided is not None


def run_folder(folder: Path) -> Path:
    """A run with its certificate, header and configuration."""
    shutil.copytree(RECORDINGS / "verified", folder)
    shutil.copy(CONFIGS / "demo.yaml", folder / "config.yaml")
    (folder / "calibration.h").write_text("#define KX 1.01f\n", encoding="utf-8")
    document = read_finished_run(folder).document
    page = certificate_page(certificate_of(document, folder_statements(folder)))
    (folder / "certificate.html").write_text(page, encoding="utf-8")
    return folder


def append(name: str) -> Callable[[Path], None]:
    def attack(folder: Path) -> None:
        with (folder / name).open("a", encoding="utf-8") as file:
            file.write("\n# better\n")

    return attack


def another_value(folder: Path) -> None:
    result = json.loads((folder / "result.json").read_text(encoding="utf-8"))
    result["gyroscopes"]["gyro"]["scale"][0] *= 1.001
    (folder / "result.json").write_text(json.dumps(result), encoding="utf-8")


def pipe(folder: Path) -> None:
    (folder / "config.yaml").unlink()
    os.mkfifo(folder / "config.yaml")


@pytest.mark.one_in(3)
@pytest.mark.slow
@pytest.mark.parametrize(
    ("state", "name", "attack"),
    [
        ("changed", "result.json", another_value),
        ("changed", "result.json", append("result.json")),
        ("missing", "result.json", lambda folder: (folder / "result.json").unlink()),
        ("missing", "certificate.html", lambda folder: (folder / "certificate.html").unlink()),
        ("changed", "certificate.html", append("certificate.html")),
        ("changed", "calibration.h", append("calibration.h")),
        ("changed", "config.yaml", append("config.yaml")),
        ("changed", "config.yaml", pipe),
    ],
)
def test_a_file_that_is_not_what_was_entered_is_named(
    state: str, name: str, attack: Callable[[Path], None], tmp_path: Path
) -> None:
    folder = run_folder(tmp_path / "run")
    with open_history(str(tmp_path / "history.sqlite")) as history:
        history.enter(read_finished_run(folder))
        assert {each.state for each in examine_history(history)} == {"ok"}
        attack(folder)
        assert [(each.state, each.what) for each in examine_history(history) if each.state in WRONG_STATES] == [
            (state, str(folder / name))
        ]


@pytest.mark.one_in(3)
@pytest.mark.slow
@pytest.mark.parametrize(
    ("statements", "named"),
    [
        (["UPDATE parameter SET value = 2 * value WHERE name = 'kx'"], "kx 2.02, stated 1.01, of gyro"),
        (["INSERT INTO parameter SELECT calibration_id, 'k2', value, std_statistical, NULL, unit, NULL, 2 "
          "FROM parameter WHERE name = 'kx'"], "its rows have changed since their entry"),
        (["UPDATE run SET verdict = 'fail'"], "verdict is fail"),
        (["UPDATE calibration SET serial_number = 'G-9'"], "serial_number of gyro: G-9, stated G-1"),
        (["UPDATE run SET operator = 'Somebody else'"], "its rows have changed since their entry"),
        (["UPDATE calibration SET check_standard = 1"], "its rows have changed since their entry"),
        (["DELETE FROM voided"], "voided [1]: entered"),
        (["DELETE FROM certificate_file", "DELETE FROM certificate"], "certificate [1]: entered"),
        (["DELETE FROM document"], "its rows have changed since their entry"),
        (["DELETE FROM journal WHERE number = 1"], "journal 1 to 1"),
        (["UPDATE journal SET entered_utc = '2020-01-01' WHERE number = 2"], "journal 2: it does not follow"),
        (["UPDATE journal SET chain_sha256 = 'ab' WHERE number = 3"], "journal 3: it does not follow"),
    ],
)  # fmt: skip
def test_a_row_that_is_not_what_was_entered_is_named(statements: list[str], named: str, tmp_path: Path) -> None:
    file = str(tmp_path / "history.sqlite")
    with open_history(file) as history:
        fill(history)
        assert "changed" not in {each.state for each in examine_history(history)}
    forge(file, *statements)
    with open_history(file) as history:
        assert named in "\n".join(
            f"{each.what}: {each.why}" for each in examine_history(history) if each.state in WRONG_STATES
        )


@pytest.mark.slow
def test_a_journal_that_was_written_anew_or_cut_short_is_told_by_who_knows_its_end(place: str) -> None:
    with open_history(place) as history:
        assert history.head() == Head(0, "")
        fill(history)
        known = history.head()
        history.enter(finish_run(7))
        assert history.holds(known) and history.holds(history.head()) and known.number < history.head().number
        with history.engine.connect().execution_options(**{WRITE_OPTION: True}) as connection, connection.begin():
            drop_triggers(connection)
            connection.execute(text("DELETE FROM voided"))
            connection.execute(text("DELETE FROM journal"))
            for table in ("run", "location", "certificate"):
                journal.note(connection, schema.metadata.tables[table], 1)
            file = ISSUED.files[0]
            journal.note(connection, schema.certificate_file, 1, *file)
            for table in ("run", "location"):
                journal.note(connection, schema.metadata.tables[table], 2)
            create_triggers(connection)
        assert list(history.broken()) == [], "a journal that fits can be made by who may write every table"
        assert not history.holds(known)
        assert history.holds(Head(0, ""))


@pytest.mark.slow
def test_a_result_that_was_changed_with_its_own_hash_is_named(tmp_path: Path) -> None:
    file = str(tmp_path / "history.sqlite")
    run = finish_run(0)
    with open_history(file) as history:
        history.enter(run)
    other = run.text.replace("1.01", "1.02")
    forge(file, "UPDATE run SET result = ?, content_sha256 = ?", values=(other, content_sha256(other)))
    with open_history(file) as history:
        found = "\n".join(f"{each.what}: {each.why}" for each in examine_history(history) if each.state in WRONG_STATES)
    assert (
        "run [1]: its rows have changed since their entry" in found
        and "run 1, calibration 1: k 1, stated 1.00333333, of gyro" in found
    )


@pytest.mark.slow
def test_a_run_that_was_deleted_with_all_its_rows_is_named(tmp_path: Path) -> None:
    file = str(tmp_path / "history.sqlite")
    with open_history(file) as history:
        for day in range(3):
            history.enter(finish_run(day))
    without = (
        "parameter WHERE calibration_id = 2",
        *(f"{each} WHERE run_id = 2" for each in ("calibration", "location")),
    )
    gone = [f"DELETE FROM {each}" for each in (*without, "recording WHERE run_id = 2", "run WHERE id = 2")]
    forge(file, *gone)
    with open_history(file) as history:
        missing = [each.what for each in examine_history(history) if each.state == "missing" and "[" in each.what]
    assert missing == ["run [2]", "location [2]"]
    forge(file, "DELETE FROM journal WHERE kind IN ('run', 'location') AND key = '[2]'")
    with open_history(file) as history:
        assert "journal 3 to 4" in [each.what for each in examine_history(history)]


def wrong(history: History) -> list[tuple[str, str]]:
    return [(each.state, each.what) for each in examine_history(history) if each.state in WRONG_STATES]


def carried_out(history: History, *statements: str) -> None:
    with history.engine.connect().execution_options(**{WRITE_OPTION: True}) as connection, connection.begin():
        for statement in statements:
            connection.execute(text(statement))


@pytest.mark.parametrize("place", ["sqlite"], indirect=True)
@pytest.mark.parametrize(
    ("statements", "named"),
    [
        (["DROP TRIGGER run_not_changed"], ("missing", "trigger run_not_changed")),
        (["DROP TRIGGER parameter_not_replaced"], ("missing", "trigger parameter_not_replaced")),
        (["DROP TRIGGER journal_not_removed",
          "CREATE TRIGGER journal_not_removed BEFORE DELETE ON journal WHEN OLD.number < 0 BEGIN SELECT 1; END"],
         ("changed", "trigger journal_not_removed")),
    ],
)  # fmt: skip
def test_a_trigger_of_a_file_that_does_not_say_no_any_more_is_named(
    statements: list[str], named: tuple[str, str], place: str
) -> None:
    with open_history(place) as history:
        assert wrong(history) == []
        carried_out(history, *statements)
        assert wrong(history) == [named]


@pytest.mark.slow
@pytest.mark.parametrize("place", ["postgresql"], indirect=True)
def test_a_trigger_of_a_server_that_does_not_say_no_any_more_is_named(place: str) -> None:
    body = "BEGIN RETURN NULL; END"
    with open_history(place) as history:
        assert wrong(history) == []
        carried_out(history, "ALTER TABLE run DISABLE TRIGGER not_changed", "DROP TRIGGER not_removed ON meta")
        assert wrong(history) == [("missing", "trigger not_removed of meta"), ("changed", "trigger not_changed of run")]
        carried_out(
            history, f"CREATE OR REPLACE FUNCTION history_keeps_its_rows() RETURNS trigger LANGUAGE plpgsql AS '{body}'"
        )
        named = wrong(history)
        assert ("changed", "trigger not_changed of journal") in named and len(named) == len(TABLES) + 1


@pytest.mark.slow
def test_a_run_that_was_taken_away_leaves_its_numbers_though_the_journal_was_written_anew(place: str) -> None:
    with open_history(place) as history:
        for day in range(4):
            history.enter(finish_run(day))
        assert wrong(history) == []
        with history.engine.connect().execution_options(**{WRITE_OPTION: True}) as connection, connection.begin():
            drop_triggers(connection)
            for number in (2, 3):
                connection.execute(text(f"DELETE FROM parameter WHERE calibration_id = {number}"))
                for table in ("calibration", "location", "recording"):
                    connection.execute(text(f"DELETE FROM {table} WHERE run_id = {number}"))
                connection.execute(text(f"DELETE FROM run WHERE id = {number}"))
            connection.execute(text("DELETE FROM journal"))
            for entered in journal.ENTRY_TABLES.values():
                for key in connection.execute(select(*entered.primary_key).order_by(*entered.primary_key)).all():
                    journal.note(connection, entered, *key)
            create_triggers(connection)
        assert wrong(history) == [("missing", f"{table} 2 to 3") for table in GAPS]


@pytest.mark.one_in(2)
@pytest.mark.slow
@pytest.mark.parametrize("name", ["run-2.h5", "run-17.h5", "verify-2.h5", "certificate.pdf", "script.py"])
def test_a_file_of_a_run_that_no_run_was_entered_with_is_named(name: str, tmp_path: Path) -> None:
    folder = run_folder(tmp_path / "run")
    with open_history(str(tmp_path / "history.sqlite")) as history:
        history.enter(read_finished_run(folder))
        (folder / "notes.txt").write_text("not of the run", encoding="utf-8")
        assert wrong(history) == []
        shutil.copy(folder / "run.h5", folder / name)
        assert wrong(history) == [("unknown", str(folder / name))]
        assert main(["history", "verify", "--history", str(tmp_path / "history.sqlite")]) == 1


@pytest.mark.slow
def test_a_run_that_was_gone_on_with_is_entered_with_its_new_recording(tmp_path: Path) -> None:
    folder = run_folder(tmp_path / "run")
    with open_history(str(tmp_path / "history.sqlite")) as history:
        history.enter(read_finished_run(folder))
        shutil.copy(folder / "run.h5", folder / "run-2.h5")
        another_value(folder)
        history.enter(replace(read_finished_run(folder), certificate=None))
        assert wrong(history) == []
