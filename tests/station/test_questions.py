"""One rule for questions at a terminal: `go` moves, `yes` changes, `no` does neither, anything else is asked again."""

import os
import pty
from collections.abc import Iterator
from contextlib import closing
from types import SimpleNamespace

import pytest

from rig.station.confirm import ask_operator
from rig.station.events import Prompt

STARTING, CHANGING = Prompt(()).to_do, "erase"
NO_ANSWERS = ("", "LSM9DS1-001", "g", "yes no")


class Typist:
    """A person at a terminal who types the next of their answers after each question."""

    def __init__(self) -> None:
        self._terminal, far_end = pty.openpty()
        self.keyboard = os.fdopen(far_end, encoding="utf-8")
        self.answers: Iterator[str] = iter(())
        self.shown = ""

    def take(self, text: str) -> int:
        """Take what the program shows; a question ends with a space."""
        self.shown += text
        if text == " ":
            os.write(self._terminal, f"{next(self.answers)}\n".encode())
        return len(text)

    def close(self) -> None:
        self.keyboard.close()
        os.close(self._terminal)


@pytest.mark.parametrize(
    ("to_do", "word", "others"),
    [(STARTING, "go", ("yes", "y")), (STARTING, "GO", ("Yes",)), (CHANGING, "yes", ("go",)), (CHANGING, "Y", ("go",))],
)
def test_one_word_starts_the_arm_another_changes_something_and_anything_else_is_asked_again(
    monkeypatch: pytest.MonkeyPatch, to_do: str, word: str, others: tuple[str, ...]
) -> None:
    wrong = (*others, *NO_ANSWERS)
    with closing(Typist()) as typist, monkeypatch.context() as at_terminal:
        at_terminal.setattr("sys.stdin", typist.keyboard)
        at_terminal.setattr("sys.stderr", SimpleNamespace(write=typist.take, flush=bool, isatty=bool))
        for last, agreed in ((word, True), ("no", False), ("n", False)):
            typist.shown, typist.answers = "", iter((*wrong, last))
            assert ask_operator(("The arm will move.",), to_do) is agreed
            assert typist.shown.count(f" to {to_do}, or no:") == len(wrong) + 1
            assert typist.shown.count("The arm will move.") == 1
            assert all(f'"{text}" does not answer this question' in typist.shown for text in wrong)
