"""The solution of the graph by Gauss–Newton steps, with the hand's variance components from the residuals.

Each component is estimated from the factors that it affects, weighted by their redundancy numbers (Förstner 1979). Its
value in `STATED` serves as a prior with `PRIOR_DOF` degrees of freedom, so a short session changes it little.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from rig.errors import Fault
from rig.estimation.arrays import Array
from rig.estimation.by_hand.faces import find_faces
from rig.estimation.by_hand.graph import (
    ACCELERATION,
    CLOSURE,
    FLAT,
    MOVE,
    PRIOR,
    WALK,
    Factor,
    Graph,
    GraphState,
    linearise,
)  # fmt: skip
from rig.estimation.by_hand.move_rotations import GyroscopeModel, MoveIntegrals, integrate_moves
from rig.estimation.by_hand.session_parts import MAX_STDS, STATED, HandRecording, HandStds, RestFaces, SessionConditions

# Iterations of the fit, many if there are few moves; iterations for the variance components in each but the first.
MAX_ITERATIONS, VARIANCE_ITERATIONS = 30, 4
CONVERGED_STEP_RATIO = 1e-2  # largest step, relative to the standard uncertainty
PRIOR_DOF = 5.0  # degrees of freedom of the stated values
# The walk of the bias at which the fit begins: from a small one, a rest that contradicts the others looks like noise.
LOOSE_WALK_RAD_S_SQRT_S = 1e-4
MIN_STATED_RATIO = 0.4  # to the stated value: no hand is better
CAUSE_OF_STD = {
    "repeat_rad": (FLAT, "repeat"),
    "closure_rad": (CLOSURE, "closure"),
    "of_angle": (MOVE, "of_angle"),
    "walk_rad_s_sqrt_s": (WALK, "walk"),
    "acceleration_m_s2": (ACCELERATION, "acceleration"),
}
UNREDUCED_STDS = ("of_angle", "walk_rad_s_sqrt_s")  # these errors exist even if residuals do not show them


@dataclass(frozen=True, slots=True)
class GraphFit:
    """The converged graph, and the `covariance` (p, p) of its unknowns; `chi_square` and `dof` omit the priors."""

    session: HandRecording
    conditions: SessionConditions
    faces: RestFaces
    state: GraphState
    integrals: MoveIntegrals
    stds: HandStds
    factors: tuple[Factor, ...]
    covariance: Array
    chi_square: float
    dof: float
    iterations: int

    def redundancy_numbers(self, factor: Factor) -> Array:
        """Return the redundancy number (r,) of each row of a factor: one minus its leverage (Baarda 1968)."""
        design, _ = whiten_rows([factor])
        return np.asarray(np.clip(1 - _leverages(design, self.covariance), 1e-6, 1.0), dtype=np.float64)


def fit_session(session: HandRecording, conditions: SessionConditions, trusted: int | None = None) -> GraphFit:
    """Return the fit of the gyroscope, and of all attitudes and biases, to a session of at least one rest.

    The variance components are estimated from the first `trusted` rests, by default from all. Raise Fault `no_fit`,
    Refused `first_face_unknown`.
    """
    biases = np.array([rest.mean_rad_s for rest in session.rests])
    stds = replace(STATED, walk_rad_s_sqrt_s=LOOSE_WALK_RAD_S_SQRT_S)
    initial = GyroscopeModel(np.eye(3), biases, np.zeros((3, 3)), np.zeros(6))
    integrals = integrate_moves(session, initial, np.tile([0.0, 0.0, 1.0], (len(biases), 1)))
    faces = find_faces(session, conditions, integrals)
    state, iterations, settled = _start(integrals, faces, initial), 0, False
    while iterations < MAX_ITERATIONS and not settled:
        rows = list(linearise(Graph(session, faces, conditions, state, integrals, stds)))
        if iterations:
            rows, stds = estimate_stds(rows, stds, trusted)
        step, covariance = solve_step(rows)
        if not np.isfinite(step).all() or np.abs(step[:9]).max() > 1.0:
            raise Fault("no_fit", "the moves contradict each other so much that no fit converges", _REMEDY)
        state, iterations = state.after_step(step), iterations + 1
        settled = iterations > 2 and bool((np.abs(step) < CONVERGED_STEP_RATIO * np.sqrt(np.diag(covariance))).all())
        integrals = integrate_moves(session, state.gyroscope, state.attitudes[:, 2])
    rows = list(linearise(Graph(session, faces, conditions, state, integrals, stds)))
    _, covariance = solve_step(rows)
    chi_square, dof = sum_squares(rows, covariance)
    return GraphFit(
        session, conditions, faces, state, integrals, stds, tuple(rows), covariance, chi_square, dof, iterations
    )


_REMEDY = "See that each move is between two rests on the table, that no reading is lost, and which axes are which"


def _start(integrals: MoveIntegrals, faces: RestFaces, initial: GyroscopeModel) -> GraphState:
    """Return initial values of the unknowns.

    The attitude at each rest is that of the previous rest, turned by the move, then tilted until the face is up.
    """
    attitudes = [_align_vertical(np.eye(3), faces.up[0])]
    for row, rotation in enumerate(integrals.rotations):
        attitudes.append(_align_vertical(attitudes[-1] @ rotation, faces.up[row + 1]))
    return GraphState(
        matrix=initial.matrix,
        sensitivity=initial.sensitivity,
        nonlinearities=initial.nonlinearities,
        drift_rad_s=np.zeros((2, 3)),
        level=np.eye(3),
        offset=np.zeros(3),
        table=np.zeros(2),
        normals=np.zeros((6, 2)),
        attitudes=np.array(attitudes),
        biases=initial.biases,
    )


def _align_vertical(attitude: Array, up: Array) -> Array:
    """Return an attitude (3, 3), body to table, turned by the smallest angle that makes `up` (3,) its vertical."""
    from scipy.spatial.transform import Rotation

    vertical = attitude[2]
    axis = np.cross(vertical, up)
    sine = float(np.linalg.norm(axis))
    if sine < 1e-12:
        if vertical @ up > 0:
            return attitude
        axis, sine = np.cross(up, np.eye(3)[np.argmin(np.abs(up))]), 0.0
    angle = np.arctan2(sine, vertical @ up)
    turn = np.asarray(Rotation.from_rotvec(axis / np.linalg.norm(axis) * angle).as_matrix(), dtype=np.float64)
    return np.asarray(attitude @ turn.T, dtype=np.float64)


def _last_rest(row: Factor) -> int:
    """Return the index of the last rest in a factor."""
    return row.index + (row.kind in (MOVE, WALK, CLOSURE))


def solve_step(rows: Sequence[Factor]) -> tuple[Array, Array]:
    """Return the least-squares step (p,) of the unknowns for the equations `rows`, and its covariance (p, p)."""
    design, residual = whiten_rows(rows)
    size = np.linalg.norm(design, axis=0)
    scaled = design / size
    covariance = np.asarray(np.linalg.inv(scaled.T @ scaled), dtype=np.float64) / np.outer(size, size)
    return -covariance @ (design.T @ residual), covariance


def whiten_rows(rows: Sequence[Factor]) -> tuple[Array, Array]:
    """Return the design (r, p) and residuals (r,) of all rows, divided by their standard deviations."""
    std = np.concatenate([row.std for row in rows])
    design, residual = np.concatenate([row.design for row in rows]), np.concatenate([row.residual for row in rows])
    return design / std[:, None], residual / std


def _leverages(design: Array, covariance: Array) -> Array:
    """Return the leverage (r,) of each row of a whitened design (r, p)."""
    leverages: Array = np.sum(design @ covariance * design, axis=1)
    return leverages


def estimate_stds(rows: Sequence[Factor], now: HandStds, trusted: int | None = None) -> tuple[list[Factor], HandStds]:
    """Return the rows with re-estimated standard deviations, and these standard deviations.

    They are estimated from the residuals of the first `trusted` rests, by default of all rests. `now` contains the
    previous standard deviations.
    """
    rows = list(rows)
    for _ in range(VARIANCE_ITERATIONS):
        step, covariance = solve_step(rows)
        used = [row for row in rows if trusted is None or _last_rest(row) < trusted]
        new = _stds_of_rows(used, step, covariance, now)
        rows, now = replace_stds(rows, now, new), new
    return rows, now


def replace_stds(rows: Sequence[Factor], now: HandStds, new: HandStds) -> list[Factor]:
    """Return the rows with their standard deviations `now` replaced by `new`."""
    cause_of = {kind: (cause, getattr(new, name) / getattr(now, name)) for name, (kind, cause) in CAUSE_OF_STD.items()}
    replaced = []
    for row in rows:
        cause, times = cause_of.get(row.kind, ("", 1.0))
        causes = {name: std * times if name == cause else std for name, std in row.causes.items()}
        replaced.append(replace(row, causes=causes))
    return replaced


def sum_squares(rows: Sequence[Factor], covariance: Array) -> tuple[float, float]:
    """Return the chi square of all rows except the priors, and its degrees of freedom."""
    design, residual = whiten_rows([row for row in rows if row.kind != PRIOR])
    return float(residual @ residual), len(design) - float(_leverages(design, covariance).sum())


def _stds_of_rows(rows: Sequence[Factor], step: Array, covariance: Array, now: HandStds) -> HandStds:
    """Return the stds for which the squared residuals after `step` (p,) would equal their expected values.

    `covariance` (p, p) is that of the parameters, which determines the redundancy numbers.
    """
    stds: dict[str, float] = {}
    for name, (kind, cause) in CAUSE_OF_STD.items():
        stated = getattr(STATED, name)
        squares = dof = PRIOR_DOF
        if rows_of_kind := [row for row in rows if row.kind == kind]:
            design, residual = whiten_rows(rows_of_kind)
            fraction = np.concatenate([np.square(row.causes[cause] / row.std) for row in rows_of_kind])
            redundancy = np.clip(1 - _leverages(design, covariance), 0.0, 1.0)
            sum_squares = np.square(residual + design @ step) - redundancy * (1 - fraction)
            squares += float(sum_squares.sum()) * (getattr(now, name) / stated) ** 2
            dof += float(fraction @ redundancy)
        least = stated * (1.0 if name in UNREDUCED_STDS else MIN_STATED_RATIO)
        estimate = stated * float(np.sqrt(max(squares, 0.0) / dof))
        stds[name] = min(max(least, estimate), getattr(MAX_STDS, name))
    return HandStds(**stds)
