"""Whether a gyroscope's bias, as increments between attitudes tell it, is what it reads at rest."""

import numpy as np

from rig.data.quantity import RATE
from rig.errors import Fault
from rig.estimation.earth import EARTH_RATE_RAD_S
from rig.estimation.known_increments import KnownIncrements
from rig.estimation.reference_model import BIAS
from rig.observation.fixes import Turning
from rig.observation.means_at_rest import means_at_rest

CONTRADICTING = 3.0  # standard deviations, of three axes
G_SENSITIVITY_RAD_S = 1e-3  # of one g, of a MEMS gyroscope: it lies in one attitude, and moves through many
TAIL = 0.1  # of the rests, at either end, that may be none


def check_rests_agree(turning: Turning, solution: KnownIncrements) -> None:
    """Raises Fault `bias_contradicts_rests` where the bias is not what the gyroscope reads at rest.

    A rest is one by its readings and by the attitudes of the rows in it. Rests may differ by as much as they do, by
    what the reference does not see the body turn, and by what gravity does to a gyroscope.
    """
    at_rest, allowed = means_at_rest(turning, solution.clock_s, solution.fix_std_rad)
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
