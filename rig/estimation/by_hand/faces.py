"""The faces on which the body lay: an accelerometer reads them, else they follow from the first one."""

import numpy as np

from rig.errors import Refused
from rig.estimation.arrays import Array
from rig.estimation.by_hand.moves import Moved
from rig.estimation.by_hand.session import FACES, Faced, Handled, Told, axis_of

ON_FACE = float(np.cos(np.radians(10.0)))  # read: an accelerometer's offset counts 4°
RECKONED = float(np.cos(np.radians(30.0)))  # followed: a scale that is off by 10 % counts 18° in half a turn
MOST = 0.7  # of the rests are on faces, where they are laid on faces at all
WHOLE_RAD = float(np.radians(40.0))  # a turn that ends so near its beginning was to be a whole one
AXES = np.array([axis_of(face) for face in FACES])


def faced(session: Handled, told: Told, moved: Moved) -> Faced:
    """The faces. Raises Refused `first_face_not_told`."""
    up = _read(session) if session.acceleration is not None else _followed(told, moved, session)
    cosines = up @ AXES.T
    best = np.argmax(cosines, axis=1)
    near = cosines[np.arange(len(up)), best] > (ON_FACE if session.acceleration is not None else RECKONED)
    if np.mean(near) < MOST:  # free attitudes, some of which happen to be near a face
        near = np.zeros_like(near)
    faces = tuple(FACES[face] if on else None for face, on in zip(best.tolist(), near.tolist(), strict=True))
    nominal = np.where(near[:, None], AXES[best], up)
    turns = tuple(_turns(session, moved, faces, nominal, row) for row in range(len(session.moves)))
    return Faced(faces, nominal, turns)


def _read(session: Handled) -> Array:
    """The verticals in the body (N, 3) as the accelerometer reads them, its offset included."""
    readings = np.array([rest.acceleration_m_s2 for rest in session.rests])
    return np.asarray(readings / np.linalg.norm(readings, axis=1)[:, None], dtype=np.float64)


def _followed(told: Told, moved: Moved, session: Handled) -> Array:
    """The verticals (N, 3) by dead reckoning; each face that is reached is taken for where it should be."""
    if told.first_face is None:
        raise Refused(
            "first_face_not_told",
            "there are no accelerometer's readings, and nobody said how the body lay at first",
            "Say which of its axes pointed upwards: --first-face +z; or record the accelerometer too",
        )
    up = [axis_of(told.first_face)]
    for rotation in moved.rotations:
        there = rotation.T @ up[-1]
        nearest = AXES[np.argmax(AXES @ there)]
        up.append(nearest if nearest @ there > RECKONED else there)
    return np.array(up)


def _turns(session: Handled, moved: Moved, faces: tuple[str | None, ...], up: Array, row: int) -> int:
    """Whole turns of a move on its face, signed; 0 where it was to be none."""
    if faces[row] is None or faces[row] != faces[row + 1] or not session.moves[row].tells:
        return 0
    angle = float(up[row] @ moved.swept_rad[row])
    turns = round(angle / (2 * np.pi))
    return turns if abs(angle - 2 * np.pi * turns) < WHOLE_RAD + 0.05 * abs(angle) else 0
