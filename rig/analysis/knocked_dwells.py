"""Whether something knocked against the sensor in a dwell: its halves differ by more than noise. Pure."""

from collections.abc import Mapping, Sequence

import numpy as np

from rig.analysis.suspicion import Statistic
from rig.estimation.rounding import Steps
from rig.observation.dwell_halves import compare_halves
from rig.observation.raw_dwells import RawDwell

FEWEST_IN_HALF = 20  # readings: fewer do not tell how their mean scatters


def hold_halves_together(
    dwells: Sequence[RawDwell], flicker_counts: float, false_alarm_probability: float, steps: Steps
) -> Mapping[str, Statistic]:
    """Return how much the halves of a dwell differ where they differ most, as χ² of three axes; none of short dwells.

    The limit is that of F: how readings scatter is estimated from those of the dwell. A bias that flickers by an Allan
    deviation of `flicker_counts` makes the halves differ by √2 times as much. The counts come in these steps.
    """
    from scipy.special import fdtri

    long_dwells = [dwell for dwell in dwells if len(dwell.counts) >= 2 * FEWEST_IN_HALF]
    if not long_dwells:
        return {}
    dof = min(len(dwell.counts) for dwell in long_dwells) - 2
    limit = 3 * float(fdtri(3, dof, 1 - false_alarm_probability / len(long_dwells)))
    return {"knocked_dwell": (max(_chi_squared(dwell, flicker_counts, steps) for dwell in long_dwells), limit)}


def _chi_squared(dwell: RawDwell, flicker_counts: float, steps: Steps) -> float:
    difference, variance = compare_halves(dwell, steps)
    return float(np.sum(difference**2 / (variance + 2 * flicker_counts**2)))
