"""How the gyroscope says that the body turned in each move, and how that changes with what is sought.

    m = r + even r² + odd r |r| + b + G f,   r = F ω

f is the specific force in units of gravity, which at a hand's speeds is the vertical in body axes. Taken at the ends of
a move alone it makes the scale wrong by 1.7 standard uncertainties: it has to be followed along the move.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rig.estimation.arrays import Array
from rig.estimation.by_hand.session import Handled
from rig.estimation.gyroscope.increments import track


@dataclass(frozen=True, slots=True)
class Moved:
    """How the body turned in k moves.

    - `rotations` (k, 3, 3): body coordinates at the end to those at the start, R; exp(J δθ) R with `by_matrix`
      (k, 3, 9), `by_bias` (k, 3, 3), `by_gravity` (k, 3, 9), `by_bends` (k, 3, 6).
    - `swept_rad` (k, 3): the integral of the reading less offset, g-sensitivity and what bends it.
    - `durations_s` (k,), `paths_rad` (k,): how far it turned in all, there and back.
    - `changes_rad_s` (k,): the root of the sum of squares of how the rate changed from sample to sample, which makes an
      angle of what time stamps err by.
    """

    rotations: Array
    by_matrix: Array
    by_bias: Array
    by_gravity: Array
    by_bends: Array
    swept_rad: Array
    durations_s: Array
    paths_rad: Array
    changes_rad_s: Array


@dataclass(frozen=True, slots=True)
class Taken:
    """What the gyroscope is taken for: F (3, 3), biases (N, 3) at the rests, G (3, 3), even and odd (6,) in s/rad."""

    matrix: Array
    biases: Array
    sensitivity: Array
    bends: Array


def moved(session: Handled, taken: Taken, up: Array) -> Moved:
    """The moves by a gyroscope that is taken for so, with the vertical `up` (N, 3) in the body at each rest."""
    matrix, biases, sensitivity, bends = taken.matrix, taken.biases, taken.sensitivity, taken.bends
    middles = np.array([(rest.start_s + rest.end_s) / 2 for rest in session.rests])
    inverse = np.linalg.inv(matrix)
    rotations, by_theta, by_gravity, by_bends, swept, durations, paths, changes = ([] for _ in range(8))
    for row, move in enumerate(session.moves):
        inside = _inside(session.time_s, move.start_s, move.end_s)
        at_s = session.time_s[inside]
        corrected = session.rates[inside] - np.column_stack([np.interp(at_s, middles, each) for each in biases.T])
        there = track(at_s, corrected, matrix)
        squares = np.stack([corrected**2, corrected * np.abs(corrected)], axis=1)
        if sensitivity.any() or bends.any():
            bent = (squares * bends.reshape(2, 3)).sum(axis=1)
            corrected = corrected - up[row] @ there.attitudes @ sensitivity.T - bent
            there = track(at_s, corrected, matrix)
        rotations.append(there.attitudes[-1])
        by_theta.append(there.sensitivity)
        lasting_s = _lasting(at_s)
        turned = there.attitudes @ inverse * -lasting_s[:, None, None]
        by_gravity.append(np.tensordot(turned, up[row] @ there.attitudes, (0, 0)).reshape(3, 9))
        by_bends.append(np.einsum("kij,kbj->ibj", turned, squares).reshape(3, 6))
        swept.append(lasting_s @ corrected)
        durations.append(float(np.ptp(at_s)))
        paths.append(float(lasting_s @ np.linalg.norm(there.rates_rad_s, axis=1)))
        changes.append(float(np.linalg.norm(there.rates_rad_s[2:] - there.rates_rad_s[:-2]) / 2))
    theta = _stacked(by_theta, (3, 12))
    return Moved(
        _stacked(rotations, (3, 3)),
        theta[..., :9],
        theta[..., 9:],
        _stacked(by_gravity, (3, 9)),
        _stacked(by_bends, (3, 6)),
        _stacked(swept, (3,)),
        np.array(durations),
        np.array(paths),
        np.array(changes),
    )


def _inside(time_s: Array, start_s: float, end_s: float) -> slice:
    first, last = np.searchsorted(time_s, (start_s, end_s)).tolist()
    return slice(first, min(last, len(time_s) - 1) + 1)


def _lasting(at_s: Array) -> Array:
    """(m,) s for which each of m readings stands, by the trapezoidal rule."""
    half: Array = np.diff(at_s) / 2
    lasting: Array = np.concatenate([half, [0.0]]) + np.concatenate([[0.0], half])
    return lasting


def _stacked(rows: Sequence[Array], shape: tuple[int, ...]) -> Array:
    return np.array(rows) if rows else np.zeros((0, *shape))
