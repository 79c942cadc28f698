"""The face on which the body lay in each rest, from the accelerometer, or by tracking from the first face."""

import numpy as np

from rig.errors import Refused
from rig.estimation.arrays import Array, axis_of
from rig.estimation.by_hand.move_rotations import MoveIntegrals
from rig.estimation.by_hand.session_parts import FACES, HandRecording, RestFaces, SessionConditions

MIN_FACE_COSINE = float(np.cos(np.radians(10.0)))  # an accelerometer's offset tilts the vertical by up to 4°
MIN_RECKONED_COSINE = float(np.cos(np.radians(30.0)))  # dead reckoning: an error of 10 % makes 18° in half a turn
MIN_FACE_FRACTION = 0.7  # of the rests, if the body is laid on faces at all
WHOLE_TURN_TOLERANCE_RAD = float(np.radians(40.0))  # a turn that ends so near its beginning was meant to be a whole one
FACE_AXES = np.array([axis_of(face) for face in FACES])


def find_faces(session: HandRecording, conditions: SessionConditions, integrals: MoveIntegrals) -> RestFaces:
    """Return the face of every rest. Raise Refused `first_face_unknown`."""
    has_level = session.acceleration is not None
    up = _read_verticals(session) if has_level else _track_verticals(conditions, integrals)
    cosines = up @ FACE_AXES.T
    best = np.argmax(cosines, axis=1)
    near = cosines[np.arange(len(up)), best] > (MIN_FACE_COSINE if has_level else MIN_RECKONED_COSINE)
    if np.mean(near) < MIN_FACE_FRACTION:  # free attitudes, some of which happen to be near a face
        near = np.zeros_like(near)
    faces = tuple(FACES[face] if on else None for face, on in zip(best.tolist(), near.tolist(), strict=True))
    nominal = np.where(near[:, None], FACE_AXES[best], up)
    turns = tuple(_count_turns(session, integrals, faces, nominal, row) for row in range(len(session.moves)))
    return RestFaces(faces, nominal, turns)


def _read_verticals(session: HandRecording) -> Array:
    """Return the verticals in the body (N, 3) as the accelerometer reads them, without correcting its offset."""
    readings = np.array([rest.acceleration_m_s2 for rest in session.rests])
    return np.asarray(readings / np.linalg.norm(readings, axis=1)[:, None], dtype=np.float64)


def _track_verticals(conditions: SessionConditions, integrals: MoveIntegrals) -> Array:
    """Return the verticals (N, 3) by dead reckoning, reset at every rest to the nominal direction of its face.

    Raise Refused `first_face_unknown`.
    """
    if conditions.first_face is None:
        raise Refused(
            "first_face_unknown",
            "no accelerometer was read, and the face that was up at first is not stated",
            "Say which of its axes pointed upwards: rig solve LOG --turns --first-face +z; or record the "
            "accelerometer too",
        )
    up = [axis_of(conditions.first_face)]
    for rotation in integrals.rotations:
        vertical = rotation.T @ up[-1]
        nearest = FACE_AXES[np.argmax(FACE_AXES @ vertical)]
        up.append(nearest if nearest @ vertical > MIN_RECKONED_COSINE else vertical)
    return np.array(up)


def _count_turns(
    session: HandRecording, integrals: MoveIntegrals, faces: tuple[str | None, ...], up: Array, row: int
) -> int:
    """Return the signed number of whole turns in the move `row`; 0 for a move that is not a turn on one face."""
    if faces[row] is None or faces[row] != faces[row + 1] or not session.moves[row].is_usable:
        return 0
    angle = float(up[row] @ integrals.swept_rad[row])
    turns = round(angle / (2 * np.pi))
    return turns if abs(angle - 2 * np.pi * turns) < WHOLE_TURN_TOLERANCE_RAD + 0.05 * abs(angle) else 0
