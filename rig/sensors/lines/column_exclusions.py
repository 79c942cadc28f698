"""Columns of an unknown log that have names of a sensor's columns but are not read, and the reasons."""

import re
from collections.abc import Collection, Sequence

import numpy as np

from rig.estimation.arrays import Array
from rig.observation.formats.table_layout import TableLayout
from rig.sensors.lines.column_names import AXES, find_axis, simplify_heading
from rig.sensors.lines.column_units import GRAVITY_BY_UNIT

SENSORS = {"g": "gyroscope", "a": "accelerometer", "m": "magnetometer"}
VIRTUAL_NAME = re.compile(r"(?P<gravity>gravity)|(?P<linear>lin(ear)?[ _.]*acc)|(free|user)[ _.]*acc", re.IGNORECASE)
WITH_GRAVITY = re.compile(r"(incl\w*|with)[ _]*gravity", re.IGNORECASE)
MIN_STEPS, MIN_RISING = 10, 0.9  # of a counter; fraction of steps that rise; none may fall
LEAST_GRAVITY = 0.7  # fraction of 1 g that remains in an accelerometer's median reading


def find_virtual(layout: TableLayout, values: Array, title: str) -> tuple[set[int], list[str]]:
    """Return the columns that a program computed (gravity, or acceleration without gravity), and why each is omitted.

    `title` is the file's name. It decides about columns that are named only x, y or z.
    """
    kinds: dict[str, list[int]] = {}
    for index in layout.numbers:
        heading = layout.headings[index]
        is_axis = heading.lower() in {"x", "y", "z"}
        match = VIRTUAL_NAME.search(title if is_axis else heading)
        if match is not None and not WITH_GRAVITY.search(heading):
            kinds.setdefault(match.lastgroup or "free", []).append(index)
    if "linear" in kinds and _has_gravity(values[:, kinds["linear"]]):
        del kinds["linear"]  # robots' logs call the readings of an accelerometer linear acceleration
    reasons = [
        f"{' '.join(layout.headings[index] for index in indices)} are no accelerometer's readings: "
        + ("gravity is computed from several sensors" if kind == "gravity" else "gravity is removed from them")
        for kind, indices in kinds.items()
    ]
    return {index for indices in kinds.values() for index in indices}, reasons


def _has_gravity(values: Array) -> bool:
    """Return whether the median norm of readings (n, k) is near gravity in some unit."""
    level = float(np.nanmedian(np.linalg.norm(values[:, :3], axis=1)))
    return any(LEAST_GRAVITY < level / size < 1 / LEAST_GRAVITY for size in GRAVITY_BY_UNIT.values())


def explain_unread(
    layout: TableLayout, values: Array, used: Collection[int | None], read: Collection[str | int]
) -> list[str]:
    """Return a sentence on each triad of columns that is named like a sensor's axes but is not in `read`.

    `read` are the columns that are read as a sensor's; `used` are the numbers of columns with another meaning, which
    need no sentence.
    """
    columns: dict[tuple[str, str], list[int]] = {}
    for index in range(len(layout.headings)):
        if index not in used and (axis := find_axis(simplify_heading(layout, index))) is not None:
            columns.setdefault(axis, []).append(index)
    triads = {kind: [*zip(*(columns.get((kind, axis), []) for axis in AXES), strict=False)] for kind in SENSORS}
    reasons: list[str] = []
    for kind, sensors in triads.items():
        is_kind_read = any(layout.name(index) in read for triad in sensors for index in triad)
        reasons += [
            f"{' '.join(layout.headings[index] for index in triad)} are not read: "
            + _explain_triad(layout, values, triad, SENSORS[kind] if is_kind_read else "")
            for triad in sensors
            if not any(layout.name(index) in read for index in triad)
        ]
    return reasons


def _explain_triad(layout: TableLayout, values: Array, triad: Sequence[int], sensor_read: str) -> str:
    """Return why three columns are not read.

    `sensor_read` names a sensor of the same quantity that is read; "" if there is none.
    """
    headings = layout.headings
    if texts := [headings[index] for index in triad if index not in layout.numbers]:
        return f"not all cells of {' '.join(texts)} are numbers"
    if steady := [headings[index] for index in triad if is_constant(values[:, index])]:
        return f"the numbers of {' '.join(steady)} never change"
    if counters := [headings[index] for index in triad if is_counter(values[:, index])]:
        return f"the numbers of {' '.join(counters)} rise from row to row, as a counter's"
    if sensor_read:
        return f"they are a second {sensor_read}, and of each kind one is read"
    present = np.isfinite(values[:, list(triad)])
    count = int((present.any(axis=1) & ~present.all(axis=1)).sum())
    if 0 < 2 * count <= present.any(axis=1).sum():
        return f"in {count} of {len(present)} rows only some of them have a number"
    return "their numbers are in different rows" if count else "other columns are named alike"


def is_constant(column: Array) -> bool:
    """Return whether all numbers of a column are the same."""
    return bool(np.nanmin(column) == np.nanmax(column))


def is_counter(column: Array) -> bool:
    """Return whether a column rises from row to row, as the numbers of the rows or a second clock do."""
    steps = np.diff(column[np.isfinite(column)])
    return len(steps) > MIN_STEPS and bool((steps >= 0).all() and (steps > 0).mean() > MIN_RISING)
