"""Forward kinematics of the simulated flange, independent of the rig's.

Plain floats, because the sensors need them several hundred times per simulated second. A frame is a rotation matrix,
row by row, from a body's axes to the base's, and the position (m) of the body in the base's axes.
"""

from collections.abc import Iterator, Sequence
from math import acos, cos, pi, sin, sqrt

from rig.world.ur10e.motion.links import NOMINAL, Links

Vector = tuple[float, float, float]
Rotation = tuple[Vector, Vector, Vector]


def flange_rate(q_rad: Sequence[float], qd_rad_s: Sequence[float], links: Links = NOMINAL) -> Vector:
    """Return the flange's angular velocity in its own frame, rad/s, propagated joint by joint."""
    x = y = z = 0.0
    for link, angle, speed in zip(links, q_rad, qd_rad_s, strict=True):
        z += speed
        c, s = cos(angle + link.theta_rad), sin(angle + link.theta_rad)
        x, y = c * x + s * y, c * y - s * x
        c, s = link.cos_alpha, link.sin_alpha
        y, z = c * y + s * z, c * z - s * y
    return x, y, z


def frames(q_rad: Sequence[float], links: Links = NOMINAL) -> Iterator[tuple[Rotation, Vector]]:
    """Yield the frames of the base and then of each link, the flange last."""
    rotation: Rotation = ((1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0))
    position: Vector = (0.0, 0.0, 0.0)
    yield rotation, position
    for link, angle in zip(links, q_rad, strict=True):
        c, s = cos(angle + link.theta_rad), sin(angle + link.theta_rad)
        ca, sa = link.cos_alpha, link.sin_alpha
        x, y, z = position
        offset = rotate(rotation, (link.a_m * c, link.a_m * s, link.d_m))
        position = x + offset[0], y + offset[1], z + offset[2]
        turn = ((c, -s * ca, s * sa), (s, c * ca, -c * sa), (0.0, sa, ca))
        rotation = _product(rotation, turn)
        yield rotation, position


def rotate(rotation: Rotation, vector: Vector) -> Vector:
    """Return the vector multiplied by the matrix `rotation`."""
    x, y, z = vector
    (a, b, c), (d, e, f), (g, h, i) = rotation
    return a * x + b * y + c * z, d * x + e * y + f * z, g * x + h * y + i * z


def _product(a_rotation: Rotation, b_rotation: Rotation) -> Rotation:
    columns = [rotate(a_rotation, column) for column in zip(*b_rotation, strict=True)]
    (a, b, c), (d, e, f), (g, h, i) = columns
    return (a, d, g), (b, e, h), (c, f, i)


def flange_frame(q_rad: Sequence[float], links: Links = NOMINAL) -> tuple[Rotation, Vector]:
    """Return the flange's frame: its rotation to the base's axes, and its position there, m."""
    *_, flange = frames(q_rad, links)
    return flange


def flange_pose(q_rad: Sequence[float], links: Links = NOMINAL) -> tuple[float, ...]:
    """Return the flange's pose in the base frame, as UR writes it: position (m), then rotation vector (rad)."""
    rotation, position = flange_frame(q_rad, links)
    return (*position, *rotation_vector(rotation))


def rotate_pose(pose: Sequence[float], turn: Rotation) -> tuple[float, ...]:
    """Return `pose` (m, rotation vector rad) with its axes rotated by the matrix `turn`; its origin is unchanged."""
    return (*pose[:3], *rotation_vector(_product(rotation_from_vector(pose[3:]), turn)))


def compose_poses(frame: Sequence[float], pose: Sequence[float]) -> tuple[float, ...]:
    """Return `pose` converted from `frame` to the base frame, in which `frame` is given, as UR's `pose_trans` does."""
    rotation = rotation_from_vector(frame[3:])
    position = (
        origin + sum(turn * coordinate for turn, coordinate in zip(row, pose[:3], strict=True))
        for origin, row in zip(frame[:3], rotation, strict=True)
    )
    return (*position, *rotation_vector(_product(rotation, rotation_from_vector(pose[3:]))))


def rotation_vector(r: Sequence[Sequence[float]]) -> Vector:
    """Return the rotation vector, rad, of a rotation matrix."""
    cosine = max(-1.0, min(1.0, (r[0][0] + r[1][1] + r[2][2] - 1.0) / 2.0))
    angle = acos(cosine)
    x, y, z = r[2][1] - r[1][2], r[0][2] - r[2][0], r[1][0] - r[0][1]
    if angle < 1e-9:
        return x / 2.0, y / 2.0, z / 2.0
    if pi - angle < 1e-6:  # half a turn: the antisymmetric part vanishes, the diagonal gives the axis
        axis = [sqrt(max(0.0, (r[i][i] + 1.0) / 2.0)) for i in range(3)]
        largest = axis.index(max(axis))
        signs = [1.0 if i == largest or r[largest][i] >= 0.0 else -1.0 for i in range(3)]
        return angle * signs[0] * axis[0], angle * signs[1] * axis[1], angle * signs[2] * axis[2]
    scale = angle / (2.0 * sin(angle))
    return scale * x, scale * y, scale * z


def rotation_from_vector(vector: Sequence[float]) -> Rotation:
    """Return the rotation matrix of a rotation vector, rad, by Rodrigues' formula."""
    angle = sqrt(sum(component * component for component in vector))
    if angle == 0.0:
        return (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)
    x, y, z = (component / angle for component in vector)
    c, s, v = cos(angle), sin(angle), 1.0 - cos(angle)
    return (
        (c + x * x * v, x * y * v - z * s, x * z * v + y * s),
        (y * x * v + z * s, c + y * y * v, y * z * v - x * s),
        (z * x * v - y * s, z * y * v + x * s, c + z * z * v),
    )
