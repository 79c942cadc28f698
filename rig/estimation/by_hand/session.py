"""What a session by hand consists of: rests, and the moves from each rest to the next."""

from collections.abc import Collection, Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise

import numpy as np

from rig.estimation.arrays import Array
from rig.estimation.earth import STANDARD_GRAVITY_M_S2

BOX_RAD = float(np.radians(0.2))
LONGEST_S = 10.0  # of a move with a pause in it, which the bias and the tilt of the pause are in
FACES = ("+x", "-x", "+y", "-y", "+z", "-z")


@dataclass(frozen=True, slots=True)
class Rest:
    """A rest from `start_s` to `end_s`: mean reading (3,) of so many `samples`, their scatter (3,).

    With an accelerometer, its mean reading (3,) and scatter (3,) as well.
    """

    start_s: float
    end_s: float
    samples: int
    mean_rad_s: Array
    noise_rad_s: Array
    acceleration_m_s2: Array | None = None
    acceleration_noise_m_s2: Array | None = None


@dataclass(frozen=True, slots=True)
class Move:
    """A move, from inside the rest before it to inside the rest after; `peak_rad_s` is its largest reading of an axis.

    `lost`: readings are missing; `clipped`: the gyroscope was at its end; `left_out`: somebody took it back. None of
    these says how the body turned.
    """

    start_s: float
    end_s: float
    peak_rad_s: float
    lost: bool = False
    clipped: bool = False
    left_out: bool = False

    @property
    def tells(self) -> bool:
        return not (self.lost or self.clipped or self.left_out)


@dataclass(frozen=True, slots=True)
class Handled:
    """All readings (n, 3) at times (n,), rests (N,), the N − 1 moves between, and when the body was held in the air.

    `crept`: when it crept where it lay, which is no rest of the session.
    """

    time_s: Array
    rates: Array
    acceleration: Array | None
    rests: tuple[Rest, ...]
    moves: tuple[Move, ...]
    held: tuple[tuple[float, float], ...] = ()
    crept: tuple[tuple[float, float], ...] = ()


@dataclass(frozen=True, slots=True)
class Told:
    """What somebody says of a session: nothing of it can be seen in the readings, but for the faces' squareness.

    - `clock_ppm`: half-width of what the time stamps may be off; `clock_source` says of whom that is known.
    - `box_rad`: how far the faces are out of square.
    - `closure`: turns on a face were against an edge, and end where they began.
    - `first_face`: the axis of the body that pointed upwards at first; needed where there is no accelerometer.
    """

    clock_ppm: float
    clock_source: str = "stated"
    box_rad: float = BOX_RAD
    closure: bool = True
    first_face: str | None = None
    gravity_m_s2: float = STANDARD_GRAVITY_M_S2


@dataclass(frozen=True, slots=True)
class Sizes:
    """Standard deviations of what a hand does, and of what a part does that the model does not say.

    - `repeat_rad`: a face that is laid down again; `closure_rad`: the heading after a whole turn.
    - `of_angle`: of the angle of a quarter turn, about each axis; `walk_rad_s_sqrt_s`: of the bias from rest to rest.
    - `acceleration_m_s2`: of an accelerometer's reading at rest, across the vertical.
    """

    repeat_rad: float = 3e-4
    closure_rad: float = 3e-3
    of_angle: float = 1e-4
    walk_rad_s_sqrt_s: float = 5e-6
    acceleration_m_s2: float = 0.002


STATED = Sizes()
LARGEST = Sizes(5e-3, 2e-2, 3e-3, 1e-3, 0.05)  # beyond, it is not what it was taken for


@dataclass(frozen=True, slots=True)
class Faced:
    """Which axis of the body pointed upwards at each rest (N,), None on no face; `up` (N, 3) is it or as read.

    `turns` (N − 1,) of each move: whole turns on its face, 0 where it was none.
    """

    faces: tuple[str | None, ...]
    up: Array
    turns: tuple[int, ...] = field(default=())


def without_crept(session: Handled, rows: Collection[int]) -> Handled:
    """Return the session without the rests `rows`, in which the body crept: pauses of the moves through them."""
    kept = [row for row in range(len(session.rests)) if row not in rows]
    return replace(
        session,
        rests=tuple(session.rests[row] for row in kept),
        moves=tuple(joined(session.moves[first:last]) for first, last in pairwise(kept)),
        crept=tuple((session.rests[row].start_s, session.rests[row].end_s) for row in sorted(rows)),
    )


def joined(moves: Sequence[Move]) -> Move:
    """Return moves one after the other, with the pauses between them, as one.

    A long one is left out, for not enough is known of its pauses.
    """
    long = len(moves) > 1 and moves[-1].end_s - moves[0].start_s > LONGEST_S
    return Move(
        moves[0].start_s,
        moves[-1].end_s,
        max(each.peak_rad_s for each in moves),
        any(each.lost for each in moves),
        any(each.clipped for each in moves),
        long or any(each.left_out for each in moves),
    )


def axis_of(face: str) -> Array:
    """(3,) unit vector of a face's name."""
    return np.asarray((1.0 if face[0] == "+" else -1.0) * np.eye(3)["xyz".index(face[1])], dtype=np.float64)


def nearest_face(direction: Array) -> str:
    """The name of the face whose axis is nearest to a direction (3,)."""
    axis = int(np.argmax(np.abs(direction)))
    return ("-" if direction[axis] < 0 else "+") + "xyz"[axis]
