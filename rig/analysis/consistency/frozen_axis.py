"""The check for an axis that repeats one reading while its rate changes, which no healthy axis does, however coarse."""

import numpy as np

from rig.data.quantity import RATE
from rig.estimation.arrays import Array, equal_runs
from rig.observation.observed_run import ObservedRun

MIN_EQUAL_READINGS = 25  # in a row: fewest after which the motion is examined
LAG_S = 0.15  # at either end of them: a sensor's filter lags, and the clock's offset is known to milliseconds only
SMOOTHING_S = 0.1
MIN_CHANGE_STEPS, MIN_CHANGE_RAD_S = 10.0, 0.02  # of the rate about the axis, in the nominal mounting


def find_longest_frozen(recording: ObservedRun, name: str) -> int:
    """Return the largest number of equal readings in a row on an axis of a gyroscope while the true rate changed.

    The true rate is computed with the nominal mounting, because a tilted axis or a wrong scale factor hardly alters a
    change of rate.
    """
    stream = recording.stream(name)
    counts = stream.sensor.channel(RATE).counts(stream.raw)
    axes = np.array(stream.sensor.mounting)
    least_rad_s = np.maximum(MIN_CHANGE_STEPS * np.broadcast_to(stream.steps.unit, 3), MIN_CHANGE_RAD_S)
    longest = 0
    for axis in range(3):
        runs = equal_runs(counts[:, axis])
        for start, end in runs[runs[:, 1] - runs[:, 0] > MIN_EQUAL_READINGS].tolist():
            if end - start > longest:
                time_s = stream.time_s[start:end]
                inside = (time_s > time_s[0] + LAG_S) & (time_s < time_s[-1] - LAG_S)
                if _rate_change(recording, time_s[inside], axes[axis]) > least_rad_s[axis]:
                    longest = end - start
    return longest


def _rate_change(recording: ObservedRun, time_s: Array, axis: Array) -> float:
    """Return the range, rad/s, of the flange's rate about an `axis` (3,) at the times (n,).

    Rates are averaged over `SMOOTHING_S`, because errors of the states' times make single rates too noisy.
    """
    covered_s = time_s[recording.motion.covered(time_s)] if len(time_s) else time_s
    if len(covered_s) < MIN_EQUAL_READINGS:
        return 0.0
    blocks = max(int((covered_s[-1] - covered_s[0]) / SMOOTHING_S), 1)
    rates = recording.motion.rate(covered_s) @ axis
    return float(np.ptp([block.mean() for block in np.array_split(rates, blocks)]))
