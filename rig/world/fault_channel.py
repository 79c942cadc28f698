"""The control channel: JSON lines by which tests make the world misbehave. The rig never uses it.

A request is `{"do": NAME, …}`; the reply is one line, `{"ok": true, "time_s": …, …}` or `{"ok": false, "error": …}`.

    state                                       everything about arm, board and clock
    hold · run · advance duration_s             the virtual clock; `advance` is answered when the time has passed
    pace time_scale                             how many times as fast as real it may go from now on
    protective_stop · emergency_stop · safeguard_stop · release · power_off · power_on · brake_release
    pause · play · stop_program · speed_slider fraction · remote_control on · robot_mode name
    safety_limit fraction                       a limit that slows the arm
    payload mass_kg · payload_stays on          one that somebody else sets; none is taken that a program sets
    at_program_start then after_s               another request, carried out so long after the start of every program,
                                                as by a fieldbus adapter that is set to stop; null: none
    step_clock seconds · encoder joint error_rad   the controller's clock is set; a joint's reported angle is off by it
    register_in_use name · register_free name   an RTDE input that a fieldbus claims
    registers_in_use first last                 all its integers and doubles from one number to another
    close_arm listen · silence_arm duration_s   the controller's sockets (the silence is in wall time)
    close_dashboard · close_primary             this one of them alone
    sensor_fault sensor fault   absent, other_part (its identity), damaged (a bit now and then), silent (no data-ready),
                                stuck (it feels what it felt) or saturated (far more than its range); null: it is well
    kvh_fault sensor bit_error_rate lose status test silent   what is given holds until something else is:
                                                wire errors, messages lost next, valid bits, BIT's first byte, dead line
    kvh_power sensor on
    autopilot_fault port lost doubled slowest armed deaf camera silent stolen bit_error_rate host_baud   as above
    autopilot_power port on
    printer_fault sensor bit_error_rate lose stuck silent stolen host_baud   of a device that prints lines, as above
    printer_power sensor on
    air temperature_c                           the air around the board, from now on, of a laboratory with `thermal`
    heater                                      which part of the time its pin is up, and how warm the board is
    mount stage                                 the item, as `world.mounts` says of that stage, from 0
    fit part                                    the board of another part of a series, by its serial number
    instruct say face turns again               what the operator reads, where a hand turns the sensors
    servo_power on · servo_torque on            the servo's supply; its torque, as another program's write
    servo_fault held_fast dumb denies voltage_v temperature_c lose spoil   what is given holds; `lose`, `spoil`: replies
    servo_line silent listen                    a line that carries nothing; its port, that closes
    unplug_board · plug_in_board · reset_board · silence_board on · host_baud baud (null: the board's own)
"""

import json
from collections.abc import Callable, Mapping
from dataclasses import fields
from functools import partial
from typing import Any, Protocol

from rig.world.arm_orders import arm_orders, robot_state
from rig.world.board.heat import HeatedBody
from rig.world.board.serial_line import SerialLine
from rig.world.clock import Clock
from rig.world.instruments import Place
from rig.world.laboratory import Laboratory
from rig.world.on_arm import OnArm
from rig.world.servo.bench import ServoBench
from rig.world.servo.drive import Faults
from rig.world.servo.wire_format import WRITE, Packet
from rig.world.ur10e.faults import AtProgramStart

Reply = dict[str, Any]
SHOWN = (
    "Torque Enable",
    "Goal Position",
    "Bus Watchdog",
    "Hardware Error Status",
    "Operating Mode",
    "Profile Velocity",
)
FAULTS = tuple(each.name for each in fields(Faults))
KINDS = ("kvh", "autopilot", "printer")  # of instruments
OF_LINE = {"bit_error_rate", "silent", "host_baud", "stolen"}


class World(Protocol):
    """What can be made to misbehave."""

    laboratory: Laboratory
    line: SerialLine
    clock: Clock

    @property
    def instrument_lines(self) -> Mapping[str, SerialLine]: ...

    def close_arm(self, *, listen: bool) -> None: ...
    def close_arm_port(self, port: int) -> None: ...
    def silence_arm(self, duration_s: float) -> None: ...
    def set_remote_control(self, on: bool) -> None: ...
    def servo_at_fault(self, *, silent: bool = False, listen: bool = True) -> None: ...
    def unplug_board(self) -> None: ...
    def plug_in_board(self) -> None: ...
    def fit_part(self, part: str) -> None: ...


