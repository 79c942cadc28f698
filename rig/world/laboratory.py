"""The simulated laboratory without its sockets: arm, board and sensors on one clock, deterministic."""

from math import radians
from random import Random

from firmware_host.emulator.machine import EmulatedBoard
from firmware_host.emulator.spi_device import Fault, SpiDevice
from rig.config.models import RigConfig
from rig.config.world_models import WorldSection
from rig.world.board.flash_file import flash_of
from rig.world.board.mounting import mount_sensors, power_up
from rig.world.ur10e.forward_kinematics import Vector, flange_rate
from rig.world.ur10e.joint_motion import Motion
from rig.world.ur10e.ripple import ripple
from rig.world.ur10e.robot import Identity, Robot

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
        self._flash = flash_of(world.board.flash_file)
        self.board: EmulatedBoard | None = None  # None: without power
        self._sensors: dict[str, SpiDevice] = {}
        self._faults: dict[str, Fault | None] = dict.fromkeys(world.sensors)
        self.plug_in()

    def plug_in(self) -> None:
        """Give the board power, if it has none."""
        if self.board is None:
            time_s = self.robot.time_s
            self._sensors = mount_sensors(self._config, self._world, self._flange_rate_at, time_s)
            for name, fault in self._faults.items():
                self._sensors[name].fault = fault
            self.board = power_up(self._world, self._flash, self._sensors.values(), time_s)

    def unplug(self) -> None:
        """Take the board's power away; its flash keeps what it holds."""
        self.board = None

    def set_sensor_fault(self, name: str, fault: Fault | None) -> None:
        """Break the sensor called `name` in the configuration, or mend it. It stays so without power too.

        Raises ValueError when there is no such sensor.
        """
        if name not in self._faults:
            raise ValueError(f"no sensor {name!r}; there are {', '.join(self._faults)}")
        self._faults[name] = self._sensors[name].fault = fault

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
