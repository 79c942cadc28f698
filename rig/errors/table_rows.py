"""Reads the program's tables of words: a row is a line, its cells are separated by ` | `, comments begin with `#`."""

from collections.abc import Collection, Iterator
from pathlib import Path


def read_rows(table: Path, form: str, column: int = 0, allowed: Collection[str] | None = None) -> Iterator[list[str]]:
    """Yield the cells of each row.

    `form` names the cells, such as `name | meaning`. The cell with the index `column` must be in `allowed`, if given.
    Raise ValueError naming the first line of another form.
    """
    for number, line in enumerate(table.read_text(encoding="utf-8").splitlines(), 1):
        if line.startswith("#"):
            continue
        cells = line.split(" | ")
        if len(cells) != len(form.split(" | ")) or (allowed is not None and cells[column] not in allowed):
            raise ValueError(f"{table.name}, line {number}: not `{form}`")
        yield cells
