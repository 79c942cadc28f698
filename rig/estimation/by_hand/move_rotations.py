"""The body's rotation in each move, from the gyroscope's readings, and its derivatives with respect to the unknowns.

    m = r + even r² + odd r |r| + b + G f,   r = F ω

m is the reading, ω the rate, b the bias, and f the specific force in units of gravity: at a hand's speeds this is the
vertical in body axes. f is tracked during the move, because with f at the ends alone the scale would err by 1.7
standard uncertainties.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rig.estimation.arrays import Array
from rig.estimation.by_hand.session_parts import HandRecording
from rig.estimation.gyroscope.increments import track


@dataclass(frozen=True, slots=True)
class MoveIntegrals:
    """The rotations of the body in k moves.

    - `rotations` (k, 3, 3): R from body coordinates at the end to those at the start. A change δ of the parameters
      changes R to exp(J δ) R, with J `by_matrix` (k, 3, 9), `by_bias` (k, 3, 3), `by_gravity` (k, 3, 9) or
      `by_nonlinearity` (k, 3, 6).
    - `swept_rad` (k, 3): the integral of the reading minus offset, g-sensitivity and nonlinearity.
    - `durations_s` (k,) of the moves; `paths_rad` (k,): the total angle turned, in whichever direction.
    - `changes_rad_s` (k,): the root sum of squares of the rate's changes from sample to sample. This times the standard
      deviation of the time stamps is the part of the rotation's standard deviation due to the stamps.
    """

    rotations: Array
    by_matrix: Array
    by_bias: Array
    by_gravity: Array
    by_nonlinearity: Array
    swept_rad: Array
    durations_s: Array
    paths_rad: Array
    changes_rad_s: Array


@dataclass(frozen=True, slots=True)
class GyroscopeModel:
    """A gyroscope's matrix F (3, 3), biases (N, 3) at the rests, g-sensitivity (3, 3), nonlinearities (6,) in s/rad."""

    matrix: Array
    biases: Array
    sensitivity: Array
    nonlinearities: Array


@dataclass(frozen=True, slots=True)
class _MoveIntegral:
    """The rotation in one move: an element of each field of `MoveIntegrals`.

    `by_theta` (3, 12): J of the matrix (9 columns) and of the bias (3 columns).
    """

    rotation: Array
    by_theta: Array
    by_gravity: Array
    by_nonlinearity: Array
    swept_rad: Array
    duration_s: float
    path_rad: float
    change_rad_s: float


def integrate_moves(session: HandRecording, gyroscope: GyroscopeModel, up: Array) -> MoveIntegrals:
    """Return each move's rotation, integrated from the readings, and its derivatives with respect to `gyroscope`.

    `up` (N, 3) is the vertical in the body at each rest.
    """
    middles_s = np.array([(rest.start_s + rest.end_s) / 2 for rest in session.rests])
    integrals = []
    for move, up_at_start in zip(session.moves, up, strict=False):  # the last rest has no move after it
        inside = _select_inside(session.time_s, move.start_s, move.end_s)
        times_s = session.time_s[inside]
        bias = np.column_stack([np.interp(times_s, middles_s, axis) for axis in gyroscope.biases.T])
        integrals.append(_integrate_move(times_s, session.rates[inside] - bias, gyroscope, up_at_start))
    return _stack_moves(integrals)


def _integrate_move(times_s: Array, unbiased: Array, gyroscope: GyroscopeModel, up: Array) -> _MoveIntegral:
    """Return the rotation in one move from readings (m, 3) minus bias; `up` (3,) is the vertical at its start."""
    matrix, sensitivity, factors = gyroscope.matrix, gyroscope.sensitivity, gyroscope.nonlinearities
    corrected, path = unbiased, track(times_s, unbiased, matrix)
    squares = np.stack([unbiased**2, unbiased * np.abs(unbiased)], axis=1)  # even and odd nonlinearity
    if sensitivity.any() or factors.any():  # the first path shows the vertical during the move
        bent = (squares * factors.reshape(2, 3)).sum(axis=1)
        corrected = unbiased - up @ path.attitudes @ sensitivity.T - bent
        path = track(times_s, corrected, matrix)
    lasting_s = _durations(times_s)
    turned = path.attitudes @ np.linalg.inv(matrix) * -lasting_s[:, None, None]  # rotation per error of each reading
    return _MoveIntegral(
        rotation=path.attitudes[-1],
        by_theta=path.sensitivity,
        by_gravity=np.tensordot(turned, up @ path.attitudes, (0, 0)).reshape(3, 9),
        by_nonlinearity=np.einsum("kij,kbj->ibj", turned, squares).reshape(3, 6),
        swept_rad=lasting_s @ corrected,
        duration_s=float(np.ptp(times_s)),
        path_rad=float(lasting_s @ np.linalg.norm(path.rates_rad_s, axis=1)),
        change_rad_s=float(np.linalg.norm(path.rates_rad_s[2:] - path.rates_rad_s[:-2]) / 2),
    )


def _stack_moves(moves: Sequence[_MoveIntegral]) -> MoveIntegrals:
    """Return the integrals of all moves as arrays, which are empty without moves."""
    by_theta = _stack([move.by_theta for move in moves], (3, 12))
    return MoveIntegrals(
        rotations=_stack([move.rotation for move in moves], (3, 3)),
        by_matrix=by_theta[..., :9],
        by_bias=by_theta[..., 9:],
        by_gravity=_stack([move.by_gravity for move in moves], (3, 9)),
        by_nonlinearity=_stack([move.by_nonlinearity for move in moves], (3, 6)),
        swept_rad=_stack([move.swept_rad for move in moves], (3,)),
        durations_s=np.array([move.duration_s for move in moves]),
        paths_rad=np.array([move.path_rad for move in moves]),
        changes_rad_s=np.array([move.change_rad_s for move in moves]),
    )


def _select_inside(time_s: Array, start_s: float, end_s: float) -> slice:
    first, last = np.searchsorted(time_s, (start_s, end_s)).tolist()
    return slice(first, min(last, len(time_s) - 1) + 1)


def _durations(times_s: Array) -> Array:
    """Return the weight (m,) of each reading in s, by the trapezoidal rule."""
    half: Array = np.diff(times_s) / 2
    lasting: Array = np.concatenate([half, [0.0]]) + np.concatenate([[0.0], half])
    return lasting


def _stack(rows: Sequence[Array], shape: tuple[int, ...]) -> Array:
    return np.array(rows) if rows else np.zeros((0, *shape))
