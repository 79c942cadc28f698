"""The simulated laboratory without its sockets: motion, board and sensors on one clock, deterministic."""

from collections.abc import Mapping, Sequence
from hashlib import sha256
from weakref import WeakSet

import numpy as np

from firmware_host.emulator.chip.spi_device import Fault, SpiDevice
from firmware_host.emulator.machine import EmulatedBoard
from rig.config.models import ArmSection, RigConfig
from rig.config.procedures.servo_section import ServoSection
from rig.config.procedures.stage_section import mount_matrix
from rig.config.world.laboratory import SimulatedPartSection, WorldSection
from rig.world.arm_motion_source import ArmMotionSource
from rig.world.autopilot.mounted_autopilots import build_autopilot_mounts
from rig.world.board.flash_file import open_flash
from rig.world.board.heat import HeatedBody
from rig.world.board.magnetometer_truth import MountedMagnetometer
from rig.world.board.mounted_board import mount_magnetometers, mount_sensors, power_up
from rig.world.board.sensing_element import ElementFault, MotionAt, SensingElement
from rig.world.board.sensor_truth import SensorTruth
from rig.world.instruments import InstrumentMount
from rig.world.kvh1775.mounted_instruments import build_kvh_mounts
from rig.world.lines.mounted_printers import build_printer_mounts
from rig.world.magnetic_field import build_magnetic_field
from rig.world.motion_source import MotionSource
from rig.world.operator import SimulatedOperator
from rig.world.servo.servo_bench import ServoBench
from rig.world.ur10e.motion.flange_motion import BodyMotion
from rig.world.ur10e.robot import Robot


