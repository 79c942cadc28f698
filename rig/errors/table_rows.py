"""The rows of the tables of words: a line each, its cells between bars, comments behind `#`."""

from collections.abc import Collection, Iterator
from pathlib import Path


def read_rows(table: Path, form: str, column: int = 0, allowed: Collection[str] | None = None) -> Iterator[list[str]]:
    """Yield the cells of each row; the cell of `column` must be in `allowed`, if given.

    Raise ValueError naming a line that does not have the cells of `form`.
    """
    for number, line in enumerate(table.read_text(encoding="utf-8").splitlines(), 1):
        if line.startswith("#"):
            continue
        cells = line.split(" | ")
        if len(cells) != len(form.split(" | ")) or (allowed is not None and cells[column] not in allowed):
            raise ValueError(f"{table.name}, line {number}: not `{form}`")
        yield cells
