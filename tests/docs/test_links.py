"""Every page's links lead somewhere, the paths it names exist, the commands it shows are commands."""

import re
import shlex
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import pytest

from rig.cli import main
from rig.data.latest_run import note_run
from rig.errors.catalogue import catalogue
from support.paths import DOCS, ROOT

PAGES = [
    ROOT / "README.md",
    ROOT / "CONTRIBUTING.md",
    *sorted(DOCS.rglob("*.md")),
    *sorted(ROOT.glob("firmware_host/**/README.md")),
]
FENCE = re.compile(r"^```(\w*)\n(.*?)^```$", re.MULTILINE | re.DOTALL)
INLINE = re.compile(r"(`+)(.+?)\1", re.DOTALL)
LINK = re.compile(r"!?\[[^\]]*\]\(([^)\s]+)\)")
HEADING = re.compile(r"^#{1,6} (.+)$", re.MULTILINE)
FOLDERS = "benchmarks|configs|docs|firmware_host|procedures|rig|tests"
NAMED_PATH = re.compile(rf"(?<![\w./-])(?:{FOLDERS})/[\w./<>*-]*\w/?")
NAMES_ALONE = re.compile(r"\((`[a-z]\w*_\w+`(?:(?:, | or | and )(?:`\w+`|…))*)\)")  # an error behind what it is about
NO_ERRORS = {"board_scale", "board_bias", "degenerate", "not_converged"}  # checks, and outcomes on the board
SNAKE_CASE = re.compile(r"[a-z][a-z0-9]*(?:_[a-z0-9]+)+")
SOURCES = (
    *("rig/**/*.py", "firmware_host/**/*.[ch]", "firmware_host/**/*.py", "procedures/*.py", "configs/**/*.yaml"),
    "tests/support/**/*.py",
)
OF_OTHERS = {"ur_description"}
WIDTH = 128
LEFT_OUT = "--left-out"  # no command has it
NUMBERS = {"N": "1"}  # what a page writes where the command wants a number


def page_name(page: Path) -> str:
    return str(page.relative_to(ROOT))


def prose(page: Path) -> str:
    """The page without its code."""
    return INLINE.sub("", FENCE.sub("", page.read_text(encoding="utf-8")))


@cache
def anchors(page: Path) -> set[str]:
    """The names under which a page's headings can be linked, as GitHub makes them."""
    text = FENCE.sub("", page.read_text(encoding="utf-8"))
    return {re.sub(r"[^\w\- ]", "", heading.lower()).strip().replace(" ", "-") for heading in HEADING.findall(text)}


def code(page: Path) -> Iterator[tuple[str, bool]]:
    """Every line of the page's code blocks without its comment, and every inline code; whether it stood inline."""
    text = page.read_text(encoding="utf-8")
    for language, block in FENCE.findall(text):
        if language in ("", "text", "sh"):
            yield from ((re.split(r"\s#", line)[0].strip(), False) for line in block.splitlines())
    for _, words in INLINE.findall(FENCE.sub("", text)):
        yield " ".join(words.replace("\\|", "|").split()), True


def commands(page: Path) -> Iterator[tuple[str, list[str], bool]]:
    """Every `rig …` of the page: as written, its arguments with all that is optional, whether it stood inline."""
    for written, inline in code(page):
        if written == "rig" or not re.match(r"(?:\.venv/bin/)?rig\s", written) or written.startswith("rig: "):
            continue
        words = shlex.split(re.sub(r"[\[\]…]", " ", written.split(" > ")[0]))[1:]
        if "--help" in words:  # ends everything else
            continue
        yield written, [NUMBERS.get(word, word) for word in words], inline


def test_every_link_and_anchor_leads_somewhere() -> None:
    lost = []
    for page in PAGES:
        for link in LINK.findall(prose(page)):
            if link.startswith(("https://", "http://")):
                continue
            path, _, anchor = link.partition("#")
            target = (page.parent / path).resolve() if path else page
            if not target.exists():
                lost.append(f"{page_name(page)}: {link} leads nowhere")
            elif anchor and anchor not in anchors(target):
                lost.append(f"{page_name(page)}: {link}: no such heading; there are {sorted(anchors(target))}")
    assert not lost


def test_every_path_a_page_names_exists() -> None:
    named = {
        (re.sub(r"<\w+>", "*", path.rstrip("/")), f"{page_name(page)}: {path} in {written!r} is not there")
        for page in PAGES
        for written, _ in code(page)
        for path in NAMED_PATH.findall(written)
    }
    assert not [said for pattern, said in sorted(named) if not any(ROOT.glob(pattern))]


def words_of_the_source() -> set[str]:
    files = [file for pattern in SOURCES for file in ROOT.glob(pattern)]
    return {word for file in files for word in re.findall(r"\w+", file.read_text(encoding="utf-8"))}


def test_every_error_a_page_names_is_in_the_catalogue() -> None:
    """An error stands in parentheses, alone or among others: "refuses an arm that was moved (`arm_moved`)"."""
    known = {entry.name for entry in catalogue()} | NO_ERRORS
    for page in PAGES:
        text = " ".join(FENCE.sub("", page.read_text(encoding="utf-8")).split())
        named = {name for alone in NAMES_ALONE.findall(text) for name in re.findall(r"\w+", alone)}
        assert named <= known, page_name(page)


@pytest.mark.slow
def test_every_name_on_a_page_stands_in_the_source() -> None:
    """Errors wherever they stand, checks, columns, keys: what was renamed there must not live on here."""
    known = words_of_the_source() | {entry.name for entry in catalogue()} | OF_OTHERS
    for page in PAGES:
        named = {written for written, inline in code(page) if inline and SNAKE_CASE.fullmatch(written)}
        assert named <= known, page_name(page)


def test_no_line_but_a_tables_is_too_wide() -> None:
    for page in PAGES:
        lines = enumerate(FENCE.sub("", page.read_text(encoding="utf-8")).splitlines(), start=1)
        wide = [number for number, line in lines if len(line) > WIDTH and not line.startswith("|")]
        assert not wide, page_name(page)


@pytest.mark.slow
def test_every_command_a_page_shows_is_one(
    capsys: pytest.CaptureFixture[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Nothing is run: each command line gets an argument that no command has, which must be all it is refused for."""
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path))
    note_run(tmp_path)  # there is a latest run
    shown = {
        (tuple(arguments), inline): f"{page_name(page)}: {written!r}"
        for page in PAGES
        for written, arguments, inline in commands(page)
    }
    for (arguments, inline), where in shown.items():
        with pytest.raises(SystemExit):
            main([*arguments, LEFT_OUT])
        complaint = capsys.readouterr().err.splitlines()[0]
        only_named = inline and all(re.fullmatch("[a-z]+", word) for word in arguments)
        missing = only_named and "the following arguments are required" in complaint
        missing |= inline and complaint.endswith(f"argument {arguments[-1]}: expected one argument")
        has_no_run = "no run folder of yours is known" in complaint  # nothing ran here
        is_command = missing or has_no_run or complaint.endswith(f"unrecognized arguments: {LEFT_OUT}")
        assert is_command, f"{where}: {complaint}"
