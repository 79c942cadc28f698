"""What a batch's entries amount to, what is doubted, and what it leaves: without a rig."""

import csv
import gc
import json
import os
import pty
import shlex
import sys
from argparse import ArgumentParser
from dataclasses import replace
from io import StringIO
from pathlib import Path
from types import SimpleNamespace
from typing import cast
from weakref import ReferenceType, ref

import pytest

from rig.batch.batch_journal import JOURNAL, open_journal, resume_journal
from rig.batch.batch_state import (
    Batch,
    BatchEnded,
    BatchPart,
    Begun,
    Chip,
    Entry,
    PartBegun,
    PartEnded,
    doubt_of,
    state_of,
)
from rig.batch.batch_table import csv_of, page_of, summary
from rig.batch.label import Label, files_of, zpl
from rig.batch.operators import Operator
from rig.batch.part_list import next_serial_number, numbers_in
from rig.batch.part_sequence import Bench, Desk, Work
from rig.commands.station import station
from rig.config.judging.station_section import StationSection
from rig.config.load import Loaded
from rig.errors import Refused
from rig.plans.script_file import ScriptFile
from rig.runner.phases import Run
from rig.station.events import Prompt
from rig.station.operator_station import Stations, always_yes
from rig.station.questions import Question, Terminal
from support.processes.full_disk import full_disk

AT = "2026-11-25T08:00:00+00:00"
BEGUN = Begun("A. Person", "W-17", AT)
CHIP = Chip("0123456789abcdef01234567", (0x68,))
SECTION = StationSection(serial_pattern=r"G-\d{3}", parts=("G-001", "G-002", "G-003"))
PASSED = PartEnded("pass", AT, certificate="RIG-20261125-0A1B2C3D4E5F", chip=CHIP)


def entries(*ended: tuple[str, PartEnded | None]) -> list[Entry]:
    told: list[Entry] = [BEGUN]
    for number, (serial, end) in enumerate(ended, 1):
        told += [PartBegun(serial, f"{number:02d}-{serial}", AT), *([end] if end else [])]
    return told


def batch(*ended: tuple[str, PartEnded | None]) -> Batch:
    return state_of(entries(*ended))


def test_a_part_that_has_not_ended_is_in_hand() -> None:
    after_a_kill = batch(("G-001", PASSED), ("G-002", None))
    assert after_a_kill.in_hand == BatchPart(2, "G-002", "02-G-002", AT)
    assert batch(("G-001", PASSED)).in_hand is None


@pytest.mark.parametrize(
    ("serial", "before", "why", "final"),
    [
        ("G-1", None, "does not match", True),
        ("G-00é", None, "not a serial number", True),
        ("G-001\nG-002", None, "not a serial number", True),
        ("G-009", None, "no part G-009", False),
        ("G-001", None, "is done: part 1", False),
        ("G-002", "2026-11-25, PASS (calibration 7)", "today: 2026-11-25", False),
    ],
)
def test_a_number_that_may_be_wrong_is_doubted(serial: str, before: str | None, why: str, final: bool) -> None:
    doubt = doubt_of(serial, batch(("G-001", PASSED)), SECTION, lambda _: before)
    assert doubt is not None and why in doubt.why and doubt.final is final


def test_a_part_that_was_only_refused_is_not_done() -> None:
    refused = PartEnded("refused", AT, "no_port: …")
    assert doubt_of("G-001", batch(("G-001", refused)), SECTION, lambda _: None) is None


def test_the_same_chip_is_another_numbers_alone() -> None:
    of = batch(("G-001", PASSED))
    other = of.same_chip(CHIP, "G-002")
    assert other is not None and other.serial == "G-001"
    assert of.same_chip(CHIP, "G-001") is None
    assert of.same_chip(replace(CHIP, who_am_i=(0x71,)), "G-002") is None


def test_a_batch_passes_when_every_number_has_passed_in_the_end() -> None:
    failed, refused = PartEnded("fail", AT, "gyro.residuals"), PartEnded("refused", AT, "G-001 is done")
    assert batch(("G-001", failed), ("G-001", PASSED), ("G-001", refused)).passed
    assert not batch(("G-001", PASSED), ("G-002", failed)).passed
    assert not batch(("G-001", PASSED), ("G-002", refused)).passed


def test_the_journal_gives_the_batch_back_after_a_kill_in_the_middle_of_a_line(tmp_path: Path) -> None:
    folder = tmp_path / "batch"
    journal = open_journal(folder, tmp_path, BEGUN)
    for entry in entries(("G-001", PASSED), ("G-002", None))[1:]:
        journal.enter(entry)
    with (folder / JOURNAL).open("a", encoding="utf-8") as file:
        file.write('{"entry": "part_ended", "outc')
    again = open_journal(folder, tmp_path, Begun("", "", AT))
    assert again.batch == journal.batch
    again.enter(PASSED)
    again.enter(BatchEnded(AT))
    assert resume_journal(folder).batch == again.batch and again.batch.passed


