"""What a person reads: names from outside are shown as they are, and command nothing."""

import io
import json
import shutil
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import pytest
from rich.console import Console

from firmware_host.answers import Calibration, StoredCalibration
from rig.cli import main
from rig.data.result_file import CheckEntry, ResultDocument
from rig.report.kinds.verification import verification_table
from rig.report.terminal.board_info import print_stored
from rig.report.terminal.result_table import print_outcome, print_result
from support.documents.results import SENSOR, VERIFIED, result_document
from support.paths import DOCS, RECORDINGS

HOSTILE = "[/nope] [red]x[/] :skull: \x1b[31m\x07"
SHOWN = "[/nope] [red]x[/] :skull: \\x1b[31m\\x07"


def shown(document: ResultDocument) -> str:
    console = Console(width=150, file=io.StringIO(), record=True)
    print_result(document, console)
    return console.export_text()


def test_the_checks_say_what_was_not_measured_and_what_was_not_set() -> None:
    of: dict[str, Any] = {"unit": "rad/s", "passed": False, "kind": "conformity", "sensor": "gyro", "quantity": "rate"}
    checks = (
        CheckEntry(name="gyro.bias", value=None, limit=0.1, criterion="bias", **of),
        CheckEntry(name="gyro.verification_rms", value=0.001, limit=None, criterion="verification_rms", **of),
    )
    rows = shown(VERIFIED.model_copy(update={"checks": checks})).splitlines()
    assert any(" bias " in row and "not measured" in row and "FAILED" in row for row in rows)
    assert any(" verification_rms " in row and "not set" in row and "FAILED" in row for row in rows)


@pytest.mark.slow
def test_a_serial_number_is_no_markup_and_no_command_to_the_terminal(capsys: pytest.CaptureFixture[str]) -> None:
    assert SENSOR.board is not None
    board = SENSOR.board.model_copy(update={"not_observed": (HOSTILE,)})
    sensor = SENSOR.model_copy(update={"serial_number": HOSTILE, "board": board})
    document = result_document({HOSTILE: sensor})
    text = " ".join(shown(document).split())  # a title is as wide as its table
    assert text.count(SHOWN) == 3
    print_outcome(document, as_json=False, whole=True)
    print_outcome(document, as_json=True)
    assert "\x1b" not in text + capsys.readouterr().out


def test_the_other_tables_show_names_as_they_are(capsys: pytest.CaptureFixture[str]) -> None:
    console = Console(width=150, file=io.StringIO(), record=True)
    console.print(verification_table(HOSTILE, VERIFIED.verification["gyro"]))
    assert SHOWN in console.export_text()
    matrix = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
    calibration = Calibration("k_times_m_plus_b", HOSTILE, datetime.now(UTC), 22.5, matrix, (0.0, 0.0, 0.0))
    stored = StoredCalibration(1, "LSM9DS1", 0x68, 245.0, calibration)
    print_stored({"gyro": stored, HOSTILE: None}, as_json=False)
    assert capsys.readouterr().out.count(SHOWN) == 2


def test_a_clock_s_offset_is_shown_in_milliseconds_with_twice_its_standard_deviation() -> None:
    stored = json.loads((RECORDINGS / "swinging/result.json").read_text())
    increments = stored["gyroscopes"]["imu"]["in_attitudes"]["by_increments"]
    increments.update(clock_offset_s=2.5e-3, clock_offset_std_s=4.2e-4)
    text = " ".join(shown(ResultDocument.model_validate_json(json.dumps(stored))).split())
    assert "the attitudes' clock is +2.50 ± 0.84 ms from the samples'" in text


@pytest.mark.slow
def test_a_path_is_no_markup(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder = tmp_path / "[/nope]"
    folder.mkdir(parents=True)
    samples, sweeps = (Path(shutil.copy(DOCS / "examples" / name, folder)) for name in ("samples.csv", "sweeps.csv"))
    assert main(["solve", str(samples), "--sweeps", str(sweeps), "--out", str(folder / "run")]) == 0
    said = capsys.readouterr()
    assert "[/nope]" in said.err.replace("\n", "")
    assert main(["solve", str(folder / "none.csv"), "--sweeps", str(sweeps)]) == 2
    assert "[/nope]" in capsys.readouterr().err.replace("\n", "")
