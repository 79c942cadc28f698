"""Where only a wheel is installed there are no pages, so no message, help or instruction sends anybody to one."""

import ast
import re
from collections.abc import Iterator
from pathlib import Path

from rig.errors.catalogue import TABLE
from support.paths import ROOT

PAGE = re.compile(r"\bdocs/[\w/-]+\.md")
ALLOWED = {  # what makes the pages, shows a page only if it is there, or names the pages of a version on paper
    "rig/cli.py",
    "rig/commands/documents/explain.py",
    "rig/config/reference_page.py",
    "rig/errors/errors_page.py",
    "rig/report/certificate/dcc.py",
    "rig/report/certificate/method_words.py",
    "rig/report/words/checks_page.py",
    "rig/report/words/glossary_page.py",
}
SOURCES = ("rig", "firmware_host", "procedures")


def shown_texts(path: Path, source: str) -> Iterator[str]:
    """Yield the texts of a module that users may see; of a procedure its docstring too, which is its help."""
    tree = ast.parse(source)
    documented = (ast.Module, ast.ClassDef, ast.FunctionDef)
    docstrings = {
        id(node.body[0].value)
        for node in ast.walk(tree)
        if isinstance(node, documented) and node.body and isinstance(node.body[0], ast.Expr)
    }
    for node in ast.walk(tree):
        is_shown = id(node) not in docstrings or path.parent.name == "procedures"
        if is_shown and isinstance(node, ast.Constant) and isinstance(node.value, str):
            yield node.value


def test_no_text_names_a_page_that_a_wheel_does_not_have() -> None:
    paths = [path for top in SOURCES for path in sorted((ROOT / top).rglob("*.py"))]
    assert [
        f"{path.relative_to(ROOT)}: {PAGE.findall(text)}"
        for path in paths
        if str(path.relative_to(ROOT)) not in ALLOWED and PAGE.search(source := path.read_text(encoding="utf-8"))
        for text in shown_texts(path, source)
        if PAGE.search(text)
    ] == []


def test_the_catalogue_of_errors_names_no_page() -> None:
    rows = [line for line in TABLE.read_text(encoding="utf-8").splitlines() if not line.startswith("#")]
    assert not [row for row in rows if PAGE.search(row)]
