"""Whether a sensor's axes lean as far as its data sheet says: what leans farther may be the arm's."""

import numpy as np

from rig.analysis.suspicion import Statistic
from rig.estimation.vector_model import VectorSolution


def leaning_deg(solution: VectorSolution, stated_deg: float, rate: float) -> Statistic:
    """The angle between two axes that is farthest off 90° for what is stated, and its limit, in degrees.

    `stated_deg` is a half-width; beside it stands what of the angle is not known, so that chance is beyond the limit in
    a share `rate` of recordings at most. Sweeps about three axes do not tell a wrist whose zero is off from a sensor's
    axis that leans: no residual shows it, and the scale factors of a sensor that is mounted askew are off by it.
    """
    from scipy.special import ndtri

    off_deg = np.degrees(np.abs(solution.non_orthogonality_rad))
    std_deg = np.degrees(np.sqrt(np.diag(solution.angles_covariance_rad2)[:3]))
    limits_deg = stated_deg + std_deg * float(ndtri(1 - rate / 6))
    worst = int(np.argmax(off_deg - limits_deg))
    return float(off_deg[worst]), float(limits_deg[worst])
