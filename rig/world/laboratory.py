"""The simulated laboratory without its sockets: arm, board and sensors on one clock, deterministic."""

from math import radians
from random import Random

from rig.config.models import RigConfig
from rig.config.world_models import WorldSection
from rig.world.motion import Motion
from rig.world.ripple import ripple
from rig.world.robot import Identity, Robot

JOINTS = 6


class Laboratory:
    """What the world simulates. `step` makes everything 2 ms older; the same inputs at the same ticks give the same bytes."""

    def __init__(self, config: RigConfig, world: WorldSection) -> None:
        arm = world.arm
        random = Random(world.seed)
        ripples = [ripple(arm.vibration_fraction, arm.vibration_cycles_per_turn, random) for _ in range(JOINTS)]
        major, minor, bugfix, build = (int(part) for part in arm.polyscope.split("."))
        self.robot = Robot(
            Identity(arm.serial_number, (major, minor, bugfix, build)),
            Motion([radians(angle) for angle in config.arm.home_deg], ripples, arm.encoder_step_rad),
            arm.remote_control,
            arm.speed_slider,
        )

    def step(self) -> None:
        self.robot.step()
