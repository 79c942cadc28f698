"""The board's own algorithm for calibration by hand, in double precision, which processes each move once, in order.

The equations are those of `firmware_host/firmware/core/by_hand/hand_solver.c`; only the arithmetic differs. The board
reports the rests and moves, and their faces.

    m = F ω + b + G u,   C = F⁻¹

m is the reading, ω the rate and u the upward unit vector in the body. Unknowns are C and G (3, 3) row by row, b (3,),
and two angles of each of six faces: their deviation from square. The state is an information matrix, of which the board
keeps the square root (Bierman, Factorization Methods for Discrete Sequential Estimation, 1977, chapter V). The
equations are linearised about a solution; the board reports after which moves it updates this solution.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from rig.estimation.arrays import Array, perpendicular_unit_vectors

MATRIX, GRAVITY, BIAS, FACES = slice(0, 9), slice(9, 18), slice(18, 21), slice(21, 33)
PRIOR_STD = np.repeat([0.2, 1.75e-3, 1.0, 3.5e-3], [9, 9, 3, 12])
REPEATABILITY_RAD, CLOSURE_RAD = 3e-4, 3e-3
NONLINEARITY, ANGLE_FRACTION, QUARTER_RAD = 1e-4, 1e-4, np.pi / 2
EARTH_RAD_S, EARTH_AXIAL_RAD_S = 7e-5, 3e-5
CURVATURE_FRACTION = 0.02


@dataclass(frozen=True, slots=True)
class BoardRest:
    """A rest of `samples` readings with their mean (3,); `face` is the upward axis, an index into +x -x +y -y +z -z."""

    face: int
    mean_rad_s: Array
    samples: int


@dataclass(frozen=True, slots=True)
class BoardMove:
    """A move from the rest `before` to `after`: `rates` (n, 3), each with the time step `steps_s` (n,) that ends at it.

    - `whole`: a whole turn, which ends where it began.
    - `follows`: the previous move ended in the rest `before`.
    - `settled`: the equations of later moves are linearised about the solution after this one.
    """

    before: BoardRest
    after: BoardRest
    rates: Array
    steps_s: Array
    noise_rad_s: float
    whole: bool
    follows: bool
    settled: bool


@dataclass(frozen=True, slots=True)
class BoardSolution:
    """The solution of the board's equations: `matrix` and `bias_rad_s` of rate = matrix (reading + bias).

    `scale_std` is the largest standard uncertainty of the matrix' diagonal elements.
    """

    matrix: Array
    bias_rad_s: Array
    scale_std: float


def solve_like_board(moves: Sequence[BoardMove]) -> BoardSolution:
    """Return the calibration that the board's algorithm computes from the moves it has used, in their order."""
    centre = np.concatenate([np.eye(3).ravel(), np.zeros(24)])
    information, gradient = np.diag(PRIOR_STD**-2.0), np.zeros(len(centre))
    for move in moves:
        rows, residual, variances = (np.array(part) for part in zip(*_equations(centre, move), strict=True))
        weighted = rows / variances[:, None]
        information, gradient = information + weighted.T @ rows, gradient + weighted.T @ residual
        if move.settled:
            centre, gradient = centre + _solve(information, gradient), np.zeros(len(centre))
    centre = centre + _solve(information, gradient)
    scaling = np.sqrt(np.diag(information))
    variance = np.diag(np.linalg.inv(information / np.outer(scaling, scaling))) / scaling**2
    return BoardSolution(
        matrix=centre[MATRIX].reshape(3, 3),
        bias_rad_s=-centre[BIAS],
        scale_std=float(np.sqrt(variance[[0, 4, 8]].max())),
    )


def _solve(information: Array, gradient: Array) -> Array:
    scaling = np.sqrt(np.diag(information))
    return np.linalg.solve(information / np.outer(scaling, scaling), gradient / scaling) / scaling


Equation = tuple[Array, float, float]  # a row (33,), its residual, its variance


def _equations(centre: Array, move: BoardMove) -> Iterator[Equation]:
    for rest in (move.after,) if move.follows else (move.before, move.after):
        yield from _rest_equations(centre, rest, move.noise_rad_s)
    yield from _move_equations(centre, move)


def _vertical_on_face(centre: Array, face: int) -> tuple[Array, Array]:
    """Return the vertical (3,) in the body with `face` up, and its change (3, 2) per rad of the face's two angles."""
    axis, leans = face // 2, centre[FACES][2 * face : 2 * face + 2]
    up, face_axes = np.zeros(3), np.zeros((3, 2))
    face_axes[(axis + 1) % 3, 0] = face_axes[(axis + 2) % 3, 1] = 1.0
    up[axis] = (1 - leans @ leans / 2) * (-1.0 if face % 2 else 1.0)
    return up + face_axes @ leans, face_axes


