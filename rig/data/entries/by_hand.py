"""Gyroscopes turned by hand in `result.json`."""

from typing import Literal

from rig.data.entries.result_types import Entry


class RestByHandEntry(Entry):
    """A rest: the body's axis that pointed upwards, null on no face, and the agreement with other rests.

    `normalised_residual` is the rest's largest residual over its standard deviation.
    """

    face: str | None
    normalised_residual: float


class MoveByHandEntry(Entry):
    """A move from one rest to the next: a flip to another face, or whole `turns` on a face.

    `angle_rad` is the angle turned. `closure_error_rad` is the angle by which a turn missed its start; null for flips,
    and if turns were not made against an edge.
    """

    kind: Literal["flip", "turn", "omitted"]
    angle_rad: float
    turns: int
    normalised_residual: float
    closure_error_rad: float | None


class HandErrorEntry(Entry):
    """The size of one error of the hand or of the part: as estimated and as stated, and the limit of the estimate."""

    name: str
    estimate: float
    stated: float
    limit: float


class ByHandEntry(Entry):
    """A session by hand: its rests and moves, and the errors of the hand.

    `chi_square`, with `degrees_of_freedom`, is χ² of the residuals of all rests and moves. `session_std` (3,) is the
    standard uncertainty of the scale factors from this session and its clock alone; the budget adds the disagreement
    among recordings of real hands.
    """

    rests: tuple[RestByHandEntry, ...]
    moves: tuple[MoveByHandEntry, ...]
    errors: tuple[HandErrorEntry, ...]
    chi_square: float
    degrees_of_freedom: float
    session_std: tuple[float, float, float]
