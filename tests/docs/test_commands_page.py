"""The page of commands is what the command line says, and every argument has a meaning."""

import pytest

from rig.cli import COMMANDS, main
from support.commands_page import PAGE, page_text
from support.paths import DOCS


def test_the_page_is_today_s() -> None:
    again = "again: PYTHONPATH=tests python -m support.commands_page > docs/commands.md"
    assert PAGE.read_text(encoding="utf-8") == page_text(), again


def test_every_command_and_argument_has_a_meaning_and_a_page() -> None:
    rows = [line for line in page_text().splitlines() if line.startswith("|")]
    assert not [row for row in rows if not row.removesuffix("|").rpartition("|")[2].strip()]
    assert not [command.page for command in COMMANDS.values() if not (DOCS / command.page).exists()]


@pytest.mark.parametrize(
    ("words", "complaint"),
    [
        (["rnu"], "rig: error: there is no command rnu; did you mean run?"),
        (["board", "inof", "x.yaml"], "rig board: error: there is no command inof; did you mean info?"),
        (["export", "RUN", "--format", "cvs"], "rig export: error: --format cannot be cvs; did you mean csv?"),
        (["run"], "rig run: error: the following arguments are required: CONFIG"),
    ],
)
def test_a_wrong_word_is_named_before_the_usage(
    words: list[str], complaint: str, capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit, match="2"):
        main(words)
    lines = capsys.readouterr().err.splitlines()
    assert lines[0] == complaint and lines[1].startswith("usage: rig") and lines[-1].startswith("more: rig ")
