"""Sets of attitudes: angles of wrists 1, 2, 3 in degrees, while base, shoulder and elbow are at their home angles.

The attitudes are possible on every known arm except a UR3e, whose forearm is too short. Wrist 2 remains at -90°, where
the flange keeps its distance from the forearm, and wrists 1 and 3 reach every attitude.
`rig.estimation.design.attitude_design` computes their efficiency.
"""

from collections.abc import Mapping
from types import MappingProxyType

WristAngles = tuple[float, float, float]

# D-optimal on the grid of 45°, for attitudes known to 1 mrad: an exchange search finds no eighteen that are better by a
# thousandth (tests/estimation/test_attitude_design.py).
OPTIMAL_ATTITUDES: tuple[WristAngles, ...] = (
    *((-180, -90, wrist_3) for wrist_3 in (-135, -90, -45, 90, 135)),
    *((-135, -90, 45), (-90, -90, -135)),
    *((-45, -90, wrist_3) for wrist_3 in (-45, 45, 135)),
    *((0, -90, wrist_3) for wrist_3 in (-180, -135, 0)),
    *((45, -90, wrist_3) for wrist_3 in (-90, 90)),
    *((90, -90, 45), (135, -90, -180), (135, -90, 0)),
)
# The same, and eight with wrist 2 turned away from the forearm. If wrist 2 has only one angle, the field of the arm's
# iron along wrist 1's axis looks like a part of the room's field, and that along the flange's axis like a bias.
MAGNETIC_ATTITUDES: tuple[WristAngles, ...] = (
    *OPTIMAL_ATTITUDES,
    *((wrist_1, -45, wrist_3) for wrist_1, wrist_3 in zip((-180, -90, 0, 90), (0, 90, -180, -90), strict=True)),
    *((wrist_1, -45, wrist_3) for wrist_1, wrist_3 in zip((-135, -45, 45, 135), (-90, 0, 90, 180), strict=True)),
)
# Each side of the flange up twice, with opposite headings: best for a table whose attitudes are exact.
FACE_ATTITUDES: tuple[WristAngles, ...] = (
    *((wrist_1, -90, wrist_3) for wrist_1 in (-180, 0) for wrist_3 in (-180, -90, 0, 90)),
    *((wrist_1, -90, wrist_3) for wrist_1 in (-90, 90) for wrist_3 in (-90, 90)),
)
ATTITUDE_SETS: Mapping[str, tuple[WristAngles, ...]] = MappingProxyType(
    {"eighteen": OPTIMAL_ATTITUDES, "faces": FACE_ATTITUDES, "magnetic": MAGNETIC_ATTITUDES}
)
