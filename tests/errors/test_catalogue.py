"""Every error's name stands in one table, and nothing else does; the page is made from it."""

from collections import defaultdict
from pathlib import Path

import pytest

from firmware_host import protocol
from rig.errors.catalogue import TABLE, catalogue
from rig.errors.errors_page import page
from support.error_names import Raised, find_errors, find_errors_in, kind_of
from support.paths import DOCS, ROOT

PLACE = TABLE.relative_to(ROOT)


def raised() -> dict[str, list[Raised]]:
    """Name → where it is made: in the source, or on the board."""
    found: dict[str, list[Raised]] = defaultdict(list)
    for error in find_errors():
        if error.name is not None:
            found[error.name].append(error)
    for code, problem in protocol.ERRORS.items():
        found[problem.name].append(Raised(problem.name, "either", f"the board, code {code}"))
    return found


@pytest.mark.slow
def test_an_error_s_name_is_written_out_where_it_is_made() -> None:
    hidden = [error.location for error in find_errors() if error.name is None]
    assert not hidden, f"write the names out, or nobody finds them: {', '.join(hidden)}"


@pytest.mark.slow
def test_every_error_that_is_raised_is_in_the_table() -> None:
    known = {entry.name for entry in catalogue()}
    lines = [
        f"{name} | {kind_of(places)} | WHEN IT OCCURS | What to do ({', '.join(error.location for error in places)})"
        for name, places in sorted(raised().items())
        if name not in known
    ]
    assert not lines, f"a typo, or add to {PLACE}, where the alphabet has it:\n" + "\n".join(lines)


@pytest.mark.slow
def test_every_error_in_the_table_is_raised_somewhere() -> None:
    made = raised()
    gone = [entry.name for entry in catalogue() if entry.name not in made]
    assert not gone, f"nothing raises these any more, remove them from {PLACE}: {', '.join(gone)}"


@pytest.mark.slow
def test_the_table_says_how_an_error_is_raised() -> None:
    made = raised()
    wrong = [
        f"{entry.name}: {kind_of(made[entry.name])}, not {entry.kind}"
        for entry in catalogue()
        if entry.name in made and kind_of(made[entry.name]) != entry.kind
    ]
    assert not wrong, f"correct the second column of {PLACE}:\n" + "\n".join(wrong)


def test_the_table_is_in_order_and_names_each_error_once() -> None:
    names = [entry.name for entry in catalogue()]
    assert names == sorted(set(names))


def test_the_committed_page_is_what_the_table_generates() -> None:
    committed = (DOCS / "errors.md").read_text(encoding="utf-8")
    assert committed == page(), "again: python -m rig.errors.errors_page > docs/errors.md"


@pytest.mark.parametrize(
    ("source", "found"),
    [
        ('raise Refused("no_arm", what, remedy)', {("no_arm", "refused")}),
        ('raise Fault("a" if x else "b", what, remedy)', {("a", "fault"), ("b", "fault")}),
        ("raise Fault(error.name, what, remedy)", set()),
        ('raise Refused(f"another_{what}", what, remedy)', {(None, "refused")}),
        ('class Bad(Refused):\n    def __init__(self):\n        super().__init__("bad", "", "")', {("bad", "refused")}),
        (
            'def lose(name, what):\n    fail(Problem(name, what, ""))\n'
            'def end():\n    name = "died" if crashed else "lost"\n    lose(name, "")\n'
            'def guard():\n    lose("hung", "")',
            {("died", "either"), ("lost", "either"), ("hung", "either")},
        ),
    ],
)
def test_names_are_found_in_the_source(source: str, found: set[tuple[str | None, str]]) -> None:
    assert {(each.name, each.kind) for each in find_errors_in(source, Path("some.py"))} == found
