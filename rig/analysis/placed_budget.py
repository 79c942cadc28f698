"""The uncertainty budget of a sensor calibrated in known attitudes: scale and bias, by what makes them uncertain."""

from collections.abc import Mapping
from typing import Literal

import numpy as np

from rig.estimation import known_increments, placement
from rig.estimation.arrays import Array
from rig.estimation.budget import Budget, Contributor
from rig.estimation.reference_budget import scale_and_bias_covariance

SOURCES: Mapping[str, tuple[Literal["A", "B"], str]] = {
    placement.NOISE: ("A", "scatter of the readings"),
    placement.ATTITUDES: ("A", "what the readings say of them"),
    placement.PLACEMENTS: ("A", "how the placements differ beside their attitudes"),
    known_increments.DELAY: ("A", "found, within 50 ms of none"),
    known_increments.EARTHS_RATE: ("B", "its size, whichever way it points"),
    known_increments.STRETCHES: ("A", "how six stretches of the recording differ"),
}


def budget_by_causes(matrix: Array, causes: Mapping[str, Array]) -> Budget:
    """From what each cause does to the covariance (p, p) of a reference model's parameters, F (3, 3) first."""
    scale = 1 / np.linalg.norm(matrix, axis=1)
    lines = []
    for name, each in causes.items():
        kind, source = SOURCES[name]
        spread = scale_and_bias_covariance(matrix, scale, each)
        lines.append(Contributor(name, kind, "normal", None, "", source, np.inf, spread))
    return Budget(tuple(lines))
