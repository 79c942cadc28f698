"""Kinematics of a chain of joints: pose and angular rate of its end, the flange, from joint angles and speeds.

Every function takes arrays whose last axis holds the n joints, the one on the ground first, and broadcasts over the
others. Shoulder, elbow and forearm refer to an arm like the UR10e, with six joints from base to wrist 3.
"""

from collections.abc import Sequence
from functools import lru_cache
from itertools import accumulate
from math import pi, prod

import numpy as np
from numpy.typing import ArrayLike

from rig.estimation.arrays import Array
from rig.motion.chain import DenavitHartenberg

ROUNDING_ERROR = 1e-15
WRIST_1, WRIST_2, WRIST_3 = 3, 4, 5
WAVES = ("cos", "sin", "cos 2", "sin 2")  # an eccentric or tilted encoder disc errs once and twice per revolution
AXIS_ERRORS = (  # all errors that change the angles between the wrists' axes
    *(f"twist of wrist_{number}" for number in (1, 2, 3)),
    *(name for wrist in ("wrist_2", "wrist_3") for name in (f"zero of {wrist}", *(f"{w} of {wrist}" for w in WAVES))),
)

LENGTHS = (
    "height of the shoulder",
    "upper arm",
    "forearm",
    "offset of wrist 1",
    "offset of wrist 2",
    "offset of wrist 3",
)

NOMINAL = DenavitHartenberg(  # a UR10e's (maker's article 45257), the arm of recordings that name none
    theta_rad=(0.0,) * 6,
    a_m=(0.0, -0.6127, -0.57155, 0.0, 0.0, 0.0),
    d_m=(0.1807, 0.0, 0.0, 0.17415, 0.11985, 0.11655),
    alpha_rad=(pi / 2, 0.0, 0.0, pi / 2, -pi / 2, 0.0),
)


def axis_errors(q_rad: ArrayLike, joint: int, arm: DenavitHartenberg = NOMINAL) -> Array:
    """Return the change (…, 13, 3) of a wrist axis' direction in the flange's frame, per radian of each axis error.

    The 13 errors are `AXIS_ERRORS`; the joint angles are `q_rad` (…, n). Rotations of the whole flange are left out,
    because they count as part of a sensor's mounting. The last three joints of any chain count as wrists; the change is
    zero for errors of missing joints.
    """
    q = np.asarray(q_rad, dtype=np.float64)
    frames = [frame[..., :3, :3] for frame in _frames(q, arm)]
    wrists = _last_three(arm)
    twist_axes, zero_axes = [frames[link + 1][..., 0] for link in wrists], [frames[link][..., 2] for link in wrists[1:]]
    rotated = np.cross(frames[joint][..., 2], [*twist_axes, *zero_axes])
    for index, link in enumerate((*wrists, *wrists[1:])):
        if joint > link:  # an error beyond the link does not rotate the joint's axis
            rotated[index] = 0.0
    changes = [*rotated[: len(wrists)]]
    for per_zero, link in zip(rotated[len(wrists) :], wrists[1:], strict=True):
        changes += [per_zero, *(wave[..., None] * per_zero for wave in angle_waves(q[..., link]))]
    in_flange: Array = np.stack(changes, axis=-2) @ frames[-1]
    return in_flange


def flange_errors(q_rad: ArrayLike, arm: DenavitHartenberg = NOMINAL) -> Array:
    """Return rotation vectors of the flange in the base's frame, per radian of error: (3 wrists, 6 errors, 3).

    The joint angles are `q_rad` (n,). The six errors of a wrist are its twist, its zero, and the four `WAVES` of its
    angle. The last three joints of any chain count as wrists; the rotation is zero for errors of missing joints.
    """
    q = np.asarray(q_rad, dtype=np.float64)
    frames = np.array(_frames(q, arm))[:, :3, :3]
    rotations = []
    for link in _last_three(arm):
        if link < 0:
            rotations.append([np.zeros(3)] * (2 + len(WAVES)))
            continue
        per_zero = frames[link][:, 2]
        rotations.append([frames[link + 1][:, 0], per_zero, *(wave * per_zero for wave in angle_waves(q[link]))])
    return np.array(rotations)


def _last_three(arm: DenavitHartenberg) -> tuple[int, int, int]:
    """Return the indices of a chain's last three joints; an index is negative if the chain has too few joints."""
    return arm.joints - 3, arm.joints - 2, arm.joints - 1


def angle_waves(angle_rad: Array | float) -> Array:
    """Return cos θ, sin θ, cos 2θ and sin 2θ (4, …) of angles θ (…)."""
    return np.array([np.cos(angle_rad), np.sin(angle_rad), np.cos(2 * angle_rad), np.sin(2 * angle_rad)])


