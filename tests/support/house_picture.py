"""The house in one picture: the layers contract of pyproject.toml, each room with the first line of its docstring.

    PYTHONPATH=tests python -m support.house_picture

draws it anew in docs/architecture.md, between the two markers.
"""

import ast
import re
import textwrap
import tomllib

from support.paths import DOCS, ROOT

PAGE = DOCS / "architecture.md"
BEGIN = "<!-- drawn from pyproject.toml by tests/support/house_picture.py -->\n```text\n"
END = "```\n<!-- end of the drawing -->\n"
NAMES = 15  # columns of a room's name
WORDS = 92  # columns of what is in it


def picture() -> str:
    """The page's drawing: scripts above the rooms in the contract's order, the board's half below."""
    layers = [[("procedures", "procedures")], *_layers(), [("firmware_host", "firmware_host")]]
    rows = ["".join(_row(name, _said(path)) for name, path in layer) for layer in layers]
    return _rule("┌", "┬", "┐") + _rule("├", "┼", "┤").join(rows) + _rule("└", "┴", "┘")


def _rule(left: str, middle: str, right: str) -> str:
    return f"{left}{'─' * (NAMES + 2)}{middle}{'─' * (WORDS + 2)}{right}\n"


def _layers() -> list[list[tuple[str, str]]]:
    """Name and path of every room, layer by layer from the top."""
    contracts = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["importlinter"][
        "contracts"
    ]
    (contract,) = (each for each in contracts if each["type"] == "layers")
    return [
        [(name.strip(), f"rig/{name.strip()}") for name in re.split(r"[|:]", layer)] for layer in contract["layers"]
    ]


def _said(path: str) -> str:
    """The first line of a room's docstring."""
    package = ROOT / path / "__init__.py"
    source = package if package.exists() else ROOT / f"{path}.py"
    docstring = ast.get_docstring(ast.parse(source.read_text(encoding="utf-8")))
    assert docstring, f"{source} has no docstring"
    return docstring.splitlines()[0]


def _row(name: str, said: str) -> str:
    words = textwrap.wrap(said, WORDS)
    names = [name, *[""] * (len(words) - 1)]
    return "".join(f"│ {left:{NAMES}} │ {right:{WORDS}} │\n" for left, right in zip(names, words, strict=True))


def drawn(page: str) -> str:
    """The page with its drawing made anew."""
    before, rest = page.split(BEGIN)
    _, after = rest.split(END)
    return before + BEGIN + picture() + END + after


if __name__ == "__main__":
    PAGE.write_text(drawn(PAGE.read_text(encoding="utf-8")), encoding="utf-8")
