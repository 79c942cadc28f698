"""A table that fits the terminal by omitting columns, never by cutting a name or a number."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from rich.cells import cell_len
from rich.console import Console, ConsoleOptions, JustifyMethod, RenderResult
from rich.table import Table

from rig.history.series import Trend
from rig.station.plain_text import plain

BLOCKS = "▁▂▃▄▅▆▇█"
PLAIN_BLOCKS = str.maketrans(BLOCKS, "__..--''")  # for a terminal without blocks
MAX_RESULTS = 16  # the newest

FRAME_STROKES, CELL_FRAME = 1, 3  # width of the frame: one stroke, and for each cell two spaces and a stroke


@dataclass(frozen=True, slots=True)
class TableColumn:
    """A table's column, with a `rank` that decides which columns are omitted if not all fit.

    The column of the highest rank is omitted first; a column of rank 0 is never omitted. Before a column is omitted, it
    is replaced by its `shorter` column, if any. A column that `wraps` may use several lines, and is at least `least`
    cells wide.
    """

    heading: str
    cells: Sequence[str]
    rank: int = 0
    number: bool = False
    shorter: "TableColumn | None" = None
    wraps: bool = False
    least: int = 12

    @property
    def width(self) -> int:
        """The number of terminal cells that the column needs."""
        longest = max(map(cell_len, self.cells), default=0)
        return max(cell_len(self.heading), min(longest, self.least) if self.wraps else longest)


@dataclass(frozen=True, slots=True)
class FittingTable:
    """A table that shows as many of its `columns` as fit. On an ASCII-only terminal, block characters are replaced."""

    title: str
    columns: Sequence[TableColumn]

    def fitting(self, width: int) -> list[TableColumn]:
        """Return the columns that fit into `width` cells, without empty columns."""
        shown = [column for column in self.columns if any(column.cells)]
        while _total_width(shown) > width:
            first = max(shown, key=lambda column: column.rank)
            if first.rank == 0:
                break
            if first.shorter is None:
                shown.remove(first)
            else:
                shown[shown.index(first)] = first.shorter
        return shown

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> RenderResult:
        """Yield the table that rich prints."""
        columns = self.fitting(options.max_width)
        fits = _total_width(columns) <= options.max_width  # otherwise it is folded, never cut
        table = Table(title=plain(self.title, "table.title"), title_justify="left")
        for column in columns:
            side: JustifyMethod = "right" if column.number else "left"
            table.add_column(column.heading, justify=side, no_wrap=fits and not column.wraps, overflow="fold")
        for row in zip(*(column.cells for column in columns), strict=True):
            table.add_row(*(plain(cell.translate(PLAIN_BLOCKS) if options.ascii_only else cell) for cell in row))
        yield table


def _total_width(columns: Sequence[TableColumn]) -> int:
    return sum(column.width + CELL_FRAME for column in columns) + FRAME_STROKES


def picture(trend: Trend) -> str:
    """Return a block for each of the newest results, whose height shows the value.

    The lowest block is the lowest value − U, the highest block the highest value + U, so values with equal blocks
    differ by less than U. The text is empty for a single result.
    """
    newest = trend.parameters[-MAX_RESULTS:]
    if len(newest) < 2:
        return ""
    values, widths = (np.array([getattr(parameter, name) for parameter in newest]) for name in ("value", "expanded"))
    low, high = (values - widths).min(), (values + widths).max()
    heights = (values - low) / (high - low)
    return "".join(BLOCKS[min(int(height * len(BLOCKS)), len(BLOCKS) - 1)] for height in heights)
