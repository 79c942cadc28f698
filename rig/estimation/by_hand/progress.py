"""How far a session has come: what is known after each move, what was wrong with the last one, what would tell most."""

from dataclasses import dataclass

import numpy as np

from rig.errors import Fault
from rig.estimation.arrays import Array
from rig.estimation.by_hand.axes import check_axes
from rig.estimation.by_hand.doubts import doubted
from rig.estimation.by_hand.fit import fit
from rig.estimation.by_hand.session import FACES, Handled, Move, Told
from rig.estimation.by_hand.solution import HandSolution, MoveFound, RestFound, solution_of, sought, too_few
from rig.estimation.sensor_axes import SensorAxes, parameter_jacobian

UNKNOWN = 0.4  # U (k = 2) of a scale of which nothing is known
TOLD_FROM = 4  # moves, from which on one of them can be held against the others


@dataclass(frozen=True, slots=True)
class Progress:
    """What a session tells so far.

    - `expanded_scale` (3,): U (k = 2), by the session and its clock.
    - `faces` of each rest, None on none; `moves` as they were taken; `solution` as if it ended here, if it told enough.
    - `asked`: what is wrong with the last move or the rest after it. `wanted`: faces on which it has not lain.
    """

    expanded_scale: Array
    faces: tuple[str | None, ...]
    rests: tuple[RestFound, ...]
    moves: tuple[MoveFound, ...]
    solution: HandSolution | None
    asked: Fault | None
    wanted: tuple[str, ...]


def progress(session: Handled, told: Told) -> Progress:
    """What a session tells so far, from its first rest on; too little is no error.

    Raises Fault `mirrored_axis`, `swapped_axes`, `wrong_unit`; Refused `first_face_not_told`.
    """
    unknown = np.full(3, UNKNOWN)
    if not session.rests:
        return Progress(unknown, (), (), (), None, None, FACES)
    check_axes(session)
    asked = _at_a_glance(session)
    last = len(session.rests) - 1
    try:
        found = fit(session, told, trusted=last if last >= TOLD_FROM else None)
    except Fault as fault:
        return Progress(unknown, (), (), (), None, asked or fault, FACES)
    if asked is None and last >= TOLD_FROM:
        asked = doubted(found, since=last)
    axes, chosen = SensorAxes.of(found.state.matrix), sought(found)
    covariance = found.covariance[np.ix_(chosen, chosen)]
    to_parameters = parameter_jacobian(found.state.matrix, axes.scale)
    expanded = 2 * np.sqrt(np.diag(to_parameters @ covariance @ to_parameters.T)[:3])
    expanded = np.hypot(expanded, 2e-6 / np.sqrt(3) * told.clock_ppm * axes.scale)
    solution = solution_of(found)
    faces = found.faced.faces
    return Progress(
        expanded,
        faces,
        solution.rests,
        solution.moves,
        solution if expanded.max() < UNKNOWN / 4 else None,
        asked,
        tuple(face for face in FACES if face not in faces),
    )


def _at_a_glance(session: Handled) -> Fault | None:
    """What the last move shows without any other."""
    if not session.moves:
        return None
    move: Move = session.moves[-1]
    if (move.clipped or move.lost) and not move.left_out:
        return too_few(Handled(session.time_s, session.rates, None, session.rests[-2:], (move,)), None)
    return None
