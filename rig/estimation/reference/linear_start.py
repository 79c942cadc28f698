"""The linear initial values of the fit of sweeps and attitudes: Eqs. (4), (5) of the paper TRIAX, with a lever arm.

    F⁻¹ m − A v_ref − L (p + r) − b* = 0,   b* = F⁻¹ b

A maps v_ref, and L the lever arm p + r, to the specific force (`rig.estimation.reference.accelerometer_model`), without
delay. The given L p, with p from the axis to the flange, would make the problem inhomogeneous. So F L p, a few percent
of gravity, is subtracted from the readings, with the F of a first solution without L p.
"""

import numpy as np

from rig.estimation import refusals
from rig.estimation.arrays import Array
from rig.estimation.reference.accelerometer_model import (
    LEVER,
    PARAMETERS,
    Movement,
    find_flange_force,
    project_lever_arm,
    project_reference,
)
from rig.estimation.reference.reference_model import BIAS, REFERENCE, F, matrix
from rig.estimation.reference.stacked import null_vector, to_theta

MAX_CONDITION = 1e4
REMEDY = "Take attitudes turned about at least two axes, or sweep about more axes, both ways"


def linear_start(movement: Movement, norm: float, up: Array) -> Array:
    """Return the initial parameters (22,); the reference in them has this `norm` and a positive product with `up`.

    Raise Fault `rank_deficient`, `ill_conditioned`, `sign_unknown`.
    """
    theta = _linear(movement, movement.readings(), norm, up)
    return _linear(movement, movement.readings() - find_flange_force(0.0, movement) @ matrix(theta).T, norm, up)


def _linear(movement: Movement, readings: Array, norm: float, up: Array) -> Array:
    """Return the parameters (22,) from one linear solution, in which the flange's lever arm p counts as zero.

    The effect of p must therefore be subtracted from the `readings` (K, 3) if it is not negligible.
    """
    x = np.zeros((*readings.shape, LEVER.stop))
    for axis in range(3):
        x[:, axis, 3 * axis : 3 * axis + 3] = readings
        x[:, axis, BIAS.start + axis] = -movement.constant()
    x[..., REFERENCE] = -project_reference(0.0, movement)
    x[..., LEVER] = -project_lever_arm(0.0, movement)
    swept = len(movement.sweeps.speeds_rad_s) > 0
    x = x.reshape(3 * len(readings), -1)[:, : LEVER.stop if swept else LEVER.start]
    sizes = np.repeat([_rms(x[:, block]) for block in (F, REFERENCE, BIAS, LEVER)], [9, 3, 3, 3])[: x.shape[1]]
    noise = np.sqrt(np.diag(movement.noise()).max() / np.mean(readings**2)) * (np.sqrt(len(readings)) + np.sqrt(3))
    parameters = x.shape[1] - 1
    conditioning = refusals.condition_of(x / sizes, parameters, float(noise))
    refusals.check_conditioning(
        conditioning, parameters, MAX_CONDITION, "some of F, bias, reference and lever arm", REMEDY
    )
    theta = to_theta(null_vector(x, sizes, norm, up))
    refusals.check_side(theta[REFERENCE], up)
    return np.concatenate([theta, np.zeros(PARAMETERS - len(theta))])


def _rms(columns: Array) -> float:
    """Return the root mean square of a block of columns, or 1 for an empty block."""
    return float(np.sqrt(np.mean(columns**2))) if columns.size else 1.0
