"""The arms that the simulated controller can be.

This table is independent of that in `rig/motion/models/`, so that their comparison shows a wrong row
(tests/motion/test_models.py). Nominal geometry, speeds, masses and their centres: the maker's ROS 2 description
(`default_kinematics.yaml`, `joint_limits.yaml`, `physical_parameters.yaml` of each model) and article 45257; types and
names: the maker's client library.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from math import inf, pi, radians
from types import MappingProxyType

from rig.config.ranges import ModelName
from rig.config.world.laboratory import SimulatedArmSection
from rig.world.ur10e.motion.links import UR10E, LinkSizes, build_link_sizes
from rig.world.ur10e.motion.moments import Bodies
from rig.world.ur10e.motion.trajectory import Joints

Version = tuple[int, int, int, int]
POLYSCOPE_5: Version = (5, 14, 0, 0)
CB3: Version = (3, 15, 8, 0)


@dataclass(frozen=True, slots=True)
class ArmModel:
    """One arm model.

    `limit_rad` and `speed_rad_s`: the joints' greatest angles, to either side, and greatest speeds. `home_deg` and
    `polyscope`: initial pose and software version, if the configuration states none. `name`: the model's name at the
    dashboard. `encoder_step_rad`: the encoders' step, for a UR3 of the CB3 series from its logs; the e-Series' step is
    only known to be finer.
    """

    robot_type: int
    name: str
    nominal: LinkSizes
    limit_rad: Joints
    speed_rad_s: Joints
    payload_kg: float
    bodies: Bodies
    home_deg: Joints = (0.0, -90.0, 90.0, -90.0, -90.0, 0.0)
    polyscope: Version = POLYSCOPE_5
    encoder_step_rad: float = 2 * pi / 2**20


def _model(
    robot_type: int, name: str, nominal: LinkSizes, bodies: Bodies, *, payload_kg: float, speed_deg_s: Joints
) -> ArmModel:
    return ArmModel(
        robot_type, name, nominal, (2 * pi,) * 6, tuple(radians(speed) for speed in speed_deg_s), payload_kg, bodies
    )


def _build_bodies(*links: tuple[float, float, float, float]) -> Bodies:
    """Return the bodies of links that are given by mass, kg, and centre of mass, m, in the link's own frame."""
    return Bodies(tuple(mass for mass, *_ in links), tuple((x, y, z) for _, x, y, z in links))


_UR3E = _build_bodies(
    (1.98, 0.0, -0.02, 0.0), (3.4445, 0.13, 0.0, 0.1157), (1.437, 0.05, 0.0, 0.0238),
    (0.871, 0.0, 0.0, 0.01), (0.805, 0.0, 0.0, 0.01), (0.261, 0.0, 0.0, -0.02),
)  # fmt: skip
_UR5E = _build_bodies(
    (3.761, 0.0, -0.02561, 0.00193), (8.058, 0.2125, 0.0, 0.11336), (2.846, 0.15, 0.0, 0.0265),
    (1.37, 0.0, -0.0018, 0.01634), (1.3, 0.0, 0.0018, 0.01634), (0.365, 0.0, 0.0, -0.001159),
)  # fmt: skip
_UR10E = _build_bodies(
    (7.369, 0.021, 0.0, 0.027), (13.051, 0.38, 0.0, 0.158), (3.989, 0.24, 0.0, 0.068),
    (2.1, 0.0, 0.007, 0.018), (1.98, 0.0, 0.007, 0.018), (0.615, 0.0, 0.0, -0.026),
)  # fmt: skip
_UR16E = _build_bodies(
    (7.369, 0.0, -0.016, 0.03), (10.45, 0.302, 0.0, 0.16), (4.321, 0.194, 0.0, 0.065),
    (2.18, 0.0, -0.009, 0.011), (2.033, 0.0, 0.018, 0.012), (0.907, 0.0, 0.0, -0.044),
)  # fmt: skip
_UR20 = _build_bodies(
    (16.343, 0.0, -0.061, 0.0062), (29.632, 0.5226, 0.0, 0.2098), (7.879, 0.3234, 0.0, 0.0604),
    (3.054, 0.0, -0.0026, 0.0393), (3.126, 0.0, 0.0024, 0.0379), (0.926, 0.0, 0.0, -0.0293),
)  # fmt: skip
_UR30 = _build_bodies(
    (16.343, -0.0001, -0.06, 0.0069), (28.542, 0.3894, 0.0, 0.2103), (7.156, 0.2257, 0.0, 0.0629),
    (3.054, 0.0, -0.0048, 0.0353), (3.126, 0.0, 0.0046, 0.0341), (0.926, 0.0, 0.0, -0.0293),
)  # fmt: skip
_UR10 = _build_bodies(
    (7.1, 0.021, 0.0, 0.027), (12.7, 0.38, 0.0, 0.158), (4.27, 0.24, 0.0, 0.068),
    (2.0, 0.0, 0.007, 0.018), (2.0, 0.0, 0.007, 0.018), (0.365, 0.0, 0.0, -0.026),
)  # fmt: skip
_BASE_SLOWER = (120.0, 120.0, 180.0, 180.0, 180.0, 180.0)
_HEAVY = (120.0, 120.0, 150.0, 210.0, 210.0, 210.0)
_SIZES_3E = build_link_sizes((-0.24355, -0.2132), (0.15185, 0.13105, 0.08535, 0.0921))
_SIZES_5E = build_link_sizes((-0.425, -0.3922), (0.1625, 0.1333, 0.0997, 0.0996))
_SIZES_16E = build_link_sizes((-0.4784, -0.36), (0.1807, 0.17415, 0.11985, 0.11655))
_SIZES_20 = build_link_sizes((-0.862, -0.7287), (0.2363, 0.201, 0.1593, 0.1543))
_SIZES_30 = build_link_sizes((-0.637, -0.5037), (0.2363, 0.201, 0.1593, 0.1543))
_SIZES_10 = build_link_sizes((-0.612, -0.5723), (0.1273, 0.163941, 0.1157, 0.0922))

