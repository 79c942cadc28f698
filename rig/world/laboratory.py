"""The simulated laboratory without its sockets: arm, board and sensors on one clock, deterministic."""

from math import radians
from random import Random

from firmware_host.emulator.machine import EmulatedBoard
from rig.config.models import RigConfig
from rig.config.world_models import WorldSection
from rig.world.board import power_up
from rig.world.kinematics import Vector, flange_rate
from rig.world.motion import Motion
from rig.world.ripple import ripple
from rig.world.robot import Identity, Robot

JOINTS = 6
STILL: Vector = (0.0, 0.0, 0.0)


class Laboratory:
    """What the world simulates. `step` makes everything 2 ms older.

    The same inputs at the same ticks give the same states and the same bytes from the board.
    """

    def __init__(self, config: RigConfig, world: WorldSection) -> None:
        self._config, self._world = config, world
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
        self.board: EmulatedBoard | None = None  # None: without power
        self.plug_in()

    def plug_in(self) -> None:
        """Give the board power, if it has none."""
        if self.board is None:
            self.board = power_up(self._config, self._world, self._flange_rate_at, self.robot.time_s)

    def unplug(self) -> None:
        """Take the board's power away."""
        self.board = None

    def step(self) -> None:
        """One tick of everything. Raises BoardError when the firmware broke a rule of the chip."""
        self.robot.step()
        if self.board is not None:
            # After the arm, so that the sensors can ask for any instant of the tick.
            self.board.advance(self.robot.time_s)

    def _flange_rate_at(self, time_s: float) -> Vector:
        """Angular rate of the flange in its own frame at a virtual time inside the last tick, rad/s."""
        motion = self.robot.motion
        return STILL if motion.still else flange_rate(*motion.at(time_s))
