"""The ratio of a reference's rates to a gyroscope's readings, which shows readings in another unit or out of range.

At the end of its range a sensor repeats one value. Corrected readings do not show this, because each contains the noise
of other axes.
"""

import numpy as np

from rig.data.quantity import RATE
from rig.errors import Fault, or_fault
from rig.estimation.refusals import check_reading_ratio
from rig.observation.external.reference_rows import Turning
from rig.observation.external.table_motion import TableMotion

MIN_RATE_RAD_S = 0.5  # a slower rate of the reference is too noisy for a ratio
END_FRACTION = 0.97  # of an axis' largest reading: a larger one is at the end of the range, if that is exceeded
MIN_READINGS = 20  # at an end, and elsewhere
MIN_RATIO = 1.1  # of the true rate about an axis to its reading


def check_rate_ratios(turning: Turning) -> None:
    """Raise Fault `wrong_unit` if the readings have another unit, `saturation` if the largest ones are too small.

    Only sizes of rates are compared, which do not depend on how the gyroscope is mounted.
    """
    motion = or_fault(lambda: TableMotion(turning.rows_s.mean(axis=1), turning.attitudes, None))
    if isinstance(motion, Fault):
        return
    rates = np.linalg.norm(motion.rate(turning.time_s), axis=1)
    turns = motion.covered(turning.time_s) & (rates > MIN_RATE_RAD_S)
    readings, rates = turning.readings_rad_s[turns], rates[turns]
    signed = np.concatenate([readings.T, -readings.T])
    at_end = signed > END_FRACTION * signed.max(axis=1, initial=0.0, keepdims=True)
    sizes = np.linalg.norm(readings, axis=1)
    inside = ~at_end.any(axis=0) & (sizes > 0)
    if inside.sum() < MIN_READINGS:
        return
    ratio = float(np.median(sizes[inside] / rates[inside]))
    check_reading_ratio(ratio, "the moves")
    for end, letter in enumerate(RATE.axes * 2):
        column, size, rate = signed[end, at_end[end]], sizes[at_end[end]], ratio * rates[at_end[end]]
        if len(column) < MIN_READINGS:
            continue
        about_axis = np.sqrt(np.maximum(rate**2 - (size**2 - column**2), 0.0))  # the other axes read their part
        if (exceeded := float(np.median(about_axis / column))) > MIN_RATIO:
            raise Fault(
                "saturation",
                f"where the gyroscope reads nearly its largest value on {letter}, {'+-'[end // 3]}{column.mean():.4g} "
                f"rad/s, the attitudes turn about it {exceeded:.3g} times as fast: it is the end of its range",
                "Choose a wider range, or turn more slowly",
            )
