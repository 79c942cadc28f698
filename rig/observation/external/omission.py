"""Parts of a recording that a solution leaves out: counted, with the reason and the first of them."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Omitted:
    """The number, out of a `total`, of `what` (rows, increments, readings) was left out, for a `reason` in words.

    `first` locates the first of them: its row, its time.
    """

    what: str
    count: int
    total: int
    reason: str
    first: str

    def __str__(self) -> str:
        return f"{self.count} of {self.total} {self.what}, {self.reason}; the first {self.first}"
