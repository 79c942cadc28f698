"""Parts of a recording that a solution leaves out: their count, the reason, and the first of them."""

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Omitted:
    """An omission: `count` out of a `total` of `what` (rows, increments, readings), for a `reason` in words.

    `first` gives the row or time of the first one omitted.
    """

    what: str
    count: int
    total: int
    reason: str
    first: str

    def __str__(self) -> str:
        return f"{self.count} of {self.total} {self.what}, {self.reason}; the first {self.first}"
