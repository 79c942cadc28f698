"""Kinematics of a chain of joints: where the flange, its end, is and how it turns, from joint angles and speeds.

Every function takes arrays whose last axis holds the n joints, the one on the ground first, and broadcasts over the
others. What speaks of shoulder, elbow, forearm is of an arm like the UR10e, of six joints, base to wrist 3.
"""

from dataclasses import dataclass
from functools import lru_cache
from itertools import accumulate
from math import isfinite, pi, prod

import numpy as np
from numpy.typing import ArrayLike

from rig.estimation.arrays import Array

ROUNDING = 1e-15
WRIST_1, WRIST_2, WRIST_3 = 3, 4, 5
WAVES = ("cos", "sin", "cos 2", "sin 2")  # an eccentric or tilted graduation errs once and twice a turn
AXIS_ERRORS = (  # all that can be wrong with the angles between the wrists' axes
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

MAX_JOINTS = 8
Pose = tuple[float, ...]  # a controller's, (6,): m, rotation vector in rad


@dataclass(frozen=True, slots=True)
class DenavitHartenberg:
    """A chain's geometry: of each of n joints, from the ground on, its zero θ, the length a, the offset d, the twist α.

    Raises ValueError unless there are as many of each, `MAX_JOINTS` at most, and all are finite.
    """

    theta_rad: tuple[float, ...]
    a_m: tuple[float, ...]
    d_m: tuple[float, ...]
    alpha_rad: tuple[float, ...]

    def __post_init__(self) -> None:
        if len({len(each) for each in (self.theta_rad, self.a_m, self.d_m, self.alpha_rad)}) > 1:
            raise ValueError("a geometry has as many θ as a, d and α")
        if self.joints > MAX_JOINTS:
            raise ValueError(f"a geometry has at most {MAX_JOINTS} joints")
        if not all(map(isfinite, (*self.theta_rad, *self.a_m, *self.d_m, *self.alpha_rad))):
            raise ValueError("a geometry is of finite numbers")

    @property
    def joints(self) -> int:
        """How many joints it has."""
        return len(self.theta_rad)


NOMINAL = DenavitHartenberg(  # a UR10e's (maker's article 45257), which whatever does not say its arm was recorded with
    theta_rad=(0.0,) * 6,
    a_m=(0.0, -0.6127, -0.57155, 0.0, 0.0, 0.0),
    d_m=(0.1807, 0.0, 0.0, 0.17415, 0.11985, 0.11655),
    alpha_rad=(pi / 2, 0.0, 0.0, pi / 2, -pi / 2, 0.0),
)


def axis_errors(q_rad: ArrayLike, joint: int, arm: DenavitHartenberg = NOMINAL) -> Array:
    """(…, 13, 3) change of the direction of a wrist's axis in the flange's frame, by radian of each of `AXIS_ERRORS`.

    At joint angles `q_rad` (…, n). What turns the whole flange is seen by a sensor as its mounting. The wrists of
    another chain are its last three joints; what it has not is never wrong.
    """
    q = np.asarray(q_rad, dtype=np.float64)
    frames = [frame[..., :3, :3] for frame in _frames(q, arm)]
    wrists = _last_three(arm)
    twists, zeros = [frames[link + 1][..., 0] for link in wrists], [frames[link][..., 2] for link in wrists[1:]]
    turned = np.cross(frames[joint][..., 2], [*twists, *zeros])
    for place, link in enumerate((*wrists, *wrists[1:])):
        if joint > link:  # with what lies beyond the link the joint's axis does not turn
            turned[place] = 0.0
    changes = [*turned[: len(wrists)]]
    for by_zero, link in zip(turned[len(wrists) :], wrists[1:], strict=True):
        changes += [by_zero, *(wave[..., None] * by_zero for wave in angle_waves(q[..., link]))]
    in_flange: Array = np.stack(changes, axis=-2) @ frames[-1]
    return in_flange


def flange_errors(q_rad: ArrayLike, arm: DenavitHartenberg = NOMINAL) -> Array:
    """(3, 6, 3) small turns of the flange, by radian of what is wrong with each wrist, in the base's frame.

    At joint angles `q_rad` (n,): of its twist, its zero, and the waves of its angle as `WAVES` has them. The wrists of
    another chain are its last three joints; what it has not is never wrong.
    """
    q = np.asarray(q_rad, dtype=np.float64)
    frames = np.array(_frames(q, arm))[:, :3, :3]
    found = []
    for link in _last_three(arm):
        if link < 0:
            found.append([np.zeros(3)] * (2 + len(WAVES)))
            continue
        by_zero = frames[link][:, 2]
        found.append([frames[link + 1][:, 0], by_zero, *(wave * by_zero for wave in angle_waves(q[link]))])
    return np.array(found)


def _last_three(arm: DenavitHartenberg) -> tuple[int, int, int]:
    """The last three joints of a chain, by their places; those it has not have places below 0."""
    return arm.joints - 3, arm.joints - 2, arm.joints - 1


def angle_waves(angle_rad: Array | float) -> Array:
    """(4, …) waves of angles, as `WAVES` has them."""
    return np.array([np.cos(angle_rad), np.sin(angle_rad), np.cos(2 * angle_rad), np.sin(2 * angle_rad)])


@lru_cache
def _twists(arm: DenavitHartenberg) -> tuple[Array, Array]:
    """(n,) cosines and sines of the links' twists: those of a quarter turn are 0 and 1, but π/2 is rounded."""
    waves = np.cos(arm.alpha_rad), np.sin(arm.alpha_rad)
    cos, sin = (np.where(np.abs(wave) < ROUNDING, 0.0, wave) for wave in waves)
    return cos, sin


@lru_cache
def _shares(arm: DenavitHartenberg) -> Array:
    """(n, 3, 4, 4) what each link's transform has of its angle's cosine, what of its sine, and what always.

    It turns about z, goes along z and along x, turns about x.
    """
    (cos, sin), shares = _twists(arm), np.zeros((arm.joints, 3, 4, 4))
    shares[:, 0, 0, 0], shares[:, 0, 1, 1], shares[:, 0, 1, 2], shares[:, 0, 0, 3] = 1.0, cos, -sin, arm.a_m
    shares[:, 1, 1, 0], shares[:, 1, 0, 1], shares[:, 1, 0, 2], shares[:, 1, 1, 3] = 1.0, -cos, sin, arm.a_m
    shares[:, 2, 2, 1], shares[:, 2, 2, 2], shares[:, 2, 2, 3], shares[:, 2, 3, 3] = sin, cos, arm.d_m, 1.0
    return shares


def _frames(q_rad: ArrayLike, arm: DenavitHartenberg) -> list[Array]:
    """The n + 1 transforms (…, 4, 4) in the base frame: the base itself, then the frame after each joint."""
    angles = np.moveaxis(np.asarray(q_rad, dtype=np.float64) + arm.theta_rad, -1, 0)
    waves = np.stack([np.cos(angles), np.sin(angles), np.ones(angles.shape)], axis=-1)
    links = waves.reshape(arm.joints, prod(angles.shape[1:]), 3) @ _shares(arm).reshape(arm.joints, 3, 16)
    base = np.broadcast_to(np.eye(4), (*angles.shape[1:], 4, 4))
    return [base, *accumulate(links.reshape(arm.joints, *base.shape), np.matmul)]


def flange_pose(q_rad: ArrayLike, arm: DenavitHartenberg = NOMINAL) -> Array:
    """(…, 4, 4) pose of the flange in the base frame (metres) from joint angles `q_rad` (…, n)."""
    return _frames(q_rad, arm)[-1]


def flange_attitude(q_rad: ArrayLike, arm: DenavitHartenberg = NOMINAL) -> Array:
    """(…, 3, 3) rotations taking a vector of the base frame into the flange's, for joint angles `q_rad` (…, n)."""
    rotations: Array = np.swapaxes(flange_pose(q_rad, arm)[..., :3, :3], -1, -2)
    return rotations


def distance_to_forearm(
    q_rad: ArrayLike, point_m: ArrayLike = (0.0, 0.0, 0.0), arm: DenavitHartenberg = NOMINAL, *, beside_m: float = 0.0
) -> Array:
    """(…,) m from a point of the flange's frame, its centre if none is given, to the line from elbow to wrist 1.

    For joint angles `q_rad` (…, 6) and points (…, 3). Or to a line that lies `beside_m` beside that, on the side of
    wrist 1.
    """
    frames = _frames(q_rad, arm)
    _, elbow, wrist = _bends(frames)
    beside = beside_m * frames[2][..., :3, 2]
    return _distance(_on_flange(frames, point_m), elbow + beside, wrist + beside)


def distance_to_upper_arm(
    q_rad: ArrayLike, point_m: ArrayLike, arm: DenavitHartenberg = NOMINAL, *, beside_m: float
) -> Array:
    """(…,) m from a point of the flange's frame to the middle of the upper arm, shoulder to elbow; as above.

    It lies `beside_m` beside the line that the drawing has for it, on the side of wrist 1.
    """
    frames = _frames(q_rad, arm)
    shoulder, elbow, _ = _bends(frames)
    beside = beside_m * frames[1][..., :3, 2]
    return _distance(_on_flange(frames, point_m), shoulder + beside, elbow + beside)


def lengths_m(arm: DenavitHartenberg) -> Array:
    """(6,) m, named by `LENGTHS`: what can be measured on the arm itself, whatever its parameters make of it."""
    frames = _frames(np.zeros(6), arm)
    base, wrist_2, wrist_3, flange = (frames[joint][:3, 3] for joint in (0, 4, 5, 6))
    shoulder, elbow, wrist_1 = _bends(frames)
    along = [(base, shoulder, 0), (wrist_1, wrist_2, 3), (wrist_2, wrist_3, 4), (wrist_3, flange, 5)]
    height, *offsets = ((end - start) @ frames[joint][:3, 2] for start, end, joint in along)
    return np.array([height, np.linalg.norm(elbow - shoulder), np.linalg.norm(wrist_1 - elbow), *offsets])


def _bends(frames: list[Array]) -> tuple[Array, Array, Array]:
    """Shoulder, elbow and wrist 1, (…, 3) m, each beside the one before it.

    The axes of these three are parallel but for what the factory found, and meet hundreds of metres away: a calibrated
    arm's frames have their origins anywhere along them.
    """
    shoulder = frames[1][..., :3, 3]
    elbow = _beside(shoulder, frames[1][..., :3, 2], frames[2])
    return shoulder, elbow, _beside(elbow, frames[2][..., :3, 2], frames[3])


def _beside(point: Array, axis: Array, frame: Array) -> Array:
    """(…, 3) m where the axis of a frame meets the plane through a point at right angles to its own joint's axis."""
    other = frame[..., :3, 2]
    away = _dot(point - frame[..., :3, 3], axis) / _dot(other, axis)
    beside: Array = frame[..., :3, 3] + away[..., None] * other
    return beside


def _on_flange(frames: list[Array], point_m: ArrayLike) -> Array:
    """(…, 3) m, in the base frame, of points (…, 3) of the flange's frame."""
    points = np.asarray(point_m, dtype=np.float64)
    point: Array = frames[6][..., :3, 3] + np.einsum("...ij,...j->...i", frames[6][..., :3, :3], points)
    return point


def _distance(point: Array, start: Array, end: Array) -> Array:
    """(…,) distances from points to the lines between starts and ends (…, 3)."""
    way = end - start
    along = np.clip(_dot(point - start, way) / _dot(way, way), 0, 1)
    off = point - start - along[..., None] * way
    distances: Array = np.sqrt(_dot(off, off))
    return distances


def _dot(one: Array, other: Array) -> Array:
    """(…,) products of vectors (…, 3)."""
    products: Array = np.einsum("...i,...i->...", one, other)
    return products


def flange_axes(q_rad: ArrayLike, arm: DenavitHartenberg = NOMINAL) -> Array:
    """(…, 3, n) unit axes of the n joints (columns) in the flange frame, for joint angles `q_rad` (…, n).

    A joint's own angle does not move its column, so a sweep of one wrist keeps its axis.
    """
    *before, flange = _frames(q_rad, arm)
    axes_in_base = np.stack([frame[..., :3, 2] for frame in before], axis=-1)
    return np.swapaxes(flange[..., :3, :3], -1, -2) @ axes_in_base


def flange_arm(q_rad: ArrayLike, joint: int, arm: DenavitHartenberg = NOMINAL) -> Array:
    """(…, 3) metres from the axis of a joint to the flange's origin, in the flange's frame: what it swings on.

    From the joint's own origin, at joint angles `q_rad` (…, n); along the axis it means nothing.
    """
    frames = _frames(q_rad, arm)
    to_flange = np.swapaxes(frames[-1][..., :3, :3], -1, -2)
    swung: Array = np.einsum("...ij,...j->...i", to_flange, frames[-1][..., :3, 3] - frames[joint][..., :3, 3])
    return swung


def flange_rate(q_rad: ArrayLike, qd_rad_s: ArrayLike, arm: DenavitHartenberg = NOMINAL) -> Array:
    """(…, 3) angular velocity of the flange in its own frame, rad/s, from joint angles and speeds (…, n).

    Carried from link to link, each seeing it in its own frame: a recording has many states.
    """
    angles = np.moveaxis(np.asarray(q_rad, dtype=np.float64) + arm.theta_rad, -1, 0)
    speeds = np.moveaxis(np.asarray(qd_rad_s, dtype=np.float64), -1, 0)
    x, y, z = np.zeros((3, *angles.shape[1:]))
    for cos, sin, speed, *twist in zip(np.cos(angles), np.sin(angles), speeds, *_twists(arm), strict=True):
        x, y, z = cos * x + sin * y, cos * y - sin * x, z + speed
        y, z = twist[0] * y + twist[1] * z, twist[0] * z - twist[1] * y
    return np.stack([x, y, z], axis=-1)
