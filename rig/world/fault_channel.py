"""The control channel: JSON lines with which tests make the world misbehave.

A run of the rig uses it for the actions of a simulated operator, and to have the truth written at its end.

A request is `{"do": NAME, …}`; the reply is one line, `{"ok": true, "time_s": …, …}` or `{"ok": false, "error": …}`.

    state                                       the state of arm, board and clock
    hold · run · advance duration_s             the virtual clock; `advance` is answered when the time has passed
    pace time_scale                             limits the clock's speed from now on, in multiples of real time
    protective_stop · emergency_stop · safeguard_stop · release · power_off · power_on · brake_release
    unlock                                      unlocks a protective stop on the pendant, 5 s after it at the earliest
    pause · play · stop_program · speed_slider fraction · remote_control on · robot_mode name
    safety_limit fraction                       a safety limit that slows the arm down
    payload mass_kg · payload_stays on          sets a payload on the pendant; whether programs cannot change it
    at_program_start then after_s               another request, carried out `after_s` after the start of every program,
                                                as by a fieldbus adapter that is set to stop; null: none
    step_clock seconds · encoder joint error_rad   the controller's clock steps; a joint's reported angle has an error
    register_in_use name · register_free name   an RTDE input that a fieldbus claims
    registers_in_use first last                 all integer and double inputs from number `first` to number `last`
    registers_free                              all that a fieldbus has claimed
    close_arm listen · silence_arm duration_s   closes, or silences for a wall time, all sockets of the controller
    close_dashboard · close_primary             closes only this one of the controller's sockets
    sensor_fault sensor fault   absent, other_part (its identity), damaged (occasional bit errors), silent (no
                                data-ready), stuck (constant input) or saturated (far beyond its range); null: no fault
    kvh_fault sensor bit_error_rate lose status test silent   each keeps its value until it is set again:
                                                bit errors, messages to lose, valid bits, BIT's first byte, dead line
    kvh_power sensor on
    autopilot_fault port lost doubled slowest armed deaf camera silent stolen bit_error_rate host_baud
                                                each keeps its value until it is set again
    autopilot_power port on
    printer_fault sensor bit_error_rate lose stuck silent stolen host_baud
                                                faults of a device that prints lines; each keeps its value likewise
    printer_power sensor on
    air temperature_c                           sets the board's air temperature from now on; needs a section `thermal`
    heater                                      reports the duty cycle of the heater's pin and the board's temperature
    mount stage                                 mounts the item as in `world.mounts` for that stage, counted from 0
    fit part                                    fits the board of another part of a series, by its serial number
    instruct say face turns again               gives the operator an instruction, if a hand turns the sensors
    servo_power on · servo_torque on            the servo's supply; its torque, as written by another program
    servo_fault held_fast dumb denies voltage_v temperature_c lose spoil
                                                `lose`, `spoil`: numbers of replies to lose and to corrupt
    servo_line silent listen                    `silent`: the line carries nothing; `listen` false: its port closes
    unplug_board · plug_in_board · reset_board · power_dip · silence_board on · host_baud baud (null: the board's own)
    write_truth windows                         writes the truth over these windows into the world's file
"""

import json
from collections.abc import Callable, Mapping
from dataclasses import fields
from functools import partial
from typing import Any, Protocol

from rig.world.arm_motion_source import ArmMotionSource
from rig.world.arm_orders import build_arm_orders, robot_state
from rig.world.board.heat import HeatedBody
from rig.world.board.serial_line import SerialLine
from rig.world.clock import WorldClock
from rig.world.instruments import InstrumentMount
from rig.world.laboratory import Laboratory
from rig.world.servo.drive import ServoFaults
from rig.world.servo.servo_bench import ServoBench
from rig.world.servo.wire_format import WRITE, ServoPacket
from rig.world.ur10e.faults import AtProgramStart

Reply = dict[str, Any]
REPORTED_REGISTERS = (
    "Torque Enable",
    "Goal Position",
    "Bus Watchdog",
    "Hardware Error Status",
    "Operating Mode",
    "Profile Velocity",
)
FAULTS = tuple(fault.name for fault in fields(ServoFaults))
KINDS = ("kvh", "autopilot", "printer")  # kinds of instruments
LINE_FAULTS = {"bit_error_rate", "silent", "host_baud", "stolen"}


