"""p-values of the consistency checks of accelerometers and magnetometers."""

import numpy as np

from rig.analysis.consistency.reference_alternatives import ReferenceModel
from rig.analysis.consistency.reference_checks import check_reference

RATES = np.concatenate([np.geomspace(1e-4, 0.02, 5), np.linspace(0.05, 0.95, 19)])


def p_values(read: ReferenceModel) -> dict[str, float]:
    """Return the false-alarm probability at which each statistic is just beyond its limit."""
    beyond: dict[str, float] = {}
    for rate in RATES:
        for name, (value, limit) in check_reference(read, float(rate)).statistics.items():
            if value > limit:
                beyond.setdefault(name, float(rate))
            elif rate == RATES[-1]:
                beyond.setdefault(name, 1.0)
    return beyond
