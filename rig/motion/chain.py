"""The geometry of a chain of joints in plain numbers, without NumPy, so that the arm client's process starts fast."""

from dataclasses import dataclass
from math import isfinite

MAX_JOINTS = 8
Pose = tuple[float, ...]  # a controller's pose, (6,): m, rotation vector in rad


@dataclass(frozen=True, slots=True)
class DenavitHartenberg:
    """A chain's Denavit–Hartenberg parameters: zero angle, length, offset and twist of n joints, from the ground on.

    Raise ValueError unless all four have the same number of values, at most `MAX_JOINTS`, and all values are finite.
    """

    theta_rad: tuple[float, ...]
    a_m: tuple[float, ...]
    d_m: tuple[float, ...]
    alpha_rad: tuple[float, ...]

    def __post_init__(self) -> None:
        if len({len(values) for values in (self.theta_rad, self.a_m, self.d_m, self.alpha_rad)}) > 1:
            raise ValueError("a geometry has as many θ as a, d and α")
        if self.joints > MAX_JOINTS:
            raise ValueError(f"a geometry has at most {MAX_JOINTS} joints")
        if not all(map(isfinite, (*self.theta_rad, *self.a_m, *self.d_m, *self.alpha_rad))):
            raise ValueError("a geometry is of finite numbers")

    @property
    def joints(self) -> int:
        """The number of joints."""
        return len(self.theta_rad)