def test_a_journal_that_tells_of_no_batch_is_refused(tmp_path: Path) -> None:
    (tmp_path / JOURNAL).write_text('{"entry": "part_ended", "outcome": "pass", "at_utc": ""}\n', encoding="utf-8")
    with pytest.raises(Refused, match="no_batch"):
        resume_journal(tmp_path)


@pytest.mark.parametrize(
    "line",
    [
        '{"entry": "part_begun", "serial": "G-001", "folder": "../elsewhere", "at_utc": ""}',
        '{"entry": "part_begun", "serial": 1, "folder": "01-1", "at_utc": ""}',
        "1",
        "[" * 100_000,
    ],
    ids=["a folder elsewhere", "a number", "no entry", "deep"],
)
def test_a_journal_of_somebody_elses_leads_nowhere_else(line: str, tmp_path: Path) -> None:
    open_journal(tmp_path / "batch", tmp_path, BEGUN)
    with (tmp_path / "batch" / JOURNAL).open("a", encoding="utf-8") as file:
        file.write(f"{line}\n")
    with pytest.raises(Refused, match="no_batch"):
        resume_journal(tmp_path / "batch")


def test_what_texts_of_somebody_elses_journal_hide_is_shown(tmp_path: Path) -> None:
    hidden = "G\x1b[31m\nverdict: PASS"
    (tmp_path / JOURNAL).write_text(
        "".join(
            json.dumps(each) + "\n"
            for each in (
                {"entry": "batch_begun", "operator": hidden, "work_order": "", "at_utc": AT},
                {"entry": "part_begun", "serial": hidden, "folder": "01-G", "at_utc": AT},
            )
        ),
        encoding="utf-8",
    )
    batch = resume_journal(tmp_path).batch
    assert {batch.begun.operator, batch.parts[0].serial} == {r"G\x1b[31m\nverdict: PASS"}


@pytest.mark.skipif(sys.platform == "win32", reason="no limit for files there")
def test_a_batch_that_cannot_be_begun_leaves_nothing_in_its_way(tmp_path: Path) -> None:
    with full_disk(20), pytest.raises(Refused, match=r"run_folder: .*too large: '.*batch\.jsonl'"):
        open_journal(tmp_path / "batch", tmp_path, BEGUN)
    assert open_journal(tmp_path / "batch", tmp_path, BEGUN).batch.begun == BEGUN


def test_nothing_is_written_through_a_link_in_a_batch_folder(tmp_path: Path) -> None:
    folder = open_journal(tmp_path / "batch", tmp_path, BEGUN).folder
    (tmp_path / "elsewhere").mkdir()
    (folder / "labels").symlink_to(tmp_path / "elsewhere")
    with pytest.raises(Refused, match="not_written_through"):
        resume_journal(folder)


def test_a_simulated_batch_is_not_gone_on_with_on_a_real_rig(tmp_path: Path) -> None:
    folder = open_journal(tmp_path / "batch", tmp_path, replace(BEGUN, simulated=True)).folder
    assert open_journal(folder, tmp_path, replace(BEGUN, simulated=True)).batch.begun.simulated
    with pytest.raises(Refused, match="begun in a simulated laboratory"):
        open_journal(folder, tmp_path, BEGUN)