class ControlledWorld(Protocol):
    """The parts of a world that a test can make misbehave."""

    laboratory: Laboratory
    line: SerialLine
    clock: WorldClock

    @property
    def instrument_lines(self) -> Mapping[str, SerialLine]: ...

    def close_arm(self, *, listen: bool) -> None: ...
    def close_arm_port(self, port: int) -> None: ...
    def silence_arm(self, duration_s: float) -> None: ...
    def set_remote_control(self, on: bool) -> None: ...
    def set_servo_line_fault(self, *, silent: bool = False, listen: bool = True) -> None: ...
    def unplug_board(self) -> None: ...
    def plug_in_board(self) -> None: ...
    def fit_part(self, part: str) -> None: ...
    def write_truth(self, windows: Mapping[str, Any]) -> None: ...


class ControlSession:
    """The connection of one client to the control channel."""

    closing = False
    dialogue = False

    def __init__(self, world: ControlledWorld) -> None:
        self._world = world
        self._buffer = bytearray()
        self._reply_at: int | None = None  # the tick at which an `advance` is answered
        self._orders: dict[str, Callable[..., Reply | None]] = {
            **{f"{kind}_fault": partial(self._instrument_fault, kind) for kind in KINDS},
            **{f"{kind}_power": partial(self._instrument_power, kind) for kind in KINDS},
            "mount": lambda stage: world.laboratory.mount(int(stage)),
            "air": self._air,
            "heater": self._heater,
            "write_truth": world.write_truth,
            **(self._board_orders() if world.laboratory.has_board else {}),
            **self._motion_orders(),
        }

    def _board_orders(self) -> dict[str, Callable[..., Reply | None]]:
        return {
            "fit": lambda part: self._world.fit_part(str(part)),
            "unplug_board": self._world.unplug_board,
            "plug_in_board": self._world.plug_in_board,
            "reset_board": self._reset_board,
            "power_dip": self._power_dip,
            "sensor_fault": self._sensor_fault,
            "silence_board": self._silence_board,
            "host_baud": self._host_baud,
        }

    def _motion_orders(self) -> dict[str, Callable[..., Reply | None]]:
        """Return the orders that the simulated turner obeys."""
        match self._world.laboratory.motion_source:
            case ArmMotionSource():
                return {
                    **self._clock_orders(),
                    "state": self._arm_state,
                    "at_program_start": self._set_at_program_start,
                    **build_arm_orders(self._world),
                }
            case ServoBench() as bench:  # its driver measures wall time, so the clock cannot be held
                return self._servo_orders(self._world, bench)
            case _:
                return {**self._clock_orders(), **self._hand_orders()}

    def _clock_orders(self) -> dict[str, Callable[..., Reply | None]]:
        return {
            "hold": self._hold,
            "run": self._run,
            "advance": self._advance,
            "pace": lambda time_scale: self._world.clock.pace(float(time_scale)),
        }

    def _servo_orders(self, world: ControlledWorld, bench: ServoBench) -> dict[str, Callable[..., Reply | None]]:
        """Return the orders for a servo, by name."""
        servo, now_s = bench.servo, bench.now_s
        return {
            "state": lambda: {
                "angle_rad": servo.angle_at(now_s()),
                "rate_rad_s": servo.rate_at(now_s()),
                "registers": {name: servo.memory[name] for name in REPORTED_REGISTERS},
                "board_powered": world.laboratory.board is not None,
                "board_baud": world.line.baud,
            },
            "servo_power": lambda on: servo.switch_supply(bool(on), now_s()),
            "servo_torque": partial(_servo_torque, bench),
            "servo_fault": partial(_servo_fault, bench),
            "servo_line": world.set_servo_line_fault,
        }

    def _hand_orders(self) -> dict[str, Callable[..., Reply | None]]:
        operator = self._world.laboratory.operator
        return {"instruct": operator.instruct, "state": lambda: operator.state}

    def greeting(self) -> bytes:
        return b""

    def receive(self, data: bytes) -> bytes:
        self._buffer += data
        *lines, rest = self._buffer.split(b"\n")
        self._buffer = bytearray(rest)
        return b"".join(self._answer(bytes(line)) for line in lines if line.strip())

    def _answer(self, line: bytes) -> bytes:
        """Carry out one request, a line of JSON, and return the line that answers it."""
        try:
            request = json.loads(line)
            name = request.pop("do")
        except (ValueError, AttributeError, TypeError, KeyError):
            return _line({"ok": False, "error": 'a request is one line of JSON, {"do": NAME, …}'})
        order = self._orders.get(name)
        if order is None:
            return _line({"ok": False, "error": f"unknown request {name!r}", "known": sorted(self._orders)})
        try:
            reply = order(**request)
        except (TypeError, ValueError, AttributeError, ArithmeticError, LookupError) as error:
            return _line({"ok": False, "error": f"{name}: {error}"})
        if self._reply_at is not None:
            return b""
        return _line({"ok": True, "time_s": self._world.clock.time_s, **(reply or {})})

    def tick(self) -> bytes:
        if self._reply_at is None or self._world.clock.tick < self._reply_at:
            return b""
        self._reply_at = None
        return _line({"ok": True, "time_s": self._world.clock.time_s})

    def handle_close(self) -> None:
        pass

    # -- clock -------------------------------------------------------------------------------------------------
    def _hold(self) -> None:
        self._world.clock.hold()

    def _run(self) -> None:
        self._world.clock.run()

    def _advance(self, duration_s: float) -> None:
        self._reply_at = self._world.clock.advance(duration_s)

    def _set_at_program_start(self, then: Mapping[str, Any] | None, after_s: float = 0.1) -> None:
        faults = self._world.laboratory.robot.faults
        if then is None:
            faults.at_program_start = None
            return
        request = dict(then)
        act = partial(self._orders[request.pop("do")], **request)
        faults.at_program_start = AtProgramStart(act, float(after_s))

    def _arm_state(self) -> Reply:
        return {
            **robot_state(self._world.laboratory.robot),
            "held": self._world.clock.is_held,
            "board_powered": self._world.laboratory.board is not None,
            "board_baud": self._world.line.baud,
        }

    # -- heat ----------------------------------------------------------------------------------------------------
    def _body(self) -> HeatedBody:
        if self._world.laboratory.body is None:
            raise ValueError("this board is not heated: the world has no section thermal")
        return self._world.laboratory.body

    def _air(self, temperature_c: float) -> None:
        self._body().air_c = float(temperature_c)

    def _heater(self) -> Reply:
        return {"duty": self._world.laboratory.heater_duty, "body_c": self._body().temperature_c}

    # -- board -------------------------------------------------------------------------------------------------
    def _reset_board(self) -> None:
        if self._world.laboratory.board is not None:
            self._world.laboratory.board.reset()

    def _power_dip(self) -> None:
        """Interrupt the board's power for a moment. Its port stays open, as if its adapter had a supply of its own."""
        self._world.laboratory.unplug()
        self._world.laboratory.plug_in()

    def _sensor_fault(self, sensor: str, fault: str | None) -> None:
        self._world.laboratory.set_sensor_fault(sensor, fault)

    def _instrument_fault(self, kind: str, *, sensor: str = "", port: str = "", **faults: Any) -> None:
        instrument = self._find_mount(kind, sensor or port).instrument
        if instrument is None:
            raise ValueError(f"the {kind} {sensor or port!r} is switched off")
        line = self._world.instrument_lines[sensor or port]
        for name in faults.keys() & LINE_FAULTS:
            setattr(line, name, faults.pop(name))
        instrument.misbehave(**faults)

    def _instrument_power(self, kind: str, on: bool, *, sensor: str = "", port: str = "") -> None:
        mount = self._find_mount(kind, sensor or port)
        self._world.laboratory.switch_on(sensor or port) if on else mount.switch_off()

    def _find_mount(self, kind: str, name: str) -> InstrumentMount:
        mounts = {key: mount for key, mount in self._world.laboratory.instruments.items() if mount.kind == kind}
        if name not in mounts:
            raise ValueError(f"no {kind} {name!r}; there are {', '.join(mounts) or 'none'}")
        return mounts[name]

    def _silence_board(self, on: bool) -> None:
        """Make the board's cable carry nothing, while its port remains open."""
        self._world.line.silent = bool(on)

    def _host_baud(self, baud: float | None) -> None:
        """Set a baud rate of the host's end that differs from the board's, because TCP transmits none."""
        self._world.line.host_baud = baud


def _servo_torque(bench: ServoBench, on: bool) -> None:
    """Switch the servo's torque on or off, as another program on the bus would."""
    bench.servo.obey(ServoPacket(bench.servo.memory["ID"], WRITE, bytes([64, 0, bool(on)]), True), bench.now_s())


def _servo_fault(bench: ServoBench, *, lose: int = 0, spoil: int = 0, **faults: float) -> None:
    """Make a servo misbehave. Raise ValueError for an unknown fault."""
    for name, value in faults.items():
        if name not in FAULTS:
            raise ValueError(f"no fault {name!r}; there are {', '.join(FAULTS)}")
        setattr(bench.servo.faults, name, value)
    bench.bus.lose += int(lose)
    bench.bus.spoil += int(spoil)


def _line(reply: Reply) -> bytes:
    return json.dumps(reply).encode() + b"\n"
