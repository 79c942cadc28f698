"""The arms that a configuration may name, and the widest ranges of its values over all arms.

The limits of the configured arm are checked when a plan is made (`rig.turners.ur.joint_limits`, `rig.motion.model`).
"""

from typing import Literal

# The arms that can turn the sensors, each a row of `rig/motion/models/`.
ModelName = Literal["ur3e", "ur5e", "ur7e", "ur10e", "ur12e", "ur16e", "ur20", "ur30", "ur10_cb3"]
JOINT_RANGE_DEG = 360.0
SPEED_RANGE_DEG_S = 180.0  # `ur_rtde` accepts no more, whatever an arm can do
ACCELERATION_RANGE_DEG_S2 = 800.0
PAYLOAD_RANGE_KG = 30.0
