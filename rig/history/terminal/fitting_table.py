"""A table that fits the terminal: it leaves out columns, and cuts no name and no number."""

from collections.abc import Sequence
from dataclasses import dataclass

from rich.cells import cell_len
from rich.console import Console, ConsoleOptions, JustifyMethod, RenderResult
from rich.table import Table

from rig.history.terminal.spark import PLAIN
from rig.station.plain_text import plain

STROKES, ROUND_A_CELL = 1, 3  # what the frame adds: a stroke, and to each cell two blanks and a stroke


@dataclass(frozen=True, slots=True)
class Column:
    """A column with its `heading`. Of those that do not fit, the one of the highest `rank` goes first; 0 stays.

    Where there is little room a `shorter` one takes its place first. One that `wraps` may use several lines for what it
    says, and is then `least` cells wide.
    """

    heading: str
    cells: Sequence[str]
    rank: int = 0
    number: bool = False
    shorter: "Column | None" = None
    wraps: bool = False
    least: int = 12

    @property
    def width(self) -> int:
        """How many cells of the terminal it needs."""
        longest = max(map(cell_len, self.cells), default=0)
        return max(cell_len(self.heading), min(longest, self.least) if self.wraps else longest)


@dataclass(frozen=True, slots=True)
class FittingTable:
    """A table of `columns`; which of them are shown depends on the room there is.

    Where a terminal has letters alone, blocks become some.
    """

    title: str
    columns: Sequence[Column]

    def fitting(self, width: int) -> list[Column]:
        """The columns that are shown in `width` cells; one that holds nothing is not."""
        shown = [each for each in self.columns if any(each.cells)]
        while _needed(shown) > width:
            first = max(shown, key=lambda each: each.rank)
            if first.rank == 0:
                break
            if first.shorter is None:
                shown.remove(first)
            else:
                shown[shown.index(first)] = first.shorter
        return shown

    def __rich_console__(self, console: Console, options: ConsoleOptions) -> RenderResult:
        """What rich prints of it."""
        columns = self.fitting(options.max_width)
        fits = _needed(columns) <= options.max_width  # else it is folded: nothing is ever cut
        table = Table(title=plain(self.title, "table.title"), title_justify="left")
        for each in columns:
            side: JustifyMethod = "right" if each.number else "left"
            table.add_column(each.heading, justify=side, no_wrap=fits and not each.wraps, overflow="fold")
        for row in zip(*(each.cells for each in columns), strict=True):
            table.add_row(*(plain(each.translate(PLAIN) if options.ascii_only else each) for each in row))
        yield table


def _needed(columns: Sequence[Column]) -> int:
    return sum(each.width + ROUND_A_CELL for each in columns) + STROKES
