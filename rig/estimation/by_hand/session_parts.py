"""The parts of a session by hand: rests, and the moves from each rest to the next."""

from collections.abc import Collection, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise

import numpy as np

from rig.estimation.arrays import Array
from rig.estimation.earth import STANDARD_GRAVITY_M_S2

BOX_STD_RAD = float(np.radians(0.2))
MAX_MOVE_S = 10.0  # with a pause, beyond which bias and tilt of the pause affect it
FACES = ("+x", "-x", "+y", "-y", "+z", "-z")


@dataclass(frozen=True, slots=True)
class HandRest:
    """A rest from `start_s` to `end_s`, with `samples` readings of the gyroscope.

    `mean_rad_s` and `noise_rad_s` (3,) are the readings' mean and standard deviation. `acceleration_m_s2` and
    `acceleration_noise_m_s2` (3,) are those of an accelerometer's readings, None without an accelerometer.
    `rounding_rad_s` (3,): standard uncertainty of the mean due to coarse readings, the same error in every rest.
    """

    start_s: float
    end_s: float
    samples: int
    mean_rad_s: Array
    noise_rad_s: Array
    acceleration_m_s2: Array | None = None
    acceleration_noise_m_s2: Array | None = None
    rounding_rad_s: Array | float = 0.0

    @property
    def middle_s(self) -> float:
        return (self.start_s + self.end_s) / 2


@dataclass(frozen=True, slots=True)
class Move:
    """A move, from a time in the rest before it to a time in the rest after it; `peak_rad_s` is the largest reading.

    The rotation is unknown if readings are missing (`lost`), the gyroscope was at the end of its range (`clipped`), or
    the operator withdrew the move (`left_out`).
    """

    start_s: float
    end_s: float
    peak_rad_s: float
    lost: bool = False
    clipped: bool = False
    left_out: bool = False

    @property
    def is_usable(self) -> bool:
        """Whether the rotation of the move is measured."""
        return not (self.lost or self.clipped or self.left_out)


@dataclass(frozen=True, slots=True)
class HandRecording:
    """All readings (n, 3) at times (n,), the rests (N,), and the N − 1 moves between them.

    The body was held still in the air in the intervals `held_in_air_s`, and crept on the table in `creeping_s`. The
    rates at the times `spikes_s` are interpolated. `coarse_rad_s` (3,) are steps of the rates that are large enough to
    matter, 0 for finer ones.
    """

    time_s: Array
    rates: Array
    acceleration: Array | None
    rests: tuple[HandRest, ...]
    moves: tuple[Move, ...]
    held_in_air_s: tuple[tuple[float, float], ...] = ()
    creeping_s: tuple[tuple[float, float], ...] = ()
    spikes_s: tuple[float, ...] = ()
    coarse_rad_s: Array | float = 0.0


@dataclass(frozen=True, slots=True)
class SessionConditions:
    """Statements of the operator about a session.

    - `clock_ppm`: half-width of the clock's error; `clock_source` states where it comes from.
    - `box_rad`: standard deviation of the angles by which the faces deviate from those of a rectangular box.
    - `closure`: whether the body was turned against an edge, so that whole turns end where they began.
    - `first_face`: the axis of the body that first pointed upwards; needed without an accelerometer.
    """

    clock_ppm: float
    clock_source: str = "stated"
    box_rad: float = BOX_STD_RAD
    closure: bool = True
    first_face: str | None = None
    gravity_m_s2: float = STANDARD_GRAVITY_M_S2


@dataclass(frozen=True, slots=True)
class HandStds:
    """Standard deviations of a hand's errors, and of a sensor's errors outside the model.

    - `repeat_rad`: scatter of the attitude when a face is laid down again.
    - `closure_rad`: error of the heading after a whole turn.
    - `of_angle`: error of the rotation about each axis in a quarter turn, as a fraction of the angle.
    - `walk_rad_s_sqrt_s`: random walk of the bias from rest to rest.
    - `acceleration_m_s2`: error of an accelerometer's reading at rest, across the vertical.
    """

    repeat_rad: float = 3e-4
    closure_rad: float = 3e-3
    of_angle: float = 1e-4
    walk_rad_s_sqrt_s: float = 5e-6
    acceleration_m_s2: float = 0.002


STATED = HandStds()
MAX_STDS = HandStds(5e-3, 2e-2, 3e-3, 1e-3, 0.05)  # plausible errors of handling: beyond, something else happened


@dataclass(frozen=True, slots=True)
class RestFaces:
    """The face of each rest (N,), that is, the axis that pointed upwards, or None.

    `up` (N, 3) is this axis, or the measured vertical if the face is None; `turns` (N − 1,) are the signed numbers of
    whole turns in the moves.
    """

    faces: tuple[str | None, ...]
    up: Array
    turns: tuple[int, ...] = field(default=())


def drop_rests(session: HandRecording, rows: Collection[int]) -> HandRecording:
    """Return the session without the rests `rows`, in which the body crept; the moves around such a rest are merged."""
    kept = [row for row in range(len(session.rests)) if row not in rows]
    return replace(
        session,
        rests=tuple(session.rests[row] for row in kept),
        moves=tuple(merge_moves(session.moves[first:last]) for first, last in pairwise(kept)),
        creeping_s=tuple((session.rests[row].start_s, session.rests[row].end_s) for row in sorted(rows)),
    )


def merge_moves(moves: Sequence[Move]) -> Move:
    """Return consecutive moves as one, including the pauses between them.

    A long merged move is marked as left out, because the rotation during its pauses is unknown.
    """
    long = len(moves) > 1 and moves[-1].end_s - moves[0].start_s > MAX_MOVE_S
    return Move(
        moves[0].start_s,
        moves[-1].end_s,
        max(move.peak_rad_s for move in moves),
        any(move.lost for move in moves),
        any(move.clipped for move in moves),
        long or any(move.left_out for move in moves),
    )


def nearest_face(direction: Array) -> str:
    """Return the name of the face whose axis is nearest to a direction (3,)."""
    axis = int(np.argmax(np.abs(direction)))
    return ("-" if direction[axis] < 0 else "+") + "xyz"[axis]
