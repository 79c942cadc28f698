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


def integrate_moves(session: HandRecording, gyroscope: GyroscopeModel, up: Array) -> MoveIntegrals:
    """Return each move's rotation, integrated from the readings, and its derivatives with respect to `gyroscope`.

    `up` (N, 3) is the vertical in the body at each rest.
    """
    matrix, biases, sensitivity = gyroscope.matrix, gyroscope.biases, gyroscope.sensitivity
    factors = gyroscope.nonlinearities
    middles = np.array([(rest.start_s + rest.end_s) / 2 for rest in session.rests])
    inverse = np.linalg.inv(matrix)
    rotations, by_theta, by_gravity, by_nonlinearity, swept = (list[Array]() for _ in range(5))
    durations, paths, changes = (list[float]() for _ in range(3))
    for row, move in enumerate(session.moves):
        inside = _select_inside(session.time_s, move.start_s, move.end_s)
        times_s = session.time_s[inside]
        corrected = session.rates[inside] - np.column_stack([np.interp(times_s, middles, axis) for axis in biases.T])
        path = track(times_s, corrected, matrix)
        squares = np.stack([corrected**2, corrected * np.abs(corrected)], axis=1)  # even and odd nonlinearity
        if sensitivity.any() or factors.any():  # the first path shows the vertical during the move
            bent = (squares * factors.reshape(2, 3)).sum(axis=1)
            corrected = corrected - up[row] @ path.attitudes @ sensitivity.T - bent
            path = track(times_s, corrected, matrix)
        rotations.append(path.attitudes[-1])
        by_theta.append(path.sensitivity)
        lasting_s = _durations(times_s)
        turned = path.attitudes @ inverse * -lasting_s[:, None, None]  # rotation per error of each reading
        by_gravity.append(np.tensordot(turned, up[row] @ path.attitudes, (0, 0)).reshape(3, 9))
        by_nonlinearity.append(np.einsum("kij,kbj->ibj", turned, squares).reshape(3, 6))
        swept.append(lasting_s @ corrected)
        durations.append(float(np.ptp(times_s)))
        paths.append(float(lasting_s @ np.linalg.norm(path.rates_rad_s, axis=1)))
        changes.append(float(np.linalg.norm(path.rates_rad_s[2:] - path.rates_rad_s[:-2]) / 2))
    theta = _stack(by_theta, (3, 12))
    return MoveIntegrals(
        _stack(rotations, (3, 3)),
        theta[..., :9],
        theta[..., 9:],
        _stack(by_gravity, (3, 9)),
        _stack(by_nonlinearity, (3, 6)),
        _stack(swept, (3,)),
        np.array(durations),
        np.array(paths),
        np.array(changes),
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
