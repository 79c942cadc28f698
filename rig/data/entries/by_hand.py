"""What `result.json` says of a gyroscope that a hand turned on a table."""

from typing import Literal

from rig.data.entries.result_types import Entry


class RestByHandEntry(Entry):
    """A rest: which axis of the body pointed upwards, null on no face, and how far it is off the others.

    `normalised_residual` is its largest residual over what such residuals are.
    """

    face: str | None
    normalised_residual: float


class MoveByHandEntry(Entry):
    """A move from a rest to the next: a flip to another face, or so many whole turns on a face, by `angle_rad` in all.

    `closure_error_rad` is by how much a turn missed where it began, null of flips and where no edge was stated.
    """

    kind: Literal["flip", "turn", "omitted"]
    angle_rad: float
    turns: int
    normalised_residual: float
    closure_error_rad: float | None


class HandErrorEntry(Entry):
    """How large an error of a hand or a part was found to be, what is stated of it, and what is refused."""

    name: str
    estimate: float
    stated: float
    limit: float


class ByHandEntry(Entry):
    """A session by hand: its rests and moves, and what was found of the hand.

    `chi_square` is what the solution leaves of all rests and moves, with so many degrees of `degrees_of_freedom`.
    `session_std` (3,) of the scale is by this session and its clock alone; the budget has beside them by how much
    recordings of real hands have been seen to disagree with themselves.
    """

    rests: tuple[RestByHandEntry, ...]
    moves: tuple[MoveByHandEntry, ...]
    errors: tuple[HandErrorEntry, ...]
    chi_square: float
    degrees_of_freedom: float
    session_std: tuple[float, float, float]
