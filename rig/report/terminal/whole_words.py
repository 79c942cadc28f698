"""Fits a table into a terminal without cutting words: columns shrink to their longest word, then lose the frame."""

from rich import box
from rich.cells import cell_len
from rich.table import Table

# Characters of a column in addition to its words: two blanks and a stroke; two blanks at most without a frame.
FRAMED_PADDING, BARE_PADDING = 3, 2
STROKE = 1


def fit_words(table: Table, width: int) -> Table:
    """Return the table with columns that fit `width` cells of a terminal; no column is narrower than its words."""
    texts = [[str(column.header), *map(str, column.cells), str(column.footer)] for column in table.columns]
    lines = [max(cell_len(line) for text in column for line in text.split("\n")) for column in texts]
    words = [
        max((cell_len(word) for text in column for word in text.replace("\n", " ").split(" ")), default=0)
        for column in texts
    ]
    room = width - FRAMED_PADDING * len(lines) - STROKE
    if sum(lines) <= room:
        return table
    if sum(words) > room:
        table.box, table.padding, room = box.SIMPLE, (0, 0), width - BARE_PADDING * len(lines)
    spare = max(room - sum(words), 0)
    wished = [line - word for line, word in zip(lines, words, strict=True)]
    for column, word, wish in zip(table.columns, words, wished, strict=True):
        column.width = word + (min(wish, spare * wish // sum(wished)) if sum(wished) else 0)
    return table
