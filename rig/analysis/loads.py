"""The rates with which the sweeps loaded each of a gyroscope's own axes: at these its scale factors were found."""

import numpy as np

from rig.estimation.arrays import Array
from rig.estimation.vector_fit import Explained

TELLS = 0.25  # of the largest load: what is smaller has less than a sixteenth of its weight in the scale factor


def loads_rad_s(explained: Explained) -> Array:
    """(3, 2) smallest and largest rate along the sensor's x, y, z, either way, in the sweeps that tell its scale."""
    solution, turns = explained.solution, explained.seen.turns_rad_s
    along = np.abs(turns @ (solution.matrix * solution.scale[:, None]).T)
    largest = along.max(axis=0)
    smallest = np.where(along >= TELLS * largest, along, np.inf).min(axis=0)
    loads: Array = np.column_stack([smallest, largest])
    return loads
