"""An exchange search for the attitudes with the largest determinant of the information (Fedorov, 1972)."""

import numpy as np

from rig.estimation.arrays import Array


def information(rows: Array) -> Array:
    """Return the information (N, p, p) of each attitude, from the weighted equations (N, 3, p)."""
    added: Array = np.swapaxes(rows, -1, -2) @ rows
    return added


def log_determinant(information: Array, chosen: list[int]) -> float:
    """Return the log determinant of these attitudes' information; -inf if they leave a parameter undetermined."""
    return float(np.linalg.slogdet(information[chosen].sum(axis=0))[1])


def exchange_search(information: Array, count: int, rng: np.random.Generator, starts: int) -> list[int]:
    """Return the best `count` different attitudes, by exchanges from random starts as long as one improves it."""
    designs = [_exchange(information, rng.permutation(len(information))[:count].tolist()) for _ in range(starts)]
    return max(designs, key=lambda chosen: log_determinant(information, chosen))


def _exchange(information: Array, chosen: list[int]) -> list[int]:
    while True:
        now = information[chosen].sum(axis=0)
        others = [index for index in range(len(information)) if index not in chosen]
        trials = now - information[chosen][:, None] + information[others]
        values = np.linalg.slogdet(trials)[1]
        out, into = np.unravel_index(int(np.argmax(values)), values.shape)
        if not values[out, into] > np.linalg.slogdet(now)[1] + 1e-9:
            return chosen
        chosen = [*chosen[:out], others[into], *chosen[out + 1 :]]
