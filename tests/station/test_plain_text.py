"""Texts from outside are shown as they are, and command neither rich nor the terminal."""

import io

import pytest
from rich.console import Console
from rich.live import Live

from rig.cli import main
from rig.station.events import Message
from rig.station.plain_text import plain, printable, printable_lines
from rig.station.view import LiveView, PlainView

HOSTILE = "[/nope] [red]x[/] :skull: \x1b]0;title\x07 \x9b31m"
SHOWN = "[/nope] [red]x[/] :skull: \\x1b]0;title\\x07 \\x9b31m"


def test_what_is_printable_stays_and_the_rest_is_escaped() -> None:
    assert printable("µ = 3 °/s, ± 1σ – 试") == "µ = 3 °/s, ± 1σ – 试"
    assert printable(HOSTILE) == SHOWN
    assert printable("a\nb\r") == "a\\nb\\r" and printable_lines("a\nb\r") == "a\nb\\r"
    assert printable("\u202e\ud800") == "\\u202e\\ud800"


def test_rich_finds_nothing_in_it() -> None:
    console = Console(file=io.StringIO(), record=True, width=100)
    console.print(plain(HOSTILE))
    assert console.export_text() == SHOWN + "\n"


def test_the_operators_view_shows_it_as_it_is(capsys: pytest.CaptureFixture[str]) -> None:
    console = Console(file=io.StringIO(), record=True, width=100)
    LiveView(Live(console=console, auto_refresh=False)).event(Message(HOSTILE))
    assert SHOWN in console.export_text()
    PlainView().event(Message(HOSTILE))
    assert capsys.readouterr().err == SHOWN + "\n"


def test_an_error_names_a_hostile_path_without_obeying_it(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["solve", HOSTILE]) == 2
    assert SHOWN in (said := capsys.readouterr().err) and "\x1b" not in said
