"""An arm's links: nominal, according to its controller, and in truth.

Denavit–Hartenberg parameters, in the names of UR's calibration file (delta_theta, delta_a, delta_d, delta_alpha).
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import cos, pi, sin

ZERO6 = (0.0,) * 6


@dataclass(frozen=True, slots=True)
class ArmLink:
    """A link: rotation by joint angle plus `theta_rad` about z, offsets d on z and a on x, rotation alpha about x."""

    theta_rad: float
    a_m: float
    d_m: float
    alpha_rad: float
    cos_alpha: float
    sin_alpha: float


Links = tuple[ArmLink, ...]

LinkSizes = tuple[tuple[float, float, int], ...]  # for each link: length a, offset d (m), twist alpha in quarter turns


def build_link_sizes(a_m: tuple[float, float], d_m: tuple[float, float, float, float]) -> LinkSizes:
    """Return the nominal parameters of a UR arm's links from a2 a3 and d1 d4 d5 d6; all UR arms share the twists."""
    (a2, a3), (d1, d4, d5, d6) = a_m, d_m
    return ((0.0, d1, 1), (a2, 0.0, 0), (a3, 0.0, 0), (0.0, d4, 1), (0.0, d5, -1), (0.0, d6, 0))


UR10E = build_link_sizes((-0.6127, -0.57155), (0.1807, 0.17415, 0.11985, 0.11655))  # maker's article 45257


def links(
    theta_rad: Sequence[float] = ZERO6,
    a_m: Sequence[float] = ZERO6,
    d_m: Sequence[float] = ZERO6,
    alpha_rad: Sequence[float] = ZERO6,
    nominal: LinkSizes = UR10E,
) -> Links:
    """Return links that deviate from the nominal ones by the given values (6,), one for each joint."""
    return tuple(
        _link(theta, a + da, d + dd, quarters, twist)
        for (a, d, quarters), theta, da, dd, twist in zip(nominal, theta_rad, a_m, d_m, alpha_rad, strict=True)
    )


def _link(theta_rad: float, a_m: float, d_m: float, quarters: int, twist_rad: float) -> ArmLink:
    c, s = cos(twist_rad), sin(twist_rad)
    cosine, sine = {-1: (s, -c), 0: (c, s), 1: (-s, c)}[quarters]
    return ArmLink(theta_rad, a_m, d_m, quarters * pi / 2 + twist_rad, cosine, sine)


LINKS = ("base", "shoulder", "upper_arm", "forearm", "wrist_1", "wrist_2", "wrist_3")
NOMINAL = links()
