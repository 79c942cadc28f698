"""`help()` of one module, class or function alone tells what it is: its docstring begins with its subject."""

import ast
from collections.abc import Iterator
from pathlib import Path

REPOSITORY = Path(__file__).parents[2]
POINTS_ELSEWHERE = (
    *("It", "Its", "They", "Them", "Their", "This", "That", "These", "Those", "Both", "None", "Nothing", "One of them"),
    *("The same", "As", "Or", "And", "But", "Also", "Always", "Never", "Only", "Not", "All of it", "All of them"),
    *("Of", "By", "In", "Into", "On", "At", "To", "For", "With", "Without", "Between", "Until", "Before", "After"),
)


def test_every_docstring_begins_with_what_it_is_about() -> None:
    modules = [*(REPOSITORY / "rig").rglob("*.py"), *(REPOSITORY / "firmware_host").rglob("*.py")]
    assert [found for module in sorted(modules) for found in _without_subject(module)] == []


def _without_subject(module: Path) -> Iterator[str]:
    for node in ast.walk(ast.parse(module.read_text("utf-8"))):
        if isinstance(node, ast.Module | ast.ClassDef | ast.FunctionDef | ast.AsyncFunctionDef):
            text = ast.get_docstring(node) or ""
            if text.startswith(tuple(f"{words}{end}" for words in POINTS_ELSEWHERE for end in " ,.:;\n")):
                line = node.body[0].lineno
                yield f"{module.relative_to(REPOSITORY)}:{line}: {text.splitlines()[0]}"