@lru_cache
def _twists(arm: DenavitHartenberg) -> tuple[Array, Array]:
    """Return cosines and sines (n,) of the links' twists, exact for quarter turns."""
    waves = np.cos(arm.alpha_rad), np.sin(arm.alpha_rad)
    cos, sin = (np.where(np.abs(wave) < ROUNDING_ERROR, 0.0, wave) for wave in waves)
    return cos, sin


@lru_cache
def _link_coefficients(arm: DenavitHartenberg) -> Array:
    """Return three matrices of each link (n, 3, 4, 4), which add up to its transform with weights cos θ, sin θ and 1.

    The transform is a rotation about z by the joint's angle θ, translations along z and x, and a rotation about x.
    """
    (cos, sin), terms = _twists(arm), np.zeros((arm.joints, 3, 4, 4))
    terms[:, 0, 0, 0], terms[:, 0, 1, 1], terms[:, 0, 1, 2], terms[:, 0, 0, 3] = 1.0, cos, -sin, arm.a_m
    terms[:, 1, 1, 0], terms[:, 1, 0, 1], terms[:, 1, 0, 2], terms[:, 1, 1, 3] = 1.0, -cos, sin, arm.a_m
    terms[:, 2, 2, 1], terms[:, 2, 2, 2], terms[:, 2, 2, 3], terms[:, 2, 3, 3] = sin, cos, arm.d_m, 1.0
    return terms


def _frames(q_rad: ArrayLike, arm: DenavitHartenberg) -> list[Array]:
    """Return the n + 1 transforms (…, 4, 4) in the base frame: the base itself, then the frame after each joint."""
    angles = np.moveaxis(np.asarray(q_rad, dtype=np.float64) + arm.theta_rad, -1, 0)
    waves = np.stack([np.cos(angles), np.sin(angles), np.ones(angles.shape)], axis=-1)
    links = waves.reshape(arm.joints, prod(angles.shape[1:]), 3) @ _link_coefficients(arm).reshape(arm.joints, 3, 16)
    base = np.broadcast_to(np.eye(4), (*angles.shape[1:], 4, 4))
    return [base, *accumulate(links.reshape(arm.joints, *base.shape), np.matmul)]


def flange_pose(q_rad: ArrayLike, arm: DenavitHartenberg = NOMINAL) -> Array:
    """Return poses (…, 4, 4) of the flange in the base frame (m) for joint angles `q_rad` (…, n)."""
    return _frames(q_rad, arm)[-1]


def flange_attitude(q_rad: ArrayLike, arm: DenavitHartenberg = NOMINAL) -> Array:
    """Return rotations (…, 3, 3) from the base frame to the flange's for joint angles `q_rad` (…, n)."""
    rotations: Array = np.swapaxes(flange_pose(q_rad, arm)[..., :3, :3], -1, -2)
    return rotations


def distance_to_forearm(
    q_rad: ArrayLike, point_m: ArrayLike = (0.0, 0.0, 0.0), arm: DenavitHartenberg = NOMINAL, *, offset_m: float = 0.0
) -> Array:
    """Return distances (…,), m, from a point of the flange's frame to the line from elbow to wrist 1.

    The joint angles are `q_rad` (…, 6), the points (…, 3), by default the flange's centre. `offset_m` shifts the line
    along the elbow's axis.
    """
    frames = _frames(q_rad, arm)
    _, elbow, wrist = _find_bends(frames)
    offset = offset_m * frames[2][..., :3, 2]
    return _distance(_transform_points(frames, point_m), elbow + offset, wrist + offset)


def distance_to_upper_arm(
    q_rad: ArrayLike, point_m: ArrayLike, arm: DenavitHartenberg = NOMINAL, *, offset_m: float
) -> Array:
    """Return distances (…,), m, from a point of the flange's frame to the middle of the upper arm.

    The middle is the nominal line from shoulder to elbow, offset by `offset_m` towards wrist 1.
    """
    frames = _frames(q_rad, arm)
    shoulder, elbow, _ = _find_bends(frames)
    offset = offset_m * frames[1][..., :3, 2]
    return _distance(_transform_points(frames, point_m), shoulder + offset, elbow + offset)


def lengths_m(arm: DenavitHartenberg) -> Array:
    """Return an arm's lengths (6,), m, that `LENGTHS` names, equal for all parameters that describe the same arm."""
    frames = _frames(np.zeros(6), arm)
    base, wrist_2, wrist_3, flange = (frames[joint][:3, 3] for joint in (0, 4, 5, 6))
    shoulder, elbow, wrist_1 = _find_bends(frames)
    offset_axes = [(base, shoulder, 0), (wrist_1, wrist_2, 3), (wrist_2, wrist_3, 4), (wrist_3, flange, 5)]
    height, *offsets = ((end - start) @ frames[joint][:3, 2] for start, end, joint in offset_axes)
    lengths = [height, np.linalg.norm(elbow - shoulder), np.linalg.norm(wrist_1 - elbow), *offsets]
    return np.array(lengths, dtype=np.float64)


