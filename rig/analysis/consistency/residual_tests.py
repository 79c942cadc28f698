"""Readings held against a model, and what might be wrong beside it: the one form of all checks of consistency.

A suspicion is columns: what one thing that might be wrong would add to the readings. How much of what the model leaves
they explain is χ² with as many degrees of freedom as they are beside the model, where nothing is wrong.
"""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Generic, Protocol, TypeVar

import numpy as np

from rig.estimation.arrays import Array

TOLD = 1e-3  # of a column's size, what the model must leave of it
SEEN = 1e-6  # of a damage, what a check must see of it: less is rounding
TOLD_IN = 0.95  # of recordings, a damage of the size from which on it is told
ALIKE = 10.0  # of χ²: what explains less than the best by no more than this might be the cause as well

Seen = TypeVar("Seen")
Statistic = tuple[float, float]  # and its limit
Suspected = tuple[Array, Callable[[int], float]]  # white columns, and what so many of them are beyond if they tell
Suspicions = Mapping[str, Array | None]  # by name of the check; None is anything at all


@dataclass(frozen=True, slots=True)
class Damage(Generic[Seen]):
    """What happens, the `check` that is to tell it, and what its size is counted in; None is the reading's own unit.

    `patterns` are what one of that unit adds to the readings, for each way in which it may happen, less what a
    calibration is to take up: of what changes half-way the mean is meant.
    """

    what: str
    check: str
    unit: str | None
    patterns: Callable[[Seen], Array]


@dataclass(frozen=True, slots=True)
class Consistency:
    """The statistics of one sensor by the name of their check, each with its limit.

    `piece` is that of the sweep or dwell least like the others; `disturbed` are those beyond the limit, by place.
    `told_from` is the size from which on each damage is told, by what happens, where that is known.
    """

    statistics: dict[str, Statistic]
    piece: Statistic
    disturbed: dict[int, Statistic]
    told_from: dict[str, float] = field(default_factory=dict)


class Held(Protocol):
    """Readings and their model, whitened by what is known of both."""

    def explained(self, suspicions: Sequence[Array], beside: Sequence[Array]) -> list[float]:
        """How much each explains that neither the model nor what stands `beside` it does."""

    def judged(self, columns: Array | None, beside: Sequence[Array], rate: float) -> Statistic | None:
        """What columns explain so, and what that is beyond in a share `rate` of recordings in which nothing is wrong.

        None where they explain nothing else.
        """


def told_by(held: Held, suspicions: Suspicions, rate: float) -> dict[str, Statistic]:
    """Statistic of every suspicion that the model does not hold already; `rate` is that of false alarms for each."""
    judged = {name: held.judged(columns, (), rate) for name, columns in suspicions.items()}
    return {name: statistic for name, statistic in judged.items() if statistic is not None}


def unlike_the_others(
    held: Held, pieces: Iterable[int], columns: Callable[[int], Array], rate: float
) -> list[tuple[int, Statistic]]:
    """The piece least like the others, then the next once that is taken out, until they agree or half are out.

    Where two pieces are all that tells of something, either of the two may be the one: then both are named.
    """
    left, beside = list(pieces), list[Array]()
    each_rate, most, found = rate / len(left), (len(left) + 1) // 2, list[tuple[int, Statistic]]()
    while len(found) < most:
        explained = dict(zip(left, held.explained(list(map(columns, left)), beside), strict=True))
        worst = max(left, key=lambda piece: explained[piece])
        statistic = held.judged(columns(worst), beside, each_rate) or (0.0, 0.0)
        if statistic[0] <= statistic[1]:
            return found or [(worst, statistic)]
        alike = [piece for piece in left if explained[piece] > explained[worst] - ALIKE]
        found += [(piece, statistic) for piece in alike]
        left = [piece for piece in left if piece not in alike]
        beside.append(columns(worst))
    return found


def basis(columns: Array) -> Array:
    """Orthonormal columns that span the same."""
    sizes = np.linalg.norm(columns, axis=0)
    left, singular, _ = np.linalg.svd(columns / np.where(sizes > 0, sizes, 1.0), full_matrices=False)
    found: Array = left[:, singular > 1e-6 * singular[0]]
    return found


def told_beside(known: Array, columns: Array) -> Array:
    """(n, k) orthonormal: what of white columns the `known` ones (n, p), orthonormal, do not span."""
    sizes = np.linalg.norm(columns, axis=0)
    new = columns / np.where(sizes > 0, sizes, 1.0)
    new = new - known @ (known.T @ new)
    left, singular, _ = np.linalg.svd(new, full_matrices=False)
    told: Array = left[:, singular > TOLD]
    return told


def explained(seen: Array, base: Array, columns: Array | None) -> tuple[float, int]:
    """How much of what `base` leaves of white readings these columns explain, and how many they are beside it.

    None explains all of it. (Decomposing that many columns is slow, and LAPACK's quick way does not always converge.)
    """
    known = basis(base)
    unexplained = seen - known @ (known.T @ seen)
    if columns is None:
        return float(unexplained @ unexplained), len(seen) - known.shape[1]
    told = told_beside(known, columns)
    found = told.T @ unexplained
    return float(found @ found), told.shape[1]


def told_from(known: Array, patterns: Array, suspected: Iterable[Suspected]) -> float:
    """The size from which on damages are told, whichever of `patterns` (n, k) they have: infinite where one never is.

    All is white; `known` (n, p) orthonormal is the model, and each that is `suspected` may tell. What its columns
    explain is χ² about the damage then, no central one.
    """
    from scipy.special import chndtrinc

    told = np.zeros(patterns.shape[1])
    for columns, limit in suspected:
        new = told_beside(known, columns)
        if count := new.shape[1]:
            size = np.sqrt(chndtrinc(limit(count), count, 1 - TOLD_IN))
            told = np.maximum(told, np.linalg.norm(new.T @ patterns, axis=0) / size)
    seen = told.min() > SEEN * np.linalg.norm(patterns, axis=0).max(initial=0.0)
    return float(1 / told.min()) if seen else float(np.inf)
