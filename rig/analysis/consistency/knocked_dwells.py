"""The check for a knock in a dwell, whose halves then differ by more than noise. Pure functions."""

from collections.abc import Mapping, Sequence

import numpy as np

from rig.analysis.consistency.residual_tests import Statistic
from rig.estimation.arrays import Array
from rig.estimation.statistics.rounding import Steps
from rig.observation.consistency.dwell_halves import compare_halves
from rig.observation.consistency.raw_dwells import RawDwell

MIN_HALF_READINGS = 20  # fewer do not show how their mean scatters


def compare_dwell_halves(
    dwells: Sequence[RawDwell], flicker_counts: float, false_alarm_probability: float, steps: Steps
) -> Mapping[str, Statistic]:
    """Return, under the check's name, the largest difference between the halves of a dwell, and its limit.

    The difference is the χ² of three axes. Short dwells are not tested; if all are short, there is no check.
    `flicker_counts` is the Allan deviation of the bias' flicker, which makes halves differ too. `steps` are the
    quantization steps of the counts.
    """
    from scipy.special import fdtri

    long_dwells = [dwell for dwell in dwells if len(dwell.counts) >= 2 * MIN_HALF_READINGS]
    if not long_dwells:
        return {}
    halves = [compare_halves(dwell, steps) for dwell in long_dwells]
    differences, variances = (np.array(part) for part in zip(*halves, strict=True))
    # One noise for all dwells: in a single dwell, half a cycle of an oscillation looks like coloured noise, which would
    # explain a step as well.
    # Flicker makes the halves differ by √2 times its Allan deviation. A slow oscillation that no encoder measures
    # affects every dwell, a knock only one. So the mean square of the other dwells' differences is added to the
    # variance, and dof follow from Welch–Satterthwaite. The noise is estimated, so the limit is a quantile of F.
    noise = np.median(variances, axis=0) + 2 * flicker_counts**2
    swing = _vibration_variances(differences, noise)
    dof_of_noise = min(len(dwell.counts) for dwell in long_dwells) - 2
    dof_of_swing = max(len(long_dwells) - 1, 1)
    dof = (noise.mean() + swing) ** 2 / (noise.mean() ** 2 / dof_of_noise + swing**2 / dof_of_swing)
    chi_squared = np.sum(differences**2 / (noise + swing[:, None]), axis=1)
    limits = 3 * fdtri(3, dof, 1 - false_alarm_probability / len(long_dwells))
    worst = int(np.argmax(chi_squared / limits))
    return {"knocked_dwell": (float(chi_squared[worst]), float(limits[worst]))}


def _vibration_variances(differences: Array, noise: Array) -> Array:
    """Return the variance of vibration for each of N dwells, as the other dwells show it.

    It is the mean square of their `differences` (N, 3), minus `noise` (3,), the variance that noise gives these.
    """
    beyond = (differences**2 - noise).mean(axis=1)
    others: Array = np.maximum((beyond.sum() - beyond) / max(len(beyond) - 1, 1), 0.0)
    return others