def _find_bends(frames: list[Array]) -> tuple[Array, Array, Array]:
    """Return points (…, 3), m, on the axes of shoulder, elbow and wrist 1.

    The axes of these three joints are parallel except for the factory's calibration, so they intersect hundreds of
    metres away, and the origins of a calibrated arm's frames may be anywhere along them. Elbow and wrist 1 are
    therefore the points at which their axes meet a plane through the previous point. This plane is at right angles to
    the previous joint's axis.
    """
    shoulder = frames[1][..., :3, 3]
    elbow = _nearest_origin(shoulder, frames[1][..., :3, 2], frames[2])
    return shoulder, elbow, _nearest_origin(elbow, frames[2][..., :3, 2], frames[3])


def _nearest_origin(point: Array, axis: Array, frame: Array) -> Array:
    """Return the point (…, 3), m, where a frame's z axis meets the plane through `point` perpendicular to `axis`."""
    other = frame[..., :3, 2]
    distance = _dot(point - frame[..., :3, 3], axis) / _dot(other, axis)
    origin: Array = frame[..., :3, 3] + distance[..., None] * other
    return origin


def _transform_points(frames: list[Array], point_m: ArrayLike) -> Array:
    """Return the base-frame coordinates (…, 3), m, of points that `point_m` (…, 3) states in the flange's frame."""
    points = np.asarray(point_m, dtype=np.float64)
    point: Array = frames[6][..., :3, 3] + np.einsum("...ij,...j->...i", frames[6][..., :3, :3], points)
    return point


def _distance(point: Array, start: Array, end: Array) -> Array:
    """Return distances (…,) from points to the segments between starts and ends (…, 3)."""
    segment = end - start
    fraction = np.clip(_dot(point - start, segment) / _dot(segment, segment), 0, 1)
    offset = point - start - fraction[..., None] * segment
    distances: Array = np.sqrt(_dot(offset, offset))
    return distances


def _dot(one: Array, other: Array) -> Array:
    """Return the scalar products (…,) of vectors (…, 3)."""
    products: Array = np.einsum("...i,...i->...", one, other)
    return products


def flange_axes(q_rad: ArrayLike, arm: DenavitHartenberg = NOMINAL) -> Array:
    """Return matrices (…, 3, n) whose columns are the joints' unit axes in the flange's frame, at `q_rad` (…, n).

    A joint's axis does not depend on the joint's own angle, so it is constant in a sweep of this joint.
    """
    *before, flange = _frames(q_rad, arm)
    axes_in_base = np.stack([frame[..., :3, 2] for frame in before], axis=-1)
    return np.swapaxes(flange[..., :3, :3], -1, -2) @ axes_in_base


def flange_arm(q_rad: ArrayLike, joint: int, arm: DenavitHartenberg = NOMINAL) -> Array:
    """Return the lever arm (…, 3), m, from a joint's axis to the flange's origin, in the flange's frame.

    The joint angles are `q_rad` (…, n). The lever arm begins at the origin of the joint's frame, so the part of the
    lever arm along the axis is arbitrary.
    """
    frames = _frames(q_rad, arm)
    to_flange = np.swapaxes(frames[-1][..., :3, :3], -1, -2)
    lever_arm: Array = np.einsum("...ij,...j->...i", to_flange, frames[-1][..., :3, 3] - frames[joint][..., :3, 3])
    return lever_arm


def flange_rate(q_rad: ArrayLike, qd_rad_s: ArrayLike, arm: DenavitHartenberg = NOMINAL) -> Array:
    """Return angular velocities (…, 3) of the flange in its own frame, rad/s, from joint angles and speeds (…, n)."""
    angles, speeds = (np.moveaxis(np.asarray(values, dtype=np.float64), -1, 0) for values in (q_rad, qd_rad_s))
    return flange_rate_by_joint([*angles], [*speeds], arm)


def flange_rate_by_joint(
    angles_rad: Sequence[Array | float], speeds_rad_s: Sequence[Array | float], arm: DenavitHartenberg
) -> Array:
    """Return angular velocities (…, 3) as `flange_rate` does, from arrays or single numbers for each joint.

    The rate is propagated from link to link in the links' own frames, which is fast for many states, and faster for
    joints that stand still.
    """
    x: Array | float
    y: Array | float
    z: Array | float
    x = y = z = 0.0
    joints = zip(angles_rad, arm.theta_rad, speeds_rad_s, *_twists(arm), strict=True)
    for angle, offset, speed, twist_cos, twist_sin in joints:
        cos, sin = np.cos(angle + offset), np.sin(angle + offset)
        x, y, z = cos * x + sin * y, cos * y - sin * x, z + speed
        y, z = twist_cos * y + twist_sin * z, twist_cos * z - twist_sin * y
    return np.stack(np.broadcast_arrays(x, y, z), axis=-1)
