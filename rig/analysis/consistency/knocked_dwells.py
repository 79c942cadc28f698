"""Whether something knocked against the sensor in a dwell: its halves differ by more than noise. Pure."""

from collections.abc import Mapping, Sequence

import numpy as np

from rig.analysis.consistency.residual_tests import Statistic
from rig.estimation.arrays import Array
from rig.estimation.statistics.rounding import Steps
from rig.observation.consistency.dwell_halves import compare_halves
from rig.observation.consistency.raw_dwells import RawDwell

FEWEST_IN_HALF = 20  # readings: fewer do not tell how their mean scatters


def hold_halves_together(
    dwells: Sequence[RawDwell], flicker_counts: float, false_alarm_probability: float, steps: Steps
) -> Mapping[str, Statistic]:
    """Return how much the halves of a dwell differ where they differ most, as χ² of three axes; none of short dwells.

    The limit is that of F: how readings scatter is estimated from those of the dwells, and in a dwell like any other. A
    bias that flickers by an Allan deviation of `flicker_counts` makes the halves differ by √2 times as much. What
    swings slowly, and no encoder sees, does it in every dwell, a knock in one: by how much the halves of the other
    dwells differ, those of one may. The degrees of freedom of both are put together by Welch and Satterthwaite. The
    counts come in these steps.
    """
    from scipy.special import fdtri

    long_dwells = [dwell for dwell in dwells if len(dwell.counts) >= 2 * FEWEST_IN_HALF]
    if not long_dwells:
        return {}
    halves = [compare_halves(dwell, steps) for dwell in long_dwells]
    differences, variances = (np.array(each) for each in zip(*halves, strict=True))
    # Not each dwell's own: half a cycle of a swing looks like a colour, and a colour explains a step as well.
    noise = np.median(variances, axis=0) + 2 * flicker_counts**2
    swing = _swings(differences, noise)
    dof_of_noise = min(len(dwell.counts) for dwell in long_dwells) - 2
    dof_of_swing = max(len(long_dwells) - 1, 1)
    dof = (noise.mean() + swing) ** 2 / (noise.mean() ** 2 / dof_of_noise + swing**2 / dof_of_swing)
    chi_squared = np.sum(differences**2 / (noise + swing[:, None]), axis=1)
    limits = 3 * fdtri(3, dof, 1 - false_alarm_probability / len(long_dwells))
    worst = int(np.argmax(chi_squared / limits))
    return {"knocked_dwell": (float(chi_squared[worst]), float(limits[worst]))}


def _swings(differences: Array, noise: Array) -> Array:
    """Return (N,) the mean square by which the halves of the others of N dwells differ beyond their noise (3,)."""
    beyond = (differences**2 - noise).mean(axis=1)
    others: Array = np.maximum((beyond.sum() - beyond) / max(len(beyond) - 1, 1), 0.0)
    return others
