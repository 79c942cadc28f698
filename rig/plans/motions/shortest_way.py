"""The shortest way through places, there and back. Pure."""

import numpy as np

from rig.estimation.arrays import Array

WORTH_S = 1e-9  # a change that gains less is rounding, and would go on for ever


def shortest_way(between_s: Array) -> tuple[int, ...]:
    """The places 1 to n − 1 in the order in which the round from place 0 back to it takes least time.

    `between_s` (n, n), symmetric. Of each nearest-neighbour round parts are turned about until that gains nothing more
    (2-opt: Croes, Operations Research 6 (1958) 791), and the best is taken: not always the very shortest round.
    """
    rounds = [_bettered(_nearest_neighbours(between_s, first), between_s) for first in range(1, len(between_s))]
    best = min(rounds, key=lambda order: round(_length(order, between_s), 9))
    return tuple(best[1:])


def _length(order: list[int], between_s: Array) -> float:
    return float(between_s[order, np.roll(order, -1)].sum())


def _nearest_neighbours(between_s: Array, first: int) -> list[int]:
    """The order from place 0 to `first`, then always to the nearest that is left."""
    order, left = [0, first], [place for place in range(1, len(between_s)) if place != first]
    while left:
        order.append(min(left, key=lambda place: float(between_s[order[-1], place])))
        left.remove(order[-1])
    return order


def _bettered(order: list[int], between_s: Array) -> list[int]:
    """The order with the part between two ways turned about, over and over, wherever that gains most."""
    while True:
        here, there = np.array(order), np.roll(order, -1)
        ways = between_s[here, there]
        gain = ways[:, None] + ways - between_s[np.ix_(here, here)] - between_s[np.ix_(there, there)]
        gain = np.triu(gain, 1)  # between two different ways
        first, last = np.unravel_index(int(np.argmax(gain)), gain.shape)
        if not gain[first, last] > WORTH_S:
            return order
        order[first + 1 : last + 1] = order[first + 1 : last + 1][::-1]
