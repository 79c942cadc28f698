"""The acceleration of the sensors while one joint turns and the others sway, from the encoders of all joints.

A fast sway is removed from the readings as a spectral line. A sway of about one period per turn cannot be separated
from gravity in the readings, so it must be computed from the encoders.
"""

import numpy as np

from rig.estimation.arrays import Array
from rig.motion.geometry import flange_pose
from rig.observation.motion.arm_motion import ArmMotion
from rig.observation.statistics.spectral_lines import harmonics

HALF_WAVES = 8  # per fit: a faster sway is removed as a spectral line
MIN_SINGULAR_RATIO = 1e-9  # waves that are nearly dependent are needed near the ends
MARGIN_FRACTION = 0.05  # of the turn, before and after it: the curvature at the ends of a fit is mostly noise
MIN_POWER_RATIO = 50.0  # of a sway's mean square, per column, to that of the encoders' noise


def sway_acceleration(
    motion: ArmMotion,
    joint: int,
    pose_rad: Array,
    time_s: Array,
    *,
    window_s: tuple[float, float],
    extension_m: Array,
) -> Array:
    """Return the acceleration (n, 3), m/s², in the flange's frame, of a point moved by all joints but `joint`.

    - pose_rad (j,): the angles about which the joints sway; that of `joint` does not matter.
    - time_s (n,): times in the turn, which begins and ends at `window_s`.
    - extension_m (3,): the point in the flange's frame.

    The point's deviation from its position is fitted by waves, whose second derivative is the acceleration. The
    acceleration is zero if encoders show only noise.
    """
    margin_s = MARGIN_FRACTION * (window_s[1] - window_s[0])
    start_s, end_s = window_s[0] - margin_s, window_s[1] + margin_s
    states_s = motion.time_s[(motion.time_s >= start_s) & (motion.time_s <= end_s)]
    angles_rad = motion.angles(states_s)
    steady_rad = np.tile(pose_rad, (len(states_s), 1))
    steady_rad[:, joint] = angles_rad[:, joint]
    swayed_m = _positions_m(motion, angles_rad, extension_m) - _positions_m(motion, steady_rad, extension_m)
    columns = _half_waves((states_s - start_s) / (end_s - start_s))
    coefficients = np.linalg.lstsq(columns, swayed_m, rcond=MIN_SINGULAR_RATIO)[0]
    smooth_m = columns @ coefficients
    noise_m2 = np.sum((swayed_m - smooth_m) ** 2) / (len(columns) - columns.shape[1])
    if np.sum(smooth_m**2) <= MIN_POWER_RATIO * columns.shape[1] * noise_m2:
        return np.zeros((len(time_s), 3))
    orders = np.r_[0, np.repeat(np.arange(1, HALF_WAVES + 1), 2)]
    # The second derivative of a wave of angular frequency ω is the wave times −ω².
    curvatures = -_half_waves((time_s - start_s) / (end_s - start_s)) * (np.pi * orders / (end_s - start_s)) ** 2
    return np.asarray(np.einsum("nij,nj->ni", motion.attitudes(time_s), curvatures @ coefficients), dtype=np.float64)


def _positions_m(motion: ArmMotion, angles_rad: Array, extension_m: Array) -> Array:
    """Return positions (n, 3) in the base's frame of a point on the flange, at joint angles (n, j)."""
    poses = flange_pose(angles_rad, motion.kinematics)
    positions_m: Array = poses[:, :3, 3] + poses[:, :3, :3] @ extension_m
    return positions_m


def _half_waves(fraction: Array) -> Array:
    """Return columns (n, 1 + 2 `HALF_WAVES`) of a constant and half waves, at fractions (n,) of the fitted time."""
    return np.column_stack([np.ones(len(fraction)), harmonics(np.pi * fraction, HALF_WAVES)])