def _rest_equations(centre: Array, rest: BoardRest, noise_rad_s: float) -> Iterator[Equation]:
    """Yield the equations of a rest, whose reading is bias plus gravity's effect.

    The unknowns are the step (33,) from the values `centre` (33,), about which the equations are linearised.
    """
    up, _ = _vertical_on_face(centre, rest.face)
    sensitivity = centre[GRAVITY].reshape(3, 3)
    for axis in range(3):
        row = np.zeros(len(centre))
        row[GRAVITY.start + 3 * axis : GRAVITY.start + 3 * axis + 3] = up
        row[BIAS.start + axis] = 1.0
        residual = rest.mean_rad_s[axis] - centre[BIAS][axis] - sensitivity[axis] @ up
        yield row, float(residual), noise_rad_s**2 / rest.samples + EARTH_RAD_S**2


def _move_equations(centre: Array, move: BoardMove) -> Iterator[Equation]:
    """Yield the equations of a move, whose integrated rotation must turn one rest's vertical to the next rest's."""
    matrix, sensitivity = centre[MATRIX].reshape(3, 3), centre[GRAVITY].reshape(3, 3)
    (up, up_axes), (after, after_axes) = (
        _vertical_on_face(centre, move.before.face),
        _vertical_on_face(centre, move.after.face),
    )
    rates = move.rates - move.before.mean_rad_s
    turned, middles = _attitudes(rates @ matrix.T * move.steps_s[:, None])
    weighted = middles * move.steps_s[:, None, None]
    # The derivatives of the rotation by the matrix, and by the bias and g-sensitivity that act while it turns.
    by_matrix = np.einsum("nar,nc->arc", weighted, rates).reshape(3, 9)
    by_tilt = np.einsum("nas,nbc,b->asc", weighted, middles, up)
    by_bias = weighted.sum(axis=0) @ matrix
    by_gravity = np.einsum("ar,c->arc", by_bias, (up + after) / 2) - np.einsum("asc,sr->arc", by_tilt, matrix)
    drift = move.after.mean_rad_s - move.before.mean_rad_s
    corrected = np.einsum("arc,rc->a", by_gravity, sensitivity) - by_bias @ drift / 2
    # The vertical after the move, in the axes before it, corrected for gravity and a steady drift.
    reached = turned @ after
    reached = reached + np.cross(corrected, reached)
    middle = (reached + up) / np.linalg.norm(reached + up)
    steps = rates @ matrix.T * move.steps_s[:, None]
    variance = _variance(move, float(np.linalg.norm(steps, axis=1).sum()))
    design = np.hstack([by_matrix, by_gravity.reshape(3, 9), np.zeros((3, 15))])
    # The angle between the verticals over its sine.
    half = np.linalg.norm(up - reached) / 2
    stretched = np.arcsin(half) / (half * np.sqrt(1 - half**2)) if half > 1e-9 else 1.0
    for axis in perpendicular_unit_vectors(middle):
        row, lever = axis @ design, np.cross(axis, middle)
        row[FACES.start + 2 * move.before.face + np.arange(2)] -= lever @ up_axes
        row[FACES.start + 2 * move.after.face + np.arange(2)] += lever @ turned @ after_axes
        residual = float(axis @ np.cross(reached, up) * stretched)
        yield row, residual, variance + (CURVATURE_FRACTION * residual**2) ** 2 + 2 * REPEATABILITY_RAD**2
    if move.whole:
        twist = np.array([turned[2, 1] - turned[1, 2], turned[0, 2] - turned[2, 0], turned[1, 0] - turned[0, 1]])
        residual = -float(2 * np.arctan2(middle @ twist, 1 + np.trace(turned)) + middle @ corrected)
        yield middle @ design, residual, variance + (CURVATURE_FRACTION * residual**2) ** 2 + CLOSURE_RAD**2


def _attitudes(steps: Array) -> tuple[Array, Array]:
    """Return the attitude (3, 3) after n rotations by vectors (n, 3), and the attitudes (n, 3, 3) midway in each."""
    from scipy.spatial.transform import Rotation

    halves = np.asarray(Rotation.from_rotvec(steps / 2).as_matrix(), dtype=np.float64)
    attitude, middles = np.eye(3), np.empty((len(steps), 3, 3))
    for row, half in enumerate(halves):
        middles[row] = attitude @ half
        attitude = middles[row] @ half
    return attitude, middles


def _variance(move: BoardMove, path_rad: float) -> float:
    lasts_s, noise = float(move.steps_s.sum()), move.noise_rad_s**2
    samples = 1 / len(move.rates) + 0.25 / move.before.samples + 0.25 / move.after.samples
    of_angle = path_rad * (NONLINEARITY**2 * path_rad + ANGLE_FRACTION**2 * QUARTER_RAD)
    return float(lasts_s**2 * (noise * samples + EARTH_AXIAL_RAD_S**2) + of_angle)
