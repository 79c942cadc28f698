"""What a plan holds that may be done and is hardly meant. Pure: said before the operator agrees, never refused."""

import math

from rig.motion.steps import Plan, Transfer

# °/s. What is slower may be a speed in rad/s: no joint of the arm turns by more of these.
SLOW_DEG_S = math.pi


def doubts(plan: Plan) -> list[str]:
    """Speeds below `SLOW_DEG_S`, a sentence for each key of the configuration that says one."""
    transfers = [step for step in plan.steps if isinstance(step, Transfer)]  # of which the first is made at leisure
    found = {
        "procedure.speed_deg_s": min((sweep.speed_rad_s for sweep in plan.sweeps), default=math.inf),
        "arm.transfer_speed_deg_s": max((transfer.speed_rad_s for transfer in transfers), default=math.inf),
    }
    return [
        f"{key} is {math.degrees(speed):.4g}, which is slow: is {math.degrees(speed):.4g} rad/s meant? "
        f"That is {math.degrees(math.degrees(speed)):.0f} °/s."
        for key, speed in found.items()
        if math.degrees(speed) < SLOW_DEG_S
    ]