def test_at_the_terminal_what_is_typed_ahead_is_no_answer_and_a_number_mounts_nothing(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Go that was typed before the arm's way was announced, and a number that was scanned twice."""
    terminal, far_end = pty.openpty()
    keyboard = os.fdopen(far_end, encoding="utf-8")
    answers = iter((b"G-001\n", b"no\n", b"no\n"))

    def shown(text: str) -> int:
        return os.write(terminal, next(answers)) if text == " " else 0  # a question has been read to its end

    monkeypatch.setattr("sys.stdin", keyboard)
    monkeypatch.setattr("sys.stderr", SimpleNamespace(write=shown, flush=lambda: None, isatty=lambda: False))
    try:
        assert not Operator(Terminal()).is_mounted(BatchPart(1, "G-001", "01-G-001", AT))
        os.write(terminal, b"go\n")
        assert not Operator(Terminal()).agrees(("The arm will move.",), Prompt(()).to_do)
    finally:
        monkeypatch.undo()
        keyboard.close()
        os.close(terminal)


def test_a_number_that_is_not_taken_is_asked_for_again_with_the_reason(tmp_path: Path) -> None:
    questions = list[Question]()

    class Typist:
        def answer(self, question: Question) -> str:
            questions.append(question)
            return "G-1" if len(questions) == 1 else ""

    bench = cast(Bench, SimpleNamespace(simulated=True, today=lambda serial: None))
    Work(open_journal(tmp_path / "batch", tmp_path, BEGUN), SECTION, Operator(Typist()), bench).all_parts()
    first, second = questions
    assert not first.lines
    assert second.lines == (r"G-1 does not match the pattern G-\d{3}.",)


@pytest.mark.slow
def test_between_two_parts_nothing_of_a_run_is_left_in_memory(tmp_path: Path) -> None:
    """What refers to itself, as a run and its listeners do, is let go at once: twenty parts need the memory of one."""

    class OfARun:
        itself: object = None

    left = list[ReferenceType[OfARun]]()

    def run(part: BatchPart, folder: Path, desk: Desk) -> PartEnded:
        assert [each() for each in left] == [None] * len(left)
        data = OfARun()
        data.itself = data
        left.append(ref(data))
        return PartEnded("fail", AT)

    bench = cast(Bench, SimpleNamespace(simulated=True, today=lambda serial: None, fit=lambda serial: None, run=run))
    numbers = ["G-001", "G-002", "G-003"]
    gc.disable()
    try:
        Work(open_journal(tmp_path / "batch", tmp_path, BEGUN), SECTION, Operator(None, numbers), bench).all_parts()
    finally:
        gc.enable()
    assert len(left) == len(numbers)


def test_the_command_that_goes_on_shows_the_same_page_and_no_token(tmp_path: Path) -> None:
    parser = ArgumentParser()
    station.add(parser)
    page = ["--page", "--page-address", "192.0.2.10:8137"]
    begun = ["a b.yaml", "--set", "station.repeats=1", "--series", "parts.csv", *page]
    said = shlex.split(station.resume_command(parser.parse_args([*begun, "--page-token", "secret"]), tmp_path))
    assert said[:2] == ["rig", "station"] and "secret" not in said
    assert parser.parse_args(said[2:]) == parser.parse_args([*begun, "--out", str(tmp_path)])


def test_an_interrupted_part_is_gone_on_with_by_the_stations_own_command(tmp_path: Path) -> None:
    going_on = "rig station a.yaml --out batch"
    nowhere = cast(Loaded, None), cast(ScriptFile, None), Stations((), always_yes)
    run = Run(tmp_path, *nowhere, again=going_on)
    with pytest.raises(KeyboardInterrupt, match=f"Go on with: {going_on}$"), run.report_end():
        raise KeyboardInterrupt


def test_the_table_says_what_became_of_each(tmp_path: Path) -> None:
    of = batch(("G-001", replace(PASSED, repeated=1)), ("G-002", PartEnded("fail", AT, "=gyro")), ("G-003", None))
    rows = list(csv.DictReader(StringIO(csv_of(of))))
    assert [(row["serial_number"], row["verdict"], row["sweeps_repeated"]) for row in rows] == [
        ("G-001", "pass", "1"),
        ("G-002", "fail", "0"),
        ("G-003", "open", ""),
    ]
    assert rows[1]["why"] == "'=gyro"  # a spreadsheet would compute it
    assert summary(of) == "3 parts: 1 passed, 1 failed, 1 open, sweeps repeated in 1"
    assert summary(batch(("G-001", PASSED))) == "1 part: 1 passed"
    page = page_of(replace(of, begun=replace(BEGUN, operator="<b>A</b>")), simulated=True)
    assert "<b>A</b>" not in page and PASSED.certificate in page and "simulated laboratory" in page


def test_a_label_has_number_day_certificate_and_its_qr_code() -> None:
    label = Label("G^001", "2026-11-25", PASSED.certificate, "SIMULATED")
    files = files_of(label)
    assert set(files) == {".txt", ".zpl", ".svg"}
    text = files[".txt"].decode()
    assert "G^001\nPASS 2026-11-25\nRIG-20261125-0A1B2C3D4E5F\nSIMULATED\n" in text
    assert b"<svg" in files[".svg"]
    assert "^FDG_5E001^FS" in zpl(label)  # what a serial number holds is no command to the printer
    assert f"^FDMA,{PASSED.certificate}^FS" in zpl(label)


def test_a_list_of_parts_is_a_column_or_a_line_each(tmp_path: Path) -> None:
    path = tmp_path / "parts.csv"
    path.write_text("\ufeffpart,serial_number\nx,G-001\ny,G-002\n\n", encoding="utf-8")
    assert numbers_in(path) == ("G-001", "G-002")
    path.write_text("G-001\nG-002\n", encoding="utf-8")
    assert numbers_in(path) == ("G-001", "G-002")
    path.write_text("part,serial_number\nx\n", encoding="utf-8")
    with pytest.raises(Refused, match="parts_file"):
        numbers_in(path)


def test_another_list_than_the_batch_was_begun_with_is_refused() -> None:
    assert next_serial_number(["a", "b"], ["a"]) == "b"
    assert next_serial_number(["a", "b"], ["a", "b"]) is None
    with pytest.raises(Refused, match="another_series"):
        next_serial_number(["a", "b"], ["b"])
