"""How far values of a configuration may range: as far as any arm's may.

What the arm that is configured can do is judged where a plan is made (`rig.turners.ur.limits`, `rig.motion.model`).
"""

JOINT_RANGE_DEG = 360.0
SPEED_RANGE_DEG_S = 180.0  # `ur_rtde` accepts no more, whatever an arm can do
ACCELERATION_RANGE_DEG_S2 = 800.0
PAYLOAD_RANGE_KG = 30.0
