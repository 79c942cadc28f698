"""The shortest round trip through points. Pure functions."""

import numpy as np

from rig.estimation.arrays import Array

MIN_GAIN_S = 1e-9  # a smaller gain is rounding, and might repeat forever


def shortest_way(between_s: Array) -> tuple[int, ...]:
    """Return the points 1 to n − 1 in the order of the shortest round trip from point 0.

    `between_s` (n, n) are the times between points, a symmetric matrix. Each nearest-neighbour tour is improved by
    reversing parts as long as that shortens the tour (2-opt: Croes, Operations Research 6 (1958) 791). The best of
    these tours is returned, which is not always the optimum.
    """
    rounds = [_improve(_nearest_neighbours(between_s, first), between_s) for first in range(1, len(between_s))]
    best = min(rounds, key=lambda order: round(_length(order, between_s), 9))
    return tuple(best[1:])


def _length(order: list[int], between_s: Array) -> float:
    return float(between_s[order, np.roll(order, -1)].sum())


def _nearest_neighbours(between_s: Array, first: int) -> list[int]:
    """Return the order from point 0 to `first`, and then always to the nearest remaining point."""
    order, remaining = [0, first], [point for point in range(1, len(between_s)) if point != first]
    while remaining:
        order.append(min(remaining, key=lambda point: float(between_s[order[-1], point])))
        remaining.remove(order[-1])
    return order


def _improve(order: list[int], between_s: Array) -> list[int]:
    """Return a tour improved by 2-opt: reverse the part that shortens the tour most, until no reversal shortens it."""
    while True:
        starts, ends = np.array(order), np.roll(order, -1)
        durations_s = between_s[starts, ends]
        gain = durations_s[:, None] + durations_s - between_s[np.ix_(starts, starts)] - between_s[np.ix_(ends, ends)]
        gain = np.triu(gain, 1)  # between two different edges
        first, last = np.unravel_index(int(np.argmax(gain)), gain.shape)
        if not gain[first, last] > MIN_GAIN_S:
            return order
        order[first + 1 : last + 1] = order[first + 1 : last + 1][::-1]