class ControlSession:
    """One client of the control channel."""

    closing = False
    dialogue = False

    def __init__(self, world: World) -> None:
        self._world = world
        self._buffer = bytearray()
        self._reply_at: int | None = None  # the tick at which an `advance` is answered
        self._orders: dict[str, Callable[..., Reply | None]] = {
            **{f"{kind}_fault": partial(self._instrument_fault, kind) for kind in KINDS},
            **{f"{kind}_power": partial(self._instrument_power, kind) for kind in KINDS},
            "mount": lambda stage: world.laboratory.mount(int(stage)),
            "fit": lambda part: world.fit_part(str(part)),
            "air": self._air,
            "heater": self._heater,
            "unplug_board": world.unplug_board,
            "plug_in_board": world.plug_in_board,
            "reset_board": self._reset_board,
            "sensor_fault": self._sensor_fault,
            "silence_board": self._silence_board,
            "host_baud": self._host_baud,
            **self._of_what_turns(),
        }

    def _of_what_turns(self) -> dict[str, Callable[..., Reply | None]]:
        match self._world.laboratory.turning:
            case OnArm():
                return {
                    **self._of_the_clock(),
                    "state": self._state_of_the_arm,
                    "at_program_start": self._at_program_start,
                    **arm_orders(self._world),
                }
            case ServoBench() as bench:  # its driver measures time by the clock on the wall, which nobody holds
                return self._of_servo(self._world, bench)
            case _:
                return {**self._of_the_clock(), **self._of_the_hand()}

    def _of_the_clock(self) -> dict[str, Callable[..., Reply | None]]:
        return {
            "hold": self._hold,
            "run": self._run,
            "advance": self._advance,
            "pace": lambda time_scale: self._world.clock.pace(float(time_scale)),
        }

    def _of_servo(self, world: World, bench: ServoBench) -> dict[str, Callable[..., Reply | None]]:
        """What is asked of a servo."""
        servo, now_s = bench.servo, bench.now_s
        return {
            "state": lambda: {
                "angle_rad": servo.angle_at(now_s()),
                "rate_rad_s": servo.rate_at(now_s()),
                "registers": {name: servo.memory[name] for name in SHOWN},
                "board_powered": world.laboratory.board is not None,
                "board_baud": world.line.baud,
            },
            "servo_power": lambda on: servo.switch(bool(on), now_s()),
            "servo_torque": partial(_servo_torque, bench),
            "servo_fault": partial(_servo_fault, bench),
            "servo_line": world.servo_at_fault,
        }

    def _of_the_hand(self) -> dict[str, Callable[..., Reply | None]]:
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

    def closed(self) -> None:
        pass

    # -- clock -------------------------------------------------------------------------------------------------
    def _hold(self) -> None:
        self._world.clock.hold()

    def _run(self) -> None:
        self._world.clock.run()

    def _advance(self, duration_s: float) -> None:
        self._reply_at = self._world.clock.advance(duration_s)

    def _at_program_start(self, then: Mapping[str, Any] | None, after_s: float = 0.1) -> None:
        faults = self._world.laboratory.robot.faults
        if then is None:
            faults.at_program_start = None
            return
        request = dict(then)
        act = partial(self._orders[request.pop("do")], **request)
        faults.at_program_start = AtProgramStart(act, float(after_s))

    def _state_of_the_arm(self) -> Reply:
        return {
            **robot_state(self._world.laboratory.robot),
            "held": self._world.clock.held,
            "board_powered": self._world.laboratory.board is not None,
            "board_baud": self._world.line.baud,
        }

    # -- heat ----------------------------------------------------------------------------------------------------
    def _body(self) -> HeatedBody:
        if self._world.laboratory.body is None:
            raise ValueError("nothing is heated here: the world has no section thermal")
        return self._world.laboratory.body

    def _air(self, temperature_c: float) -> None:
        self._body().air_c = float(temperature_c)

    def _heater(self) -> Reply:
        return {"duty": self._world.laboratory.heater_duty, "body_c": self._body().temperature_c}

    # -- board -------------------------------------------------------------------------------------------------
    def _reset_board(self) -> None:
        if self._world.laboratory.board is not None:
            self._world.laboratory.board.reset()

    def _sensor_fault(self, sensor: str, fault: str | None) -> None:
        self._world.laboratory.set_sensor_fault(sensor, fault)

    def _instrument_fault(self, kind: str, *, sensor: str = "", port: str = "", **wrong: Any) -> None:
        instrument = self._place(kind, sensor or port).instrument
        if instrument is None:
            raise ValueError(f"the {kind} {sensor or port!r} is switched off")
        line = self._world.instrument_lines[sensor or port]
        for name in wrong.keys() & OF_LINE:
            setattr(line, name, wrong.pop(name))
        instrument.misbehave(**wrong)

    def _instrument_power(self, kind: str, on: bool, *, sensor: str = "", port: str = "") -> None:
        place = self._place(kind, sensor or port)
        self._world.laboratory.switch_on(sensor or port) if on else place.switch_off()

    def _place(self, kind: str, name: str) -> Place:
        places = {each: place for each, place in self._world.laboratory.instruments.items() if place.kind == kind}
        if name not in places:
            raise ValueError(f"no {kind} {name!r}; there are {', '.join(places) or 'none'}")
        return places[name]

    def _silence_board(self, on: bool) -> None:
        """A cable that carries nothing, with its port still there."""
        self._world.line.silent = bool(on)

    def _host_baud(self, baud: float | None) -> None:
        """The host reads and writes at another baud rate than the board: what TCP would not show."""
        self._world.line.host_baud = baud


def _servo_torque(bench: ServoBench, on: bool) -> None:
    """Switch torque on or off as another program does."""
    bench.servo.obey(Packet(bench.servo.memory["ID"], WRITE, bytes([64, 0, bool(on)]), True), bench.now_s())


def _servo_fault(bench: ServoBench, *, lose: int = 0, spoil: int = 0, **given: float) -> None:
    """Make a servo misbehave. Raises ValueError for what it cannot do."""
    for name, value in given.items():
        if name not in FAULTS:
            raise ValueError(f"no fault {name!r}; there are {', '.join(FAULTS)}")
        setattr(bench.servo.faults, name, value)
    bench.bus.lose += int(lose)
    bench.bus.spoil += int(spoil)


def _line(reply: Reply) -> bytes:
    return json.dumps(reply).encode() + b"\n"
