"""Two drawings of the packages, from the layers contracts in pyproject.toml: the packages, and the order inside each.

    PYTHONPATH=tests python -m support.house_picture

draws both again in docs/architecture.md, between their markers.
"""

import ast
import re
import textwrap
import tomllib

from support.paths import DOCS, ROOT

PAGE = DOCS / "architecture.md"
BEGIN = "<!-- drawn from pyproject.toml by tests/support/house_picture.py -->\n```text\n"
BEGIN_INSIDE = "<!-- the order inside, drawn from pyproject.toml by tests/support/house_picture.py -->\n```text\n"
END = "```\n<!-- end of the drawing -->\n"
NAMES = 15  # columns of a room's name
WORDS = 92  # columns of its content


def picture() -> str:
    """Return the drawing of the packages: scripts above them in the contract's order, the board's half below."""
    rooms = [[(name, f"rig/{name}") for name in layer] for layer in _contracts()["rig"]]
    layers = [[("procedures", "procedures")], *rooms, [("firmware_host", "firmware_host")]]
    rows = ["".join(_row(name, _read_summary(path)) for name, path in layer) for layer in layers]
    return _rule("┌", "┬", "┐") + _rule("├", "┼", "┤").join(rows) + _rule("└", "┴", "┘")


def inside() -> str:
    """Return the drawing of each package's inside: layers from top to bottom, folders with a slash."""
    rooms = {name: layers for name, layers in _contracts().items() if name != "rig"}
    rows = ["".join(_inside(name.replace(".", "/"), layers)) for name, layers in rooms.items()]
    return _rule("┌", "┬", "┐") + _rule("├", "┼", "┤").join(rows) + _rule("└", "┴", "┘")


def _inside(path: str, layers: list[list[str]]) -> list[str]:
    lines = ["  ".join(f"{name}/" if (ROOT / path / name).is_dir() else name for name in layer) for layer in layers]
    short = path.removeprefix("rig/")
    return [_row(short if index == 0 else "", line) for index, line in enumerate(lines)]


def _rule(start: str, middle: str, right: str) -> str:
    return f"{start}{'─' * (NAMES + 2)}{middle}{'─' * (WORDS + 2)}{right}\n"


def _contracts() -> dict[str, list[list[str]]]:
    """Return each package that has a layers contract, with the names on its layers from the top."""
    written = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["importlinter"]["contracts"]
    return {
        container: [[name.strip() for name in re.split(r"[|:]", layer)] for layer in contract["layers"]]
        for contract in written
        if contract["type"] == "layers"
        for container in contract["containers"]
    }


def _read_summary(path: str) -> str:
    """Return the first line of a package's docstring."""
    package = ROOT / path / "__init__.py"
    source = package if package.exists() else ROOT / f"{path}.py"
    docstring = ast.get_docstring(ast.parse(source.read_text(encoding="utf-8")))
    assert docstring, f"{source} has no docstring"
    return docstring.splitlines()[0]


def _row(name: str, texts: str) -> str:
    words = textwrap.wrap(texts, WORDS, break_on_hyphens=False)
    names = [name, *[""] * (len(words) - 1)]
    return "".join(f"│ {label:{NAMES}} │ {right:{WORDS}} │\n" for label, right in zip(names, words, strict=True))


def drawn(page: str) -> str:
    """Return the page with both drawings made again."""
    return _replace_drawing(_replace_drawing(page, BEGIN, picture()), BEGIN_INSIDE, inside())


def _replace_drawing(page: str, begin: str, drawing: str) -> str:
    before, rest = page.split(begin)
    _, after = rest.split(END, maxsplit=1)
    return before + begin + drawing + END + after


if __name__ == "__main__":
    PAGE.write_text(drawn(PAGE.read_text(encoding="utf-8")), encoding="utf-8")