class Laboratory:
    """The simulated laboratory, deterministic in its inputs: each `step` simulates 2 ms."""

    def __init__(self, config: RigConfig, world: WorldSection) -> None:
        self._config, self._world = config, world
        self.motion_source = _build_motion_source(config, world)
        self.body = None if world.thermal is None else HeatedBody(world.thermal)
        self._flash = open_flash(world.board.flash_file)
        self.board: EmulatedBoard | None = None  # None: without power
        self._sensors: dict[str, SpiDevice] = {}
        self._elements: dict[str, SensingElement] = {}  # elements of the board's inertial sensors
        self._faults: dict[str, str | None] = dict.fromkeys([*config.on_board, *world.magnetometers])
        self._field = build_magnetic_field(world.site, tuple(world.arm.iron.values()))
        self._mount = np.eye(3)  # rotation from the flange's frame to the item's
        self._fitted_parts: set[str] = set()  # parts of a series that have been mounted
        self._sensors_on_item = WeakSet[SensorTruth | MountedMagnetometer]()
        # By the sensor's name; an autopilot, which may have several sensors, by its port.
        self.instruments: Mapping[str, InstrumentMount] = {
            **build_kvh_mounts(config, world),
            **build_autopilot_mounts(config, world),
            **build_printer_mounts(config, world),
        }
        self.plug_in()
        for name in self.instruments:
            self.switch_on(name)

    def switch_on(self, name: str) -> None:
        """Switch the instrument `name` on, unless it is on. Raise KeyError for an unknown name."""
        self.instruments[name].switch_on(self._build_motion, self._build_field, self._time_s)

    @property
    def has_board(self) -> bool:
        """Whether a board belongs to the simulated laboratory, powered or not."""
        return self._config.board is not None

    @property
    def on_arm(self) -> ArmMotionSource:
        """The arm that turns the sensors. Raise TypeError if something else turns them."""
        if not isinstance(self.motion_source, ArmMotionSource):
            raise TypeError("no arm turns the sensors in this laboratory")
        return self.motion_source

    @property
    def operator(self) -> SimulatedOperator:
        """The operator whose hand turns the sensors. Raise TypeError if something else turns them."""
        if not isinstance(self.motion_source, SimulatedOperator):
            raise TypeError("no hand turns the sensors in this laboratory")
        return self.motion_source

    @property
    def robot(self) -> Robot:
        """The arm's controller. Raise TypeError if no arm turns the sensors."""
        return self.on_arm.robot

    @property
    def _time_s(self) -> float:
        return self.motion_source.time_s

    def plug_in(self) -> None:
        """Power the board, if there is one and it has no power."""
        if self.board is None and self.has_board:
            time_s = self._time_s
            self._elements = {}
            self._sensors = {
                **mount_sensors(self._config, self._world, self._build_element, time_s, self.body),
                **mount_magnetometers(self._config, self._world, self._build_field),
            }
            for name, fault in self._faults.items():
                self._set_fault(name, fault)
            self.board = power_up(self._world, self._flash, self._sensors.values(), time_s)

    def unplug(self) -> None:
        """Cut the board's power; its flash keeps its content."""
        self.board = None

    def fit(self, part: str) -> bool:
        """Exchange the unpowered board for that of another `part`: another chip, which stores nothing yet.

        Return whether the operator also plugs it in. An operator forgets this at most once per part.
        """
        part_section = self._world.tray.get(part, SimulatedPartSection())
        unique_id = part_section.unique_id or sha256(part.encode()).hexdigest()[:24]
        board = self._world.board.model_copy(update={"unique_id": unique_id})
        self._world = self._world.model_copy(update={"board": board})
        self._flash = open_flash(None)
        forgotten = not part_section.plugged_in and part not in self._fitted_parts  # an operator forgets it only once
        self._fitted_parts.add(part)
        return not forgotten

    def set_sensor_fault(self, name: str, fault: str | None) -> None:
        """Set the fault of the sensor `name`, or clear it with None.

        A fault persists without power. `fault` is a value of `Fault` or of `ElementFault`. Raise ValueError for an
        unknown sensor or fault.
        """
        if name not in self._faults:
            raise ValueError(f"no sensor {name!r}; there are {', '.join(self._faults)}")
        self._set_fault(name, fault)
        self._faults[name] = fault

    def _set_fault(self, name: str, fault: str | None) -> None:
        inside = ElementFault(fault) if fault in list(ElementFault) and name in self._elements else None
        self._sensors[name].fault = None if fault is None or inside else Fault(fault)
        if name in self._elements:
            self._elements[name].set_fault(inside)

    def mount(self, stage: int) -> None:
        """Mount the item as configured for the stage, counted from 0; without a configured mounting, do nothing."""
        if stage < len(self._world.mounts):
            self._mount = mount_matrix(self._world.mounts[stage])
            for sensor in self._sensors_on_item:
                sensor.remount(self._mount)

    def _mount_on_item(self, sensor: SensorTruth | MountedMagnetometer) -> None:
        sensor.remount(self._mount)
        self._sensors_on_item.add(sensor)

    def step(self) -> None:
        """Simulate one tick of everything. Raise BoardError if the firmware breaks a rule of the chip."""
        self.turn()
        self.sense()

    def turn(self) -> None:
        """Simulate one tick of the motion. While the source is `waiting`, several ticks may precede one `sense`."""
        self.motion_source.step()

    def sense(self) -> None:
        """Simulate board and instruments until the end of the last tick. Raise BoardError as `step` does."""
        if self.board is not None:
            # After the arm, so that the sensors can ask for any instant of the tick.
            self.board.advance(self._time_s)
        if self.body is not None:
            self.body.advance(self._time_s, self.heater_duty, powered=self.board is not None)
        for mount in self.instruments.values():
            if mount.instrument is not None:
                mount.instrument.advance(self._time_s)

    @property
    def tick_s(self) -> float:
        """The duration of a tick, which is 2 ms on an arm controller's clock."""
        return self.motion_source.tick_s

    @property
    def heater_duty(self) -> float:
        """The duty cycle of the board's heater, 0 to 1."""
        return 0.0 if self.board is None else self.board.heater_duty

    def _build_element(self, name: str, sensor: SensorTruth) -> MotionAt:
        """Return the motion of a sensor on the board as a function of virtual time, which a fault can falsify."""
        return self._elements.setdefault(name, SensingElement(self._build_motion(sensor)))

    def _build_motion(self, sensor: SensorTruth) -> MotionAt:
        """Return the motion of a sensor on the flange as a function of virtual time inside the last tick."""
        self._mount_on_item(sensor)
        if self.motion_source.ideal and not sensor.senses_force:
            return lambda time_s: sensor.rotate_rate(self.motion_source.rate_at(time_s))
        last: BodyMotion | None = None
        rows = sensor.rows
        motion: Sequence[float] = ()

        def motion_at(time_s: float) -> Sequence[float]:
            nonlocal last, rows, motion
            flange = self.motion_source.motion_at(time_s)
            if flange is not last or rows is not sensor.rows:  # an arm at rest returns the same object
                last, rows, motion = flange, sensor.rows, sensor.sense(flange)
            return motion

        return motion_at

    def _build_field(self, sensor: MountedMagnetometer) -> MotionAt:
        """Return the flux density at a magnetometer on the flange, T, as a function of virtual time."""
        self._mount_on_item(sensor)
        return lambda time_s: sensor.sense(self._field, self.motion_source.frames_at(time_s), time_s)


def _build_motion_source(config: RigConfig, world: WorldSection) -> MotionSource:
    """Return the simulation of the configured turner."""
    match config.turner:
        case ArmSection():
            return ArmMotionSource(config, world)
        case ServoSection() as section:
            return ServoBench(section, world)
        case _:
            return SimulatedOperator(world)
