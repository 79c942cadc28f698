"""The progress of a session: its uncertainty, the fault of the last move, and the missing faces."""

from dataclasses import dataclass

import numpy as np

from rig.errors import Fault
from rig.estimation.arrays import Array
from rig.estimation.by_hand.fit import fit_session
from rig.estimation.by_hand.flip_axes import check_axes
from rig.estimation.by_hand.session_outliers import find_contradiction
from rig.estimation.by_hand.session_parts import FACES, HandRecording, Move, SessionConditions
from rig.estimation.by_hand.solution import (
    HandSolution,
    MoveSummary,
    RestSummary,
    insufficient_session,
    parameter_columns,
    summarise_fit,
)
from rig.estimation.sensor_axes import SensorAxes, parameter_jacobian

UNKNOWN_SCALE_U = 0.4  # k = 2, before any measurement
MIN_COMPARABLE_MOVES = 4


@dataclass(frozen=True, slots=True)
class SessionProgress:
    """The result of a session so far.

    - `expanded_scale` (3,): U (k = 2) of the scale factors, from the session and its clock.
    - `faces`, `rests`: face and summary of each rest; `moves`: the summary of each move.
    - `solution`: the solution if the session ended here, None if it is too uncertain.
    - `fault_of_last`: the fault of the last move, or of the rest after it.
    - `is_contradiction`: whether that fault contradicts earlier moves, so that one of these may be wrong instead.
    - `missing_faces`: faces without a rest.
    """

    expanded_scale: Array
    faces: tuple[str | None, ...]
    rests: tuple[RestSummary, ...]
    moves: tuple[MoveSummary, ...]
    solution: HandSolution | None
    fault_of_last: Fault | None
    missing_faces: tuple[str, ...]
    is_contradiction: bool = False


def assess_progress(session: HandRecording, conditions: SessionConditions) -> SessionProgress:
    """Return the progress of an unfinished session of one rest or more; few rests are not an error.

    Raise Fault `mirrored_axis`, `swapped_axes`, `wrong_unit`; Refused `first_face_unknown`.
    """
    unknown = np.full(3, UNKNOWN_SCALE_U)
    if not session.rests:
        return SessionProgress(unknown, (), (), (), None, None, FACES)
    check_axes(session)
    fault_of_last = _check_last_move(session)
    last = len(session.rests) - 1  # not used for the variances: a faulty last move would inflate them and hide in them
    try:
        fitted = fit_session(session, conditions, trusted=last if last >= MIN_COMPARABLE_MOVES else None)
    except Fault as fault:
        is_contradiction = fault_of_last is None and fault.name == "no_fit"
        return SessionProgress(unknown, (), (), (), None, fault_of_last or fault, FACES, is_contradiction)
    is_contradiction = False
    if fault_of_last is None and last >= MIN_COMPARABLE_MOVES:
        fault_of_last = find_contradiction(fitted, since=last)
        is_contradiction = fault_of_last is not None
    axes, chosen = SensorAxes.from_matrix(fitted.state.matrix), parameter_columns(fitted)
    covariance = fitted.covariance[np.ix_(chosen, chosen)]
    to_parameters = parameter_jacobian(fitted.state.matrix, axes.scale)
    expanded = 2 * np.sqrt(np.diag(to_parameters @ covariance @ to_parameters.T)[:3])
    expanded = np.hypot(expanded, 2e-6 / np.sqrt(3) * conditions.clock_ppm * axes.scale)  # clock_ppm is a half-width
    solution = summarise_fit(fitted)
    faces = fitted.faces.faces
    return SessionProgress(
        expanded,
        faces,
        solution.rests,
        solution.moves,
        solution if expanded.max() < UNKNOWN_SCALE_U / 4 else None,
        fault_of_last,
        tuple(face for face in FACES if face not in faces),
        is_contradiction,
    )


def _check_last_move(session: HandRecording) -> Fault | None:
    """Return the fault that the last move alone shows, or None."""
    if not session.moves:
        return None
    move: Move = session.moves[-1]
    if (move.clipped or move.lost) and not move.left_out:
        return insufficient_session(
            HandRecording(session.time_s, session.rates, None, session.rests[-2:], (move,)), None
        )
    return None
