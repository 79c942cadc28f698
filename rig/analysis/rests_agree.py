"""Whether a gyroscope's bias, as increments between attitudes tell it, is what it reads at rest."""

import numpy as np

from rig.data.quantity import RATE
from rig.errors import Fault
from rig.estimation.arrays import Array, rotation_vectors
from rig.estimation.earth import EARTH_RATE_RAD_S
from rig.estimation.known_increments import KnownIncrements
from rig.estimation.reference_model import BIAS
from rig.observation.fixes import Turning
from rig.observation.rests import find_rests
from rig.observation.still_attitudes import still_windows
from rig.observation.windows import inside

CONTRADICTING = 3.0  # standard deviations, of three axes
FEWEST_S = 1.0  # of rests in all
STILL_RAD_S = 5e-3  # a body that turns no faster between the first and the last attitude of a rest may lie still
G_SENSITIVITY_RAD_S = 1e-3  # of one g, of a MEMS gyroscope: it lies in one attitude, and moves through many
TAIL = 0.1  # of the rests, at either end, that may be none


def check_rests_agree(turning: Turning, solution: KnownIncrements) -> None:
    """Raises Fault `bias_contradicts_rests` where the bias is not what the gyroscope reads at rest.

    A rest is one by its readings and by the attitudes of the rows in it. Rests may differ by as much as they do, by
    what the reference does not see the body turn, and by what gravity does to a gyroscope.
    """
    at_rest, allowed = _read_at_rest(turning, solution)
    if not len(at_rest):
        return
    means = np.median(at_rest, axis=0)
    wander = np.ptp(np.quantile(at_rest, (TAIL, 1 - TAIL), axis=0), axis=0) / 2
    std = np.sqrt(np.diag(solution.covariance)[BIAS] + wander**2 + allowed**2 + EARTH_RATE_RAD_S**2)
    std = np.hypot(std, G_SENSITIVITY_RAD_S)
    off = np.abs(solution.bias - means) / std
    worst = int(np.argmax(off))
    if off[worst] <= CONTRADICTING:
        return
    raise Fault(
        "bias_contradicts_rests",
        f"at rest the gyroscope reads {means[worst]:+.2g} rad/s on {RATE.axes[worst]}, and the increments between "
        f"attitudes tell a bias of {solution.bias[worst]:+.2g} ± {2 * std[worst]:.1g} rad/s: one of them is wrong",
        "See that both files use one clock and that no readings are missing; turn more slowly, or add rows at rest",
    )


def _read_at_rest(turning: Turning, solution: KnownIncrements) -> tuple[Array, float]:
    """Mean readings (k, 3) of the rests, and how fast the body may turn in them unseen, rad/s; none of too short ones.

    By the clock that the solution has found.
    """
    rows_s = turning.rows_s.mean(axis=1) + solution.clock_s
    lying = still_windows(turning.rows_s + solution.clock_s, turning.attitudes)
    means, lengths_s = [], []
    for rest in find_rests(turning.time_s, {RATE: turning.readings_rad_s}, lying=lying):
        rows = np.flatnonzero((rows_s >= rest.start_s) & (rows_s <= rest.end_s))
        if not len(rows):
            continue
        first, last = turning.attitudes[rows[np.argsort(rows_s[rows])[[0, -1]]]]
        turned = float(np.linalg.norm(rotation_vectors((first.T @ last)[None])))
        length_s = rest.end_s - rest.start_s
        if turned <= STILL_RAD_S * length_s + 3 * np.sqrt(2) * solution.fix_std_rad:
            means.append(turning.readings_rad_s[inside(turning.time_s, rest)].mean(axis=0))
            lengths_s.append(length_s)
    if sum(lengths_s) < FEWEST_S:
        return np.zeros((0, 3)), 0.0
    return np.array(means), float(np.sqrt(2) * solution.fix_std_rad / np.median(lengths_s))
