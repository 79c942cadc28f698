"""Rests in which the body crept: it lay, and turned by as much as a bias does not change and change back.

The reading of such a rest is another than before and after it. To the graph this is a bias that jumps and jumps back,
which makes the walk of the bias much larger than the other rests make it, and the turn within the rest is in no move.
"""

from collections.abc import Sequence

import numpy as np

from rig.estimation.arrays import Array
from rig.estimation.by_hand.fit import Fit, sized_anew, solved
from rig.estimation.by_hand.graph import REST, RESTS, Factor
from rig.estimation.by_hand.session import STATED

OF_THEM = 3.0  # times as large as without them is the walk of the bias, if it is theirs
MOST = 0.125  # of the rests: if more stand out, that is how this bias goes


def crept(fit: Fit) -> tuple[int, ...]:
    """Return the rests without which the bias walks much less, as few as do it; none if no few do.

    Each has a rest on either side that counts: at the first and the last one a creep looks like a jump of the bias, as
    it does at two rests in a row.
    """
    if fit.sizes.walk_rad_s_sqrt_s <= OF_THEM * STATED.walk_rad_s_sqrt_s:
        return ()
    middles_s = np.array([(rest.start_s + rest.end_s) / 2 for rest in fit.session.rests])
    left_out: list[int] = []
    rows: Sequence[Factor] = fit.factors
    for _ in range(max(1, int(MOST * len(middles_s)))):
        biases = fit.state.biases + solved(rows)[0][RESTS:].reshape(-1, 6)[:, 3:]
        aside = _aside(middles_s, biases, left_out)
        if not aside.any():
            return ()
        left_out.append(int(np.argmax(aside)))
        rows = [row for row in fit.factors if row.kind != REST or row.at not in left_out]
        if sized_anew(rows, fit.sizes)[1].walk_rad_s_sqrt_s * OF_THEM < fit.sizes.walk_rad_s_sqrt_s:
            return tuple(sorted(left_out))
    return ()


def _aside(at_s: Array, biases: Array, left_out: Sequence[int]) -> Array:
    """(n,) how far each bias (n, 3) is off the line between its neighbours'; 0 if no rest on either side counts."""
    aside = np.zeros(len(at_s))
    for row in range(1, len(at_s) - 1):
        if not {row - 1, row, row + 1} & set(left_out):
            sides = at_s[[row - 1, row + 1]]
            between = [np.interp(at_s[row], sides, axis) for axis in biases[[row - 1, row + 1]].T]
            aside[row] = np.linalg.norm(biases[row] - between)
    return aside
