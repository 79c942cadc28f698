"""`help()` of one module, class or function alone tells what it is: its docstring begins with its subject."""

import ast
import re
from collections.abc import Iterator
from pathlib import Path

import pytest

REPOSITORY = Path(__file__).parents[2]
SHAPE = re.compile(r"\([^)]*\)[,:]? ?")  # "(3,) biases" begins with the biases
POINTS_ELSEWHERE = (
    *("it", "its", "they", "them", "their", "this", "that", "these", "those", "both", "none", "nothing", "all but one"),
    *("the same", "as", "or", "and", "but", "also", "always", "never", "only", "not", "all of it", "all of them"),
    *("of", "by", "in", "into", "on", "at", "to", "for", "with", "without", "between", "until", "before", "after"),
    *("out of", "inside", "since", "while", "unless", "under", "around", "along", "less", "just", "from now on"),
    *(".", ","),
)
WITHOUT_SUBJECT = re.compile(rf"({'|'.join(map(re.escape, POINTS_ELSEWHERE))})(\W|$)|$", re.IGNORECASE)


@pytest.mark.slow
def test_every_docstring_begins_with_what_it_is_about() -> None:
    modules = [*(REPOSITORY / "rig").rglob("*.py"), *(REPOSITORY / "firmware_host").rglob("*.py")]
    assert [found for module in sorted(modules) for found in _without_subject(module)] == []


def _without_subject(module: Path) -> Iterator[str]:
    for node in ast.walk(ast.parse(module.read_text("utf-8"))):
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef):
            text = ast.get_docstring(node)
            if text is not None and WITHOUT_SUBJECT.match(SHAPE.sub("", text, count=1) if text[0] == "(" else text):
                yield f"{module.relative_to(REPOSITORY)}:{node.body[0].lineno}: {text.splitlines()[0]}"
