"""The arms that the simulated controller can be told to be: what it says of each, and how it is made.

Drawings and speeds: the maker's ROS 2 description (`default_kinematics.yaml`, `joint_limits.yaml` of each model); types
and names: the maker's client library. Few, for what the rig refuses; they turn their joints as a UR10e does.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from math import pi, radians

from rig.config.world_models import SimulatedArmSection
from rig.world.ur10e.links import UR10E, Drawing, drawn
from rig.world.ur10e.trajectory import Joints


@dataclass(frozen=True, slots=True)
class ArmModel:
    """One arm: the controller's number for its type, what its dashboard calls it, its links, what its joints may do.

    A joint's angle may be `limit_rad` to either side, its speed `speed_rad_s`.
    """

    robot_type: int
    name: str
    drawing: Drawing
    limit_rad: Joints
    speed_rad_s: Joints


def _model(robot_type: int, name: str, drawing: Drawing, *speed_deg_s: float) -> ArmModel:
    return ArmModel(robot_type, name, drawing, (2 * pi,) * 6, tuple(radians(speed) for speed in speed_deg_s))


MODELS: Mapping[str, ArmModel] = {
    "ur10e": _model(2, "UR10", UR10E, 120, 120, 180, 180, 180, 180),
    "ur5e": _model(1, "UR5", drawn((-0.425, -0.3922), (0.1625, 0.1333, 0.0997, 0.0996)), 180, 180, 180, 180, 180, 180),
    "ur20": _model(7, "UR20", drawn((-0.862, -0.7287), (0.2363, 0.201, 0.1593, 0.1543)), 120, 120, 150, 210, 210, 210),
    "ur10": _model(  # the CB3 series'
        2, "UR10", drawn((-0.612, -0.5723), (0.1273, 0.163941, 0.1157, 0.0922)), 120, 120, 180, 180, 180, 180
    ),
}


def simulated_model(section: SimulatedArmSection) -> ArmModel:
    """The model of a laboratory's arm, with what its safety settings leave of what its joints can do."""
    model = MODELS[section.model]
    if section.joint_limits_deg is not None:
        model = replace(model, limit_rad=tuple(map(radians, section.joint_limits_deg)))
    if section.joint_speed_limits_deg_s is not None:
        model = replace(model, speed_rad_s=tuple(map(radians, section.joint_speed_limits_deg_s)))
    return model
