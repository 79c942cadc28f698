"""Warnings of plans that are possible but probably unintended, shown before the operator agrees. Pure functions."""

import math

from rig.motion.steps import Plan, Transfer

SUSPICIOUS_SPEED_DEG_S = math.pi  # a lower number may be rad/s: no joint of the arm is faster than this in rad/s


def doubts(plan: Plan) -> list[str]:
    """Return a sentence for each key of the configuration with a speed below `SUSPICIOUS_SPEED_DEG_S`."""
    transfers = [step for step in plan.steps if isinstance(step, Transfer)]  # the first one is slow on purpose
    speeds_rad_s = {
        "procedure.speed_deg_s": min((sweep.speed_rad_s for sweep in plan.sweeps), default=math.inf),
        "arm.transfer_speed_deg_s": max((transfer.speed_rad_s for transfer in transfers), default=math.inf),
    }
    return [
        f"{key} is {math.degrees(speed):.4g}, which is slow: is {math.degrees(speed):.4g} rad/s meant? "
        f"That is {math.degrees(math.degrees(speed)):.0f} °/s."
        for key, speed in speeds_rad_s.items()
        if math.degrees(speed) < SUSPICIOUS_SPEED_DEG_S
    ]
