"""Triads of an unknown log: columns named as such, and unnamed columns that are recognized by their readings."""

from collections.abc import Sequence

import numpy as np

from rig.estimation.arrays import Array
from rig.sensors.lines.column_names import AXES, is_nameless
from rig.sensors.lines.guessing import Flags, Guess, find_temperature, find_triads, match_names
from rig.sensors.lines.shape import Shape

UNNAMED = "-"
NAMED_OTHERWISE = "other"


def guess_triads(
    names: tuple[str, ...], indices: Sequence[int], values: Array, still: Flags, rate_hz: float
) -> tuple[Guess, list[list[int]]]:
    """Guess which columns of readings (n, k), at `rate_hz`, are triads of sensors, and in which units.

    Return the guess, and the positions of the unnamed triads that remain undetermined. `indices` (k,) are the columns'
    numbers in the file. `still` (n,) marks the rows at rest; if it marks none, all rows count as at rest.
    """
    count = values.shape[1]
    still = still if still.any() else np.ones(len(values), dtype=np.bool_)
    shape = Shape("", "", (), False, names, values, np.arange(len(values)) / rate_hz, (-1,) * count, 0)
    guess = Guess([UNNAMED if is_nameless(name) else NAMED_OTHERWISE for name in names], rate_hz)
    for position, name in match_names(names).items():
        if name not in ("time", "sequence"):
            guess.columns[position] = name
    named: set[str] = {kind for kind in "gam" if all(kind + axis in guess.columns for axis in AXES)}
    find_triads(shape, guess, still, _list_starts(guess.columns, names, indices))
    _drop_unconfirmed(guess, named)
    starts = _list_starts(guess.columns, names, indices)
    find_temperature(shape, guess, still)
    return guess, [[*range(start, start + 3)] for start in starts if guess.columns[start : start + 3] == [UNNAMED] * 3]


def _list_starts(columns: Sequence[str], names: Sequence[str], indices: Sequence[int]) -> list[int]:
    """Return the positions at which an unnamed triad may begin.

    Three unnamed columns are a triad if their headings are x y z. Otherwise they must be adjacent, and follow a
    sensor's column or lie at a multiple of three from the first unnamed column: a program writes its sensors one after
    another, so other groups of three columns would belong to two sensors.
    """
    first = next((index for index, column in zip(indices, columns, strict=True) if column == UNNAMED), 0)
    starts: list[int] = []
    for start in range(len(columns) - 2):
        if [*columns[start : start + 3]] != [UNNAMED] * 3 or (starts and start < starts[-1] + 3):
            continue
        are_axes = [name.partition(" ")[0] for name in names[start : start + 3]] == [*AXES]
        are_adjacent = indices[start + 2] == indices[start] + 2
        follows = start > 0 and columns[start - 1][:1] in {"g", "a", "m"} and indices[start - 1] + 1 == indices[start]
        if are_axes or (are_adjacent and (follows or (indices[start] - first) % 3 == 0)):
            starts.append(start)
    return starts


def _drop_unconfirmed(guess: Guess, named: set[str]) -> None:
    """Remove from a guess the unnamed triads that neither the size nor the rotation of gravity confirms.

    Other columns may hold numbers of the same size. So an accelerometer in counts needs gravity's rotation, and a
    magnetometer needs a confirmed gyroscope and accelerometer.
    """
    confirmed = set(named)
    rate, force = guess.units.get("g", {}), guess.units.get("a", {})
    is_rotation_shown = rate.get("unit", "?") != "?" and "g" not in named
    if is_rotation_shown:
        confirmed.add("g")
    if force.get("unit", "?") != "?" and ("scale" not in force or is_rotation_shown):
        confirmed.add("a")
    if {"g", "a"} <= confirmed:
        confirmed.add("m")
    for kind in set(guess.units) - confirmed:
        del guess.units[kind]
        guess.columns = [UNNAMED if column[:1] == kind else column for column in guess.columns]