MODELS: Mapping[ModelName, ArmModel] = MappingProxyType(
    {
        "ur3e": replace(
            _model(3, "UR3", _SIZES_3E, _UR3E, payload_kg=3.0, speed_deg_s=(180.0, 180.0, 180.0, 360.0, 360.0, 360.0)),
            limit_rad=(*(2 * pi,) * 5, inf),
            home_deg=(0.0, -90.0, 90.0, -90.0, -60.0, 0.0),
        ),
        "ur5e": _model(1, "UR5", _SIZES_5E, _UR5E, payload_kg=5.0, speed_deg_s=(180.0,) * 6),
        "ur7e": _model(1, "UR5", _SIZES_5E, _UR5E, payload_kg=7.5, speed_deg_s=(180.0,) * 6),
        "ur10e": _model(2, "UR10", UR10E, _UR10E, payload_kg=12.5, speed_deg_s=_BASE_SLOWER),
        "ur12e": _model(2, "UR10", UR10E, _UR10E, payload_kg=12.5, speed_deg_s=_BASE_SLOWER),
        "ur16e": _model(4, "UR16", _SIZES_16E, _UR16E, payload_kg=16.0, speed_deg_s=_BASE_SLOWER),
        "ur20": _model(7, "UR20", _SIZES_20, _UR20, payload_kg=20.0, speed_deg_s=_HEAVY),
        "ur30": _model(8, "UR30", _SIZES_30, _UR30, payload_kg=30.0, speed_deg_s=_HEAVY),
        "ur10_cb3": replace(
            _model(2, "UR10", _SIZES_10, _UR10, payload_kg=10.0, speed_deg_s=_BASE_SLOWER),
            polyscope=CB3,
            encoder_step_rad=2 * pi / 2**19,
        ),
    }
)


def select_model(section: SimulatedArmSection, configured: ModelName) -> ArmModel:
    """Return the arm model of a simulated laboratory, by default `configured`, with the limits that `section` sets."""
    model = MODELS[section.model or configured]
    if section.joint_limits_deg is not None:
        model = replace(model, limit_rad=tuple(map(radians, section.joint_limits_deg)))
    if section.joint_speed_limits_deg_s is not None:
        model = replace(model, speed_rad_s=tuple(map(radians, section.joint_speed_limits_deg_s)))
    if section.polyscope is not None:
        major, minor, bugfix, build = (int(part) for part in section.polyscope.split("."))
        model = replace(model, polyscope=(major, minor, bugfix, build))
    return model
