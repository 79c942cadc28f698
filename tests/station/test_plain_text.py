"""Texts from outside are shown as they are, and command neither rich nor the terminal."""

import ast
import io
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest
from rich.console import Console
from rich.live import Live

from rig.cli import main
from rig.errors.quoting import printable, printable_lines
from rig.station.events import RunFolderWritten
from rig.station.log import log
from rig.station.plain_text import duration_words, plain, say, wrap_line
from rig.station.view import LiveView, PlainView
from support.paths import ROOT

HOSTILE = "[/nope] [red]x[/] :skull: \x1b]0;title\x07 \x9b31m"
SHOWN = "[/nope] [red]x[/] :skull: \\x1b]0;title\\x07 \\x9b31m"


def test_what_is_printable_stays_and_the_rest_is_escaped() -> None:
    assert printable("µ = 3 °/s, ± 1σ – 试") == "µ = 3 °/s, ± 1σ – 试"
    assert printable(HOSTILE) == SHOWN
    assert printable("5.7\u00a0×\u00a010⁻⁵\n") == "5.7\u00a0×\u00a010⁻⁵\\n"
    assert printable("a\nb\r") == "a\\nb\\r" and printable_lines("a\nb\r") == "a\nb\\r"
    assert printable("\u202e\ud800") == "\\u202e\\ud800"


def test_rich_finds_nothing_in_it() -> None:
    console = Console(file=io.StringIO(), record=True, width=100)
    console.print(plain(HOSTILE))
    assert console.export_text() == SHOWN + "\n"


def test_the_operators_view_shows_it_as_it_is(capsys: pytest.CaptureFixture[str]) -> None:
    console = Console(file=io.StringIO(), record=True, width=100)
    LiveView(Live(console=console, auto_refresh=False)).event(RunFolderWritten(Path(HOSTILE)))
    assert SHOWN in console.export_text()
    PlainView().event(RunFolderWritten(Path(HOSTILE)))
    assert capsys.readouterr().err == f"written: {SHOWN}\n"


def test_a_line_for_a_pipe_shows_it_as_it_is(capsys: pytest.CaptureFixture[str]) -> None:
    say(f"{HOSTILE}\nready")
    say(HOSTILE, sys.stderr)
    assert capsys.readouterr() == (SHOWN + "\\nready\n", SHOWN + "\n")


@pytest.mark.parametrize("width", [40, 60, 80])
def test_a_terminal_gets_its_lines_broken_between_words_and_commands_whole(width: int) -> None:
    said = "rig: foreign_folder: it would connect to 192.0.2.5. Read it, then `rig check CONFIG --json`. "
    command = "rig resume runs/2026-11-25T10-00-00Z-imu --connect 192.0.2.5"
    lines = wrap_line(f"{said}If all of this is yours, state it: {command}", width)
    assert " ".join(" ".join(lines).split()) == f"{said}If all of this is yours, state it: {command}"
    assert any("`rig check CONFIG --json`" in line for line in lines) and lines[-1].endswith(command)
    assert all(len(line) <= width for line in lines if command not in line)


def test_an_error_is_broken_for_a_terminal_and_one_line_for_a_pipe(
    capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    wrong = ["solve", "/nowhere/at-all/run.h5"]
    assert main(wrong) == 2
    piped = capsys.readouterr().err
    monkeypatch.setenv("COLUMNS", "40")
    monkeypatch.setattr(sys.stderr, "isatty", lambda: True)
    assert main(wrong) == 2
    lines = [line for line in capsys.readouterr().err.splitlines() if not line.endswith("…")]
    assert piped.count("\n") == 1 and len(lines) > 1 and max(map(len, lines)) <= 40
    assert " ".join(" ".join(lines).split()) == piped.rstrip("\n")


def test_the_log_shows_it_as_it_is(tmp_path: Path) -> None:
    with log(tmp_path / "log.txt") as logged:
        logged.event(RunFolderWritten(Path(HOSTILE)))
    assert (tmp_path / "log.txt").read_text(encoding="utf-8").endswith(f" INFO written: {SHOWN}\n")


def printed(file: Path) -> Iterator[ast.expr]:
    """What a module gives to `print`."""
    for node in ast.walk(ast.parse(file.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Call) and ast.unparse(node.func) == "print":
            yield from node.args


@pytest.mark.slow
@pytest.mark.parametrize("room", ["commands", "report", "runner", "board"])
def test_what_is_printed_as_it_stands_is_written_in_the_source_or_json(room: str) -> None:
    """All else may hold something from outside, and goes through `say`, `printable` or `plain`."""
    for file in sorted((ROOT / "rig" / room).rglob("*.py")):
        for text in printed(file):
            call = ast.unparse(text.func) if isinstance(text, ast.Call) else ""
            safe = call in ("json.dumps", "printable") or call.endswith("text")
            assert isinstance(text, ast.Constant) or safe, f"{file.name}:{text.lineno} prints {ast.unparse(text)}"


def test_an_error_names_a_hostile_path_without_obeying_it(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["solve", HOSTILE]) == 2
    assert SHOWN in (said := capsys.readouterr().err) and "\x1b" not in said


@pytest.mark.parametrize(("seconds", "words"), [(66.4, "66 s"), (725, "12 min"), (20_160, "5 h 36 min")])
def test_a_long_time_is_told_in_hours_and_minutes(seconds: float, words: str) -> None:
    assert duration_words(seconds) == words
