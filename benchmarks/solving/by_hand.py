"""Errors of scale and axes by imucal and by the rig's graph of rests and moves, from the same sessions by hand.

python benchmarks/solving/by_hand.py [SESSIONS]          # needs the extra `bench`

A session of 40 s is twelve flips over all six faces and a whole turn back about each axis, as the simulated hand makes
them (`rig.world.hand`). imucal gets the exact times of the six holds and three turns; the rig gets only the readings.
"""

import sys
from pathlib import Path

import numpy as np
from imucal import FerrarisCalibration, FerrarisSignalRegions

from rig.estimation.arrays import Array, scale_of
from rig.estimation.by_hand import HandRecording, SessionConditions, solve_by_hand
from rig.estimation.by_hand.session_parts import FACES
from rig.observation.by_hand.hand_segmentation import segment_session
from rig.world.hand.habits import Action, TurnAction

sys.path.insert(0, str(Path(__file__).parents[2] / "tests"))
sys.path.insert(0, str(Path(__file__).parents[2]))  # before the tests' folders of the same names
from support.external.handled_body import TWELVE, handle

sys.path.insert(0, str(Path(__file__).parents[1]))
from goals import record

SESSION: tuple[Action, ...] = (
    TurnAction(-1),
    TWELVE[0],
    TurnAction(-1),
    TWELVE[1],
    TurnAction(-1),
    *TWELVE[2:],
)  # on +z, +x and +y
REST_S = 0.9
GRAVITY_M_S2, PART_NAMES = 9.81, {"+": "p", "-": "a"}
SESSIONS = 200


def solve_by_imucal(session: HandRecording) -> Array:
    """Return imucal's matrix of scale and axes F (3, 3), from the first rest on each face and the turns."""
    assert session.acceleration is not None
    sections: dict[str, Array] = {}
    for rest in session.rests:
        assert rest.acceleration_m_s2 is not None
        face = FACES[int(np.argmax([rest.acceleration_m_s2 @ axis for axis in _axes()]))]
        _add(sections, session, f"{face[1]}_{PART_NAMES[face[0]]}", (rest.start_s, rest.end_s))
    for move, rest in zip(session.moves, session.rests, strict=False):
        assert rest.acceleration_m_s2 is not None
        inside = (session.time_s >= move.start_s) & (session.time_s <= move.end_s)
        rotation = np.trapezoid(session.rates[inside] - rest.mean_rad_s, session.time_s[inside], axis=0)
        if np.linalg.norm(rotation) > 5:
            _add(sections, session, f"{'xyz'[int(np.argmax(np.abs(rotation)))]}_rot", (move.start_s, move.end_s))
    rate_hz = 1 / float(np.median(np.diff(session.time_s)))
    solution = FerrarisCalibration(grav=GRAVITY_M_S2).compute(
        FerrarisSignalRegions(**sections), rate_hz, from_acc_unit="m/s^2", from_gyr_unit="deg/s"
    )
    return np.asarray(solution.K_g @ solution.R_g, dtype=np.float64)


def _axes() -> list[Array]:
    return [np.asarray((1.0 if face[0] == "+" else -1.0) * np.eye(3)["xyz".index(face[1])]) for face in FACES]


def _add(sections: dict[str, Array], session: HandRecording, name: str, window: tuple[float, float]) -> None:
    assert session.acceleration is not None
    inside = (session.time_s >= window[0]) & (session.time_s <= window[1])
    sections.setdefault(f"gyr_{name}", np.degrees(session.rates[inside]))
    sections.setdefault(f"acc_{name}", session.acceleration[inside])


def main(sessions: int) -> None:
    """Print the RMS errors of scale factors and of the off-diagonal elements of F."""
    errors: dict[str, list[tuple[Array, Array]]] = {"imucal, perfectly annotated": [], "graph of rests and moves": []}
    duration_s = 0.0
    for seed in range(sessions):
        recorded = handle(SESSION, seed, rest_s=REST_S)
        session = segment_session(recorded.time_s, recorded.rates, recorded.acceleration)
        duration_s += float(np.ptp(recorded.time_s)) / sessions
        solution = (solve_by_imucal(session), solve_by_hand(session, SessionConditions(20.0)).turned.matrix)
        for error, matrix in zip(errors.values(), solution, strict=True):
            off_diagonal = (matrix - recorded.matrix)[~np.eye(3, dtype=bool)]
            error.append((scale_of(matrix) - recorded.truth[:3], off_diagonal))
    print(f"{sessions} sessions of {duration_s:.0f} s")
    rms = {
        name: [float(np.sqrt(np.mean(np.square(part)))) for part in zip(*error, strict=True)]
        for name, error in errors.items()
    }
    for name, (scale, axes) in rms.items():
        print(f"{name:30} scale {scale:.2e}, off-diagonals {axes:.2e}")
    theirs, ours = rms.values()
    record("by hand, RMS error of scale", ours[0], "1", peer="imucal", peer_value=theirs[0])
    print(f"better by {theirs[0] / ours[0]:.1f} in scale, {theirs[1] / ours[1]:.1f} in the off-diagonals")


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else SESSIONS)
