"""What a solution leaves out of a recording: counted, with the reason and the first of it."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Omitted:
    """So many of a `total` of `what` (rows, increments, readings) that were left out, for a `reason` in words.

    `first` says where the first of them is: its row, its time.
    """

    what: str
    count: int
    total: int
    reason: str
    first: str

    def __str__(self) -> str:
        return f"{self.count} of {self.total} {self.what}, {self.reason}; the first {self.first}"
