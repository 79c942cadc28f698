"""The errors of readings in known attitudes as variance components, one of them correlated by attitude.

    v_m = F (s + φ s²) + b + E_m (ε_m + R_mᵀ γ(R_m)) + η_m + noise

v_m is the mean reading in placement m, s the reference in the sensor's frame, F the matrix, φ the quadratic term and b
the bias. E_m is the derivative of v_m by small rotations of the placement. ε, independent in each placement, and η are
the errors of `rig.estimation.external.placement`. γ is a smooth function of the attitude R: a Gaussian process over the
angle between attitudes with Matérn's correlation (ν = 3/2). A robot with wrong joint zeros or a wrong tool frame has
such errors, and so has a box that is out of square. γ may look like a bias or like other scale factors, so more
placements reduce the effect of γ less than that of ε.
"""

import numpy as np

from rig.estimation.arrays import Array
from rig.estimation.external.attitude_drift import correlate_effects, matern
from rig.estimation.reference.attitude_error import AttitudeReadings, effects
from rig.estimation.reference.reference_model import REFERENCE, free_directions, jacobian, predicted
from rig.estimation.statistics.variance_components import Mixed, MixedModel

CORRELATION_RAD = 1.5  # of γ: errors of joints are sines of their angles
ERROR_MEDIAN_RAD = 3e-3  # of the prior of ε and γ
MAX_CORRELATED = 200  # more placements are taken for independent and not searched for a change: it would take too long
ERROR_MEDIAN_RATIO = 1e-3  # of η to the reference (a milli-g)


def build_placement_model(theta: Array, placed: AttitudeReadings, stated: int) -> MixedModel:
    """Return the model of N placements, linear in the free directions of `theta` (p,).

    The components are the errors ε, γ and η of the module. Only the first `stated` placements have a measured attitude
    and therefore an error γ.
    """
    attitudes, count = placed.attitudes, len(placed.readings)
    free, alone = free_directions(theta, norm_known=placed.norm_known), np.eye(count)
    is_stated = (np.arange(count) < stated)[:, None, None]
    tilts = effects(theta, attitudes, placed.v_bar)
    measured = np.where(is_stated, tilts, 0.0)
    cosine = (np.einsum("nij,mij->nm", attitudes, attitudes) - 1) / 2
    alike = matern(np.arccos(np.clip(cosine, -1, 1)), CORRELATION_RAD)
    size = float(np.linalg.norm(theta[REFERENCE]))
    return MixedModel(
        Mixed(
            observed=(placed.readings - predicted(theta, attitudes, placed.v_bar)).ravel(),
            design=(jacobian(theta, attitudes, placed.v_bar) @ free).reshape(3 * count, -1),
            fixed=np.diag(placed.variances.ravel())
            + correlate_effects(tilts * placed.attitude_std_rad[:, None, None], alone),
            components=np.array(
                [
                    correlate_effects(measured, alone),  # ε
                    correlate_effects(measured @ np.swapaxes(attitudes, -1, -2), alike),  # γ, in table coordinates
                    np.eye(3 * count),  # η
                ]
            ),
            precision=np.zeros(free.shape[1]),
            scales=np.array([ERROR_MEDIAN_RAD, ERROR_MEDIAN_RAD, ERROR_MEDIAN_RATIO * size]),
            alone=np.zeros((3, 2)),
        )
    )
