"""What a UR10e can do (maker's data sheet and ROS 2 description): the one table that configuration and plan obey."""

import math

JOINT_LIMIT_RAD = 2 * math.pi
JOINT_LIMIT_DEG = 360.0
SPEED_LIMIT_DEG_S = 180.0  # the maker's, of the elbow and the wrists
# Base to wrist 3, as a plan is held against them: `ur_rtde` accepts no more than 3.14 rad/s, a little below 180°/s.
SPEED_LIMIT_RAD_S = (math.radians(120), math.radians(120), 3.14, 3.14, 3.14, 3.14)
ACCELERATION_LIMIT_DEG_S2 = 800.0
ACCELERATION_LIMIT_RAD_S2 = math.radians(ACCELERATION_LIMIT_DEG_S2)
PAYLOAD_LIMIT_KG = 12.5
