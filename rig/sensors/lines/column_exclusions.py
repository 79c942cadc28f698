"""Columns of an unknown log whose names are those of a sensor, but that are not read, and why."""

import re

import numpy as np

from rig.estimation.arrays import Array
from rig.observation.formats.table_layout import TableLayout
from rig.sensors.lines.column_units import GRAVITY_BY_UNIT

VIRTUAL_NAME = re.compile(r"(?P<gravity>gravity)|(?P<linear>lin(ear)?[ _.]*acc)|(free|user)[ _.]*acc", re.IGNORECASE)
WITH_GRAVITY = re.compile(r"(incl\w*|with)[ _]*gravity", re.IGNORECASE)
LEAST_GRAVITY = 0.7  # fraction of 1 g that remains in an accelerometer's median reading


def find_virtual(layout: TableLayout, values: Array, title: str) -> tuple[set[int], list[str]]:
    """Return the columns that a program computed as gravity or acceleration without it, and a sentence on each kind.

    `title`: the file's name, which counts for columns that are named by their axes alone.
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
    """Return whether the median size of readings (n, k) is near gravity in some unit."""
    level = float(np.nanmedian(np.linalg.norm(values[:, :3], axis=1)))
    return any(LEAST_GRAVITY < level / size < 1 / LEAST_GRAVITY for size in GRAVITY_BY_UNIT.values())
