"""The simulated laboratory without its sockets: what turns, board and sensors on one clock, deterministic."""

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
from rig.world.autopilot.mounting import autopilot_mounts
from rig.world.board.flash_file import flash_of
from rig.world.board.heat import HeatedBody
from rig.world.board.magnetometer_truth import MountedMagnetometer
from rig.world.board.mounting import mount_magnetometers, mount_sensors, power_up
from rig.world.board.sensing_element import ElementFault, MotionAt, SensingElement
from rig.world.board.sensor_truth import SensorTruth
from rig.world.instruments import Place
from rig.world.kvh1775.mounting import mounts
from rig.world.lines.mounting import printer_mounts
from rig.world.magnetic_field import magnetic_field_of
from rig.world.on_arm import OnArm
from rig.world.operator import Operator
from rig.world.servo.bench import ServoBench
from rig.world.turning import Turning
from rig.world.ur10e.motion.flange_motion import Felt
from rig.world.ur10e.robot import Robot


class Laboratory:
    """What the world simulates. `step` makes everything 2 ms older.

    The same inputs at the same ticks give the same states and the same bytes from the board.
    """

    def __init__(self, config: RigConfig, world: WorldSection) -> None:
        self._config, self._world = config, world
        self.turning = _turning(config, world)
        self.body = None if world.thermal is None else HeatedBody(world.thermal)
        self._flash = flash_of(world.board.flash_file)
        self.board: EmulatedBoard | None = None  # None: without power
        self._sensors: dict[str, SpiDevice] = {}
        self._elements: dict[str, SensingElement] = {}  # of the board's sensors that turn with the flange
        self._faults: dict[str, str | None] = dict.fromkeys([*config.on_board, *world.magnetometers])
        self._field = magnetic_field_of(world.site, tuple(world.arm.iron.values()))
        self._mount = np.eye(3)  # from the flange's frame to the item's
        self._laid_in: set[str] = set()  # parts of a series
        self._mounted = WeakSet[SensorTruth | MountedMagnetometer]()  # all on the item, while it is there
        # By the sensor's name; an autopilot, which may have several, by its port.
        self.instruments: Mapping[str, Place] = {
            **mounts(config, world),
            **autopilot_mounts(config, world),
            **printer_mounts(config, world),
        }
        self.plug_in()
        for name in self.instruments:
            self.switch_on(name)

    def switch_on(self, name: str) -> None:
        """Give the instrument of that name power, if it has none. Raises KeyError when there is none."""
        self.instruments[name].switch_on(self._motion_of, self._field_of, self._time_s)

    @property
    def on_arm(self) -> OnArm:
        """The arm that turns the sensors. Raises TypeError where something else does."""
        if not isinstance(self.turning, OnArm):
            raise TypeError("no arm turns the sensors in this laboratory")
        return self.turning

    @property
    def operator(self) -> Operator:
        """Whose hand turns the sensors. Raises TypeError where something else does."""
        if not isinstance(self.turning, Operator):
            raise TypeError("no hand turns the sensors in this laboratory")
        return self.turning

    @property
    def robot(self) -> Robot:
        """The arm's controller. Raises TypeError as `on_arm`."""
        return self.on_arm.robot

    @property
    def _time_s(self) -> float:
        return self.turning.time_s

    def plug_in(self) -> None:
        """Give the board power, if there is one and it has none."""
        if self.board is None and self._config.board is not None:
            time_s = self._time_s
            self._elements = {}
            self._sensors = {
                **mount_sensors(self._config, self._world, self._element_of, time_s, self.body),
                **mount_magnetometers(self._config, self._world, self._field_of),
            }
            for name, fault in self._faults.items():
                self._break(name, fault)
            self.board = power_up(self._world, self._flash, self._sensors.values(), time_s)

    def unplug(self) -> None:
        """Take the board's power away; its flash keeps what it holds."""
        self.board = None

    def fit(self, part: str) -> bool:
        """Lay the board of another part in, without power yet: a chip of its own, with nothing stored.

        Returns whether the operator plugs it in: one that was forgotten is not forgotten twice.
        """
        said = self._world.tray.get(part, SimulatedPartSection())
        unique_id = said.unique_id or sha256(part.encode()).hexdigest()[:24]
        board = self._world.board.model_copy(update={"unique_id": unique_id})
        self._world = self._world.model_copy(update={"board": board})
        self._flash = flash_of(None)
        forgotten = not said.plugged_in and part not in self._laid_in
        self._laid_in.add(part)
        return not forgotten

    def set_sensor_fault(self, name: str, fault: str | None) -> None:
        """Break the sensor called `name` in the configuration, or mend it. It stays so without power too.

        `fault` is a value of `Fault` or of `ElementFault`. Raises ValueError when there is no such sensor or fault.
        """
        if name not in self._faults:
            raise ValueError(f"no sensor {name!r}; there are {', '.join(self._faults)}")
        self._break(name, fault)
        self._faults[name] = fault

    def _break(self, name: str, fault: str | None) -> None:
        inside = ElementFault(fault) if fault in list(ElementFault) and name in self._elements else None
        self._sensors[name].fault = None if fault is None or inside else Fault(fault)
        if name in self._elements:
            self._elements[name].set_fault(inside)

    def mount(self, stage: int) -> None:
        """Mount the item as the simulated operator does for that stage, from 0, or leave it where nothing is said."""
        if stage < len(self._world.mounts):
            self._mount = mount_matrix(self._world.mounts[stage])
            for each in self._mounted:
                each.mount_anew(self._mount)

    def _on_the_item(self, sensor: SensorTruth | MountedMagnetometer) -> None:
        sensor.mount_anew(self._mount)
        self._mounted.add(sensor)

    def step(self) -> None:
        """One tick of everything. Raises BoardError when the firmware broke a rule of the chip."""
        self.turn()
        self.sense()

    def turn(self) -> None:
        """One tick of what turns. While it is `waiting` another may follow before `sense`."""
        self.turning.step()

    def sense(self) -> None:
        """Board and instruments live until the end of the last tick. Raises BoardError as `step`."""
        if self.board is not None:
            # After the arm, so that the sensors can ask for any instant of the tick.
            self.board.advance(self._time_s)
        if self.body is not None:
            self.body.advance(self._time_s, self.heater_duty, powered=self.board is not None)
        for place in self.instruments.values():
            if place.instrument is not None:
                place.instrument.advance(self._time_s)

    @property
    def tick_s(self) -> float:
        """How long a tick lasts, which is 2 ms by an arm's controller."""
        return self.turning.tick_s

    @property
    def heater_duty(self) -> float:
        """Which part of the time the pin of the board's heater is up, 0 to 1."""
        return 0.0 if self.board is None else self.board.heater_duty

    def _element_of(self, name: str, sensor: SensorTruth) -> MotionAt:
        """What a sensor on the board feels, which can be broken."""
        return self._elements.setdefault(name, SensingElement(self._motion_of(sensor)))

    def _motion_of(self, sensor: SensorTruth) -> MotionAt:
        """What a sensor on the flange feels at a virtual time inside the last tick."""
        self._on_the_item(sensor)
        if self.turning.ideal and not sensor.feels_force:
            return lambda time_s: sensor.rate(self.turning.rate_at(time_s))
        last: Felt | None = None
        rows = sensor.rows
        motion: Sequence[float] = ()

        def motion_at(time_s: float) -> Sequence[float]:
            nonlocal last, rows, motion
            felt = self.turning.felt_at(time_s)
            if felt is not last or rows is not sensor.rows:  # an arm that stands gives the same again
                last, rows, motion = felt, sensor.rows, sensor.motion(felt)
            return motion

        return motion_at

    def _field_of(self, sensor: MountedMagnetometer) -> MotionAt:
        """What a magnetometer on the flange feels at such a time."""
        self._on_the_item(sensor)
        return lambda time_s: sensor.feels(self._field, self.turning.frames_at(time_s), time_s)


def _turning(config: RigConfig, world: WorldSection) -> Turning:
    """What turns the sensors."""
    match config.turner:
        case ArmSection():
            return OnArm(config, world)
        case ServoSection() as section:
            return ServoBench(section, world)
        case _:
            return Operator(world)
