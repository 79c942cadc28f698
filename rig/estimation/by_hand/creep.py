"""Rests in which the body crept, that is, turned slowly while it lay on a face.

The mean reading of such a rest differs from that of the rests before and after. The graph has no rotation within a
rest, so the fit explains the difference by a bias that jumps and returns, and overestimates the bias' random walk.
"""

from collections.abc import Collection, Iterator, Sequence
from itertools import product

import numpy as np

from rig.estimation.arrays import Array
from rig.estimation.by_hand.fit import GraphFit, estimate_stds, solve_step
from rig.estimation.by_hand.graph import REST, RESTS, WALK, Factor
from rig.estimation.by_hand.session_parts import STATED

MAX_WALK_RATIO = 3.0  # of the bias' random walk with the creeping rests to that without them
MAX_CREEPING_FRACTION = 0.125  # of the rests: if more stand out, the bias itself jumps


def find_creeping_rests(fit: GraphFit) -> tuple[int, ...]:
    """Return the few rests without which the bias' random walk is much smaller; empty if a few do not suffice.

    Only a rest between two used rests can be identified, because elsewhere a creep looks like a jump of the bias. If a
    jump before or after such a rest explains the readings as well, which happens on faces that occur once, no rest is
    returned, because the two causes lead to different biases.
    """
    if fit.stds.walk_rad_s_sqrt_s <= MAX_WALK_RATIO * STATED.walk_rad_s_sqrt_s:
        return ()
    middles_s = np.array([(rest.start_s + rest.end_s) / 2 for rest in fit.session.rests])
    left_out: list[int] = []
    rows: Sequence[Factor] = fit.factors

    def explains(remaining: Sequence[Factor]) -> bool:
        return estimate_stds(remaining, fit.stds)[1].walk_rad_s_sqrt_s * MAX_WALK_RATIO < fit.stds.walk_rad_s_sqrt_s

    for _ in range(max(1, int(MAX_CREEPING_FRACTION * len(middles_s)))):
        biases = fit.state.biases + solve_step(rows)[0][RESTS:].reshape(-1, 6)[:, 3:]
        distances = _distances_from_neighbours(middles_s, biases, left_out)
        if not distances.any():
            return ()
        left_out.append(int(np.argmax(distances)))  # a creep looks like a bias far from its neighbours'
        rows = _leave_out_rests(fit.factors, left_out)
        if explains(rows):
            is_jump = any(explains(rows_with_jump) for rows_with_jump in _allow_jumps(fit.factors, left_out))
            return () if is_jump else tuple(sorted(left_out))
    return ()


def _leave_out_rests(factors: Sequence[Factor], rests: Collection[int]) -> list[Factor]:
    """Return the factors without the readings in the `rests`."""
    return [row for row in factors if row.kind != REST or row.index not in rests]


def _allow_jumps(factors: Sequence[Factor], rests: Sequence[int]) -> Iterator[list[Factor]]:
    """Yield the factors with one of `rests` in use again, but with a jump of the bias allowed before or after it.

    The readings of the other `rests` remain left out.
    """
    for rest, first in product(rests, (-1, 0)):
        kept = _leave_out_rests(factors, {*rests} - {rest})
        yield [row for row in kept if row.kind != WALK or row.index != rest + first]


def _distances_from_neighbours(times_s: Array, biases: Array, left_out: Sequence[int]) -> Array:
    """Return the distance (n,) of each bias (n, 3) from the value interpolated between its two neighbours in time.

    The distance is 0 at both ends, in a rest that is left out, and in the neighbours of such a rest.
    """
    distances = np.zeros(len(times_s))
    for row in range(1, len(times_s) - 1):
        if not {row - 1, row, row + 1} & set(left_out):
            sides = times_s[[row - 1, row + 1]]
            between = [np.interp(times_s[row], sides, axis) for axis in biases[[row - 1, row + 1]].T]
            distances[row] = np.linalg.norm(biases[row] - between)
    return distances
