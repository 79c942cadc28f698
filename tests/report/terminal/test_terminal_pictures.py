"""How a run ends on terminals of three widths: kept as text and picture in build/terminal, and held to its limits."""

import io
import sys
from collections.abc import Callable, Sequence
from pathlib import Path

import pytest
from rich.console import Console
from rich.text import Text

from rig.cli import run_guarded
from rig.data.result_file import ResultDocument
from rig.data.run_folder import resuming
from rig.errors import Fault, Problem, refuse
from rig.report.terminal.result_table import print_kept
from rig.station.events import Advice
from rig.station.words import line
from support.documents.ended_runs import ONE, fail_checks, make_three_parts
from support.paths import ROOT

PICTURES = ROOT / "build" / "terminal"
RUN = Path("runs/2026-11-25T10-00-00Z-imu")
SIX = make_three_parts()
RESULTS = {"one": ONE, "six": SIX}
NAMES = {"one": ["gyro"], "six": [*SIX.gyroscopes]}
MOST = {"one": {60: 17, 80: 12, 120: 12}, "six": {60: 44, 80: 25, 120: 25}}  # lines, by width
COPYABLE = ("certificate: ", "all details: ")
STATUS = {"pass": 0, "fail": 0, "stopped": 3, "refused": 2}


def verdict(result: ResultDocument) -> Callable[[], int]:
    def command() -> int:
        print_kept(RUN, result, ["none of 19 values changed since the last calibration (no. 7)"])
        return 0

    return command


def stopped(names: Sequence[str]) -> Callable[[], int]:
    """As the phases of a run end it: the fault, then where the data are and how to go on."""

    def command() -> int:
        fault = Fault(
            "no_samples",
            f"no sample from {', '.join(names)} within 2 s of the start",
            "Check the sensor's wiring and its data-ready line, then run `rig check`",
        )
        fault.add_note(line(Advice(RUN, resuming(RUN), repeats=False)) or "")
        raise fault

    return command


def refused(names: Sequence[str]) -> Callable[[], int]:
    def command() -> int:
        what, remedy = "the board finds no lsm9ds1", "Check the sensor's supply and SPI wires"
        refuse([Problem("sensor_missing", f"sensors.{name}: {what}", remedy) for name in names])
        return 0

    return command


def ends(sensors: str, how: str) -> Callable[[], int]:
    result, names = RESULTS[sensors], NAMES[sensors]
    broken = [check.name for check in result.checks if check.name.startswith(tuple(f"{name}.scale" for name in names))]
    return {
        "pass": verdict(result),
        "fail": verdict(fail_checks(result, *broken)),
        "stopped": stopped(names),
        "refused": refused(names),
    }[how]


def keep(said: str, width: int, name: str) -> list[str]:
    """The screen's rows: a terminal breaks a line where its row is full. Kept as text and as SVG."""
    rows = [
        row
        for line in Text.from_ansi(said).split("\n", allow_blank=True)
        for row in line.divide(range(width, len(line), width))
    ]
    screen = Console(record=True, width=width, file=io.StringIO())
    for row in rows:
        screen.print(row, soft_wrap=True)
    screen.save_text(str(PICTURES / f"{name}.txt"), clear=False)
    screen.save_svg(str(PICTURES / f"{name}.svg"), title=f"{name.replace('-', ', ')} columns")
    return [row.plain for row in rows]


@pytest.mark.parametrize("width", [60, 80, 120])
@pytest.mark.parametrize("how", STATUS)
@pytest.mark.parametrize("sensors", RESULTS)
def test_how_a_run_ends_is_kept_as_a_picture(
    sensors: str, how: str, width: int, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("COLUMNS", str(width))
    monkeypatch.setenv("FORCE_COLOR", "1")
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True)
    PICTURES.mkdir(parents=True, exist_ok=True)
    assert run_guarded(ends(sensors, how)) == STATUS[how]
    out, err = capsys.readouterr()
    said = (out + err).rstrip("\n")
    rows = keep(said, width, f"{sensors}-{how}-{width}")
    assert max(map(len, rows)) <= width
    lines = Text.from_ansi(said).plain.split("\n")
    if how in ("stopped", "refused"):
        assert lines[0].startswith("rig: ")
        error = [row for row in lines if not row.startswith(COPYABLE) and "rig resume" not in row]
        said_as_error = " ".join(" ".join(error).split())
        assert "Check the sensor's" in said_as_error and "verdict" not in said
        assert all(name in said_as_error for name in NAMES[sensors])
        assert max(map(len, error)) <= width, "the terminal would break it inside a word"
        assert how == "refused" or "rig resume" in said
        assert len(rows) <= MOST[sensors][width]
        return
    assert rows[-1] == f"verdict: {how.upper()}" and "verdict" not in "".join(rows[:-1])
    assert f"all details: rig show {RUN} --all" in lines
    assert ("FAILED" in said) == (how == "fail")
    assert len(lines) <= MOST[sensors][width]
    assert all(len(line) <= width for line in lines if not line.startswith(COPYABLE) and "rig " not in line)
