"""Where only a wheel is installed there are no pages, so no message, help or instruction sends anybody to one."""

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

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
SOURCES = [path for top in ("rig", "firmware_host", "procedures") for path in sorted((ROOT / top).rglob("*.py"))]
PATHS = [path for path in SOURCES if "docs/" in path.read_text(encoding="utf-8")]


def shown_texts(path: Path) -> Iterator[str]:
    """Yield the texts of a module that users may see; of a procedure its docstring too, which is its help."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
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


@pytest.mark.parametrize("path", PATHS, ids=lambda path: str(path.relative_to(ROOT)))
def test_no_text_names_a_page_that_a_wheel_does_not_have(path: Path) -> None:
    if str(path.relative_to(ROOT)) not in ALLOWED:
        assert not [PAGE.findall(text) for text in shown_texts(path) if PAGE.search(text)]


def test_the_catalogue_of_errors_names_no_page() -> None:
    rows = [line for line in TABLE.read_text(encoding="utf-8").splitlines() if not line.startswith("#")]
    assert not [row for row in rows if PAGE.search(row)]
