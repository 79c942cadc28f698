"""The simulated servo: what it does with instructions, with time, and with what goes wrong.

Source: ROBOTIS e-Manual, pages of the models and the includes named beside each rule. Not simulated: velocity, PWM and
current modes (goals of theirs are kept, nothing turns), factory reset, bulk instructions, backup, load on the shaft but
that it falls or is held fast.
"""

from collections.abc import Callable
from dataclasses import dataclass
from math import floor, inf, isclose, pi, radians

import numpy as np

from rig.world.servo.profile import Piece, limited, timed
from rig.world.servo.registers import (
    EXTENDED,
    MODELS,
    POSITION,
    REVERSE,
    TIME_BASED,
    TRIPPED,
    Memory,
    Write,
    control_table,
    refusal,
)
from rig.world.servo.shaft import Shaft, whole_turns
from rig.world.servo.truth import ServoTruth
from rig.world.servo.wire_format import (
    ACTION,
    ALERT,
    BROADCAST,
    CLEAR,
    CRC_ERROR,
    INSTRUCTION_ERROR,
    LENGTH_ERROR,
    PING,
    READ,
    REBOOT,
    REG_WRITE,
    RESULT_FAIL,
    SYNC_READ,
    SYNC_WRITE,
    WRITE,
    Packet,
    encode_status,
)

PULSE_RAD = 2 * pi / 4096
SPEED_RAD_S = 0.229 * 2 * pi / 60  # unit of velocity registers
ACCELERATION_RAD_S2 = 214.577 * 2 * pi / 3600  # … and of Profile Acceleration: rev/min²
FASTEST_RAD_S2 = 200.0  # what "infinite" acceleration comes to
WATCHDOG_S = 0.020
TICKS = 32768
BAUDS = (9600, 57600, 115200, 1_000_000, 2_000_000, 3_000_000, 4_000_000, 4_500_000)
CLEAR_TURNS = b"\x01\x44\x58\x4c\x22"
BY_VOLTAGE, BY_HEAT, BY_LOAD = 0x01, 0x04, 0x20  # bits of Hardware Error Status and of Shutdown


@dataclass(slots=True)
class Faults:
    """What a test can make wrong: the supply, the heat, a shaft held fast, and a servo that answers nothing more."""

    voltage_v: float
    temperature_c: float
    held_fast: bool = False
    dumb: bool = False


class Servo:
    """One servo, switched on at the virtual time `time_s`. Times are the world's, seconds."""

    def __init__(self, truth: ServoTruth, time_s: float) -> None:
        self.truth = truth
        self._model = MODELS[truth.model]
        self.memory = Memory(control_table(self._model, truth.firmware), truth.left)
        self.shaft = Shaft(truth, time_s)
        self.faults = Faults(truth.voltage_v, truth.temperature_c)
        self._random = np.random.default_rng(truth.seed)
        self._powered = True
        self._torque = False
        self._strained_s = inf  # since when the shaft is held fast
        self._registered: list[Write] | None = None
        self._start(time_s)

    # -- what the world may know ---------------------------------------------------------------------------------
    def angle_at(self, time_s: float) -> float:
        """The shaft's true angle, rad, ccw positive."""
        return self.shaft.angle_at(time_s)

    def rate_at(self, time_s: float) -> float:
        """The shaft's true rate, rad/s."""
        return self.shaft.rate_at(time_s)

    @property
    def baud_rate(self) -> float | None:
        """The baud rate of both directions; None without power."""
        return float(BAUDS[self.memory["Baud Rate"]]) if self._powered else None

    def answers_to(self, servo_id: int) -> bool:
        """Whether an instruction for that ID is obeyed here."""
        return servo_id in (self.memory["ID"], BROADCAST) or servo_id == self.memory["Secondary ID"] < 253

    # -- life ----------------------------------------------------------------------------------------------------
    def switch(self, on: bool, time_s: float) -> None:
        """Give it its supply, or take it away."""
        if self._powered and not on:
            self._torque_off(time_s)
        elif on and not self._powered:
            self._start(time_s)
        self._powered = on

    def advance(self, time_s: float) -> None:
        """Live until `time_s`: what comes without being asked for."""
        if not self._powered:
            return
        if self._watched and time_s > self._fed_s + self.memory["Bus Watchdog"] * WATCHDOG_S:
            self._trip(self._fed_s + self.memory["Bus Watchdog"] * WATCHDOG_S)
        if self._torque and self.faults.held_fast and self.moving(time_s):
            self._strained_s = min(self._strained_s, time_s)
            self.shaft.halt(time_s)
        if self._torque and time_s > self._strained_s + self.truth.overload_after_s:
            self._fail(BY_LOAD, time_s)
        if self.faults.temperature_c > self.memory["Temperature Limit"]:
            self._fail(BY_HEAT, time_s)
        low, high = self.memory["Min Voltage Limit"], self.memory["Max Voltage Limit"]
        if not low <= 10 * self.faults.voltage_v <= high:
            self._fail(BY_VOLTAGE, time_s)

    def hear_later(self, by_s: float) -> None:
        """Nobody could be heard for so long: the watchdog has so much more time."""
        self._fed_s += by_s

    def moving(self, time_s: float) -> bool:
        """Whether a profile goes on."""
        return time_s < self.shaft.ends_s()

    def obey(self, packet: Packet, time_s: float) -> bytes | None:
        """What it answers to a packet of the bus, whoever it is for; None: nothing."""
        if not self._powered or time_s < self._awake_s:
            return None
        if packet.whole:
            self._fed_s = time_s  # any instruction feeds the watchdog (bus_watchdog.md)
        if packet.instruction in (SYNC_READ, SYNC_WRITE) and packet.whole:
            return self._sync(packet, time_s)
        if not self.answers_to(packet.servo_id) or self.faults.dumb:
            return None
        error, data = self._answer(packet, time_s) if packet.whole else (CRC_ERROR, b"")
        level = self.memory["Status Return Level"]
        answered = packet.instruction == PING or level == 2 or (level == 1 and packet.instruction == READ)
        if not answered or (packet.servo_id == BROADCAST and packet.instruction != PING):
            return None
        return self._status(error, data)

    def return_delay_s(self) -> float:
        """The time between an instruction's end and its answer's beginning."""
        return 2e-6 * self.memory["Return Delay Time"]

    # -- instructions --------------------------------------------------------------------------------------------
    def _answer(self, packet: Packet, time_s: float) -> tuple[int, bytes]:
        """Error number and data."""
        answers: dict[int, Callable[[bytes, float], tuple[int, bytes]]] = {
            PING: self._ping,
            READ: self._read,
            WRITE: self._write,
            REG_WRITE: self._register,
            ACTION: self._act,
            REBOOT: self._reboot,
            CLEAR: self._clear,
        }
        if packet.instruction not in answers or (packet.instruction == CLEAR and self.truth.firmware < 42):
            return INSTRUCTION_ERROR, b""
        return answers[packet.instruction](packet.parameters, time_s)

    def _ping(self, data: bytes, time_s: float) -> tuple[int, bytes]:
        return 0, self._model.number.to_bytes(2, "little") + bytes([self.truth.firmware])

    def _read(self, data: bytes, time_s: float) -> tuple[int, bytes]:
        if len(data) != 4:
            return LENGTH_ERROR, b""
        self._measure(time_s)
        found = self.memory.read(*_numbers(data))
        return (found, b"") if isinstance(found, int) else (0, found)

    def _write(self, data: bytes, time_s: float) -> tuple[int, bytes]:
        writes = self.memory.parse(_numbers(data)[0], data[2:], self._torque)
        return writes if isinstance(writes, int) else self._apply(writes, time_s), b""

    def _register(self, data: bytes, time_s: float) -> tuple[int, bytes]:
        writes = self.memory.parse(_numbers(data)[0], data[2:], self._torque)
        if isinstance(writes, int):
            return writes, b""
        self._registered, self.memory["Registered Instruction"] = writes, 1
        return 0, b""

    def _act(self, data: bytes, time_s: float) -> tuple[int, bytes]:
        if self._registered is None:
            return INSTRUCTION_ERROR, b""
        writes, self._registered, self.memory["Registered Instruction"] = self._registered, None, 0
        return self._apply(writes, time_s), b""

    def _reboot(self, data: bytes, time_s: float) -> tuple[int, bytes]:
        self._torque_off(time_s)
        self._start(time_s)
        self._awake_s = time_s + self.truth.boot_s
        return 0, b""

    def _clear(self, data: bytes, time_s: float) -> tuple[int, bytes]:
        if data != CLEAR_TURNS or self.moving(time_s):
            return RESULT_FAIL, b""
        self._forget_turns(time_s)
        return 0, b""

    def _sync(self, packet: Packet, time_s: float) -> bytes | None:
        head, rest = packet.parameters[:4], packet.parameters[4:]
        if packet.servo_id != BROADCAST or not rest:
            return None
        own, length = self.memory["ID"], _numbers(head)[1]
        if packet.instruction == SYNC_READ:
            if own not in rest or self.memory["Status Return Level"] == 0 or self.faults.dumb:
                return None
            return self._status(*self._read(head, time_s))
        for at in range(0, len(rest) - length, length + 1):
            if rest[at] == own:
                self._write(head[:2] + rest[at + 1 : at + 1 + length], time_s)
        return None

    def _status(self, error: int, data: bytes) -> bytes:
        alert = ALERT if self.memory["Hardware Error Status"] else 0
        return encode_status(self.memory["ID"], error | alert, data)

    def _apply(self, writes: list[Write], time_s: float) -> int:
        for write in writes:
            if error := refusal(self.memory, write, self._model.senses_current, self.truth.firmware):
                return error
        for write in writes:
            self.memory[write.register.name] = write.value
            self._after(write.register.name, write.value, time_s)
        return 0

    def _after(self, name: str, value: int, time_s: float) -> None:
        """The side effects of a write."""
        memory = self.memory
        if name == "Operating Mode":  # operating_mode_xl.md
            memory["Profile Velocity"] = memory["Profile Acceleration"] = 0
            memory["Goal PWM"] = memory["PWM Limit"]
        elif name == "Torque Enable" and value and not self._torque:
            if memory["Operating Mode"] == POSITION:
                self._forget_turns(time_s)
            self._torque, self._fed_s, self._strained_s = True, time_s, inf
            self.shaft.halt(time_s)
            memory["Goal Position"] = self._pulses(time_s, noisy=False)
        elif name == "Torque Enable" and not value and self._torque:
            self._torque_off(time_s)
        elif name == "Goal Position" and self._torque and memory["Operating Mode"] in (POSITION, EXTENDED):
            self._go(value, time_s)

    def _go(self, goal: int, time_s: float) -> None:
        """Begin the move to a goal; the shaft follows a moment later."""
        memory = self.memory
        start = self.shaft.start_at(time_s + self.truth.lag_s)
        goal_rad = (self._sign * (goal - memory["Homing Offset"]) + 0.5) * PULSE_RAD + self._turns_rad
        most = min(memory["Velocity Limit"] * SPEED_RAD_S, self._model.no_load_rpm * 2 * pi / 60)
        velocity, acceleration = memory["Profile Velocity"], memory["Profile Acceleration"]
        pieces: list[Piece]
        if memory["Drive Mode"] & TIME_BASED and velocity:
            pieces = timed(start, goal_rad, 1e-3 * velocity, 1e-3 * acceleration, most)
        elif memory["Drive Mode"] & TIME_BASED:
            pieces = limited(start, goal_rad, most, FASTEST_RAD_S2)
        else:
            speed = min(velocity * SPEED_RAD_S, most) if velocity else most
            ramp = min(acceleration * ACCELERATION_RAD_S2, FASTEST_RAD_S2) if acceleration else FASTEST_RAD_S2
            pieces = limited(start, goal_rad, speed, ramp)
        self.shaft.follow(start.time_s, pieces)

    # -- registers that show something ---------------------------------------------------------------------------
    def _measure(self, time_s: float) -> None:
        memory, shaft = self.memory, self.shaft
        planned = shaft.start_at(time_s + self.truth.lag_s)
        encoder_s = 0.005  # the rate is the difference of two readings
        rate = (shaft.encoder_at(time_s) - shaft.encoder_at(time_s - encoder_s)) / encoder_s
        moving = self.moving(time_s)
        memory["Realtime Tick"] = floor(1e3 * (time_s - self._began_s) * (1 + 1e-6 * self.truth.tick_ppm)) % TICKS
        memory["Present Position"] = self._pulses(time_s, noisy=True)
        memory["Present Velocity"] = round(self._sign * rate / SPEED_RAD_S)
        memory["Moving"] = int(moving or abs(rate) > memory["Moving Threshold"] * SPEED_RAD_S)
        arrived = not moving and self._torque
        memory["Moving Status"] = (0x32 if moving else 0) | int(arrived)  # trapezoid, in progress; arrived
        memory["Velocity Trajectory"] = round(self._sign * planned.rate_rad_s / SPEED_RAD_S)
        memory["Position Trajectory"] = self._to_pulses(planned.angle_rad)
        effort = 1000 if self._strained_s < inf else 40 * moving
        memory["Present Current" if self._model.senses_current else "Present Load"] = effort * self._torque
        memory["Present Input Voltage"] = round(10 * self.faults.voltage_v)
        memory["Present Temperature"] = round(self.faults.temperature_c)

    def _pulses(self, time_s: float, noisy: bool) -> int:
        noise = self._random.normal(0.0, radians(self.truth.encoder_noise_deg)) if noisy else 0.0
        return self._to_pulses(self.shaft.encoder_at(time_s) + noise)

    def _to_pulses(self, encoder_rad: float) -> int:
        return self._sign * floor((encoder_rad - self._turns_rad) / PULSE_RAD) + self.memory["Homing Offset"]

    @property
    def _sign(self) -> int:
        return -1 if self.memory["Drive Mode"] & REVERSE else 1

    # -- states --------------------------------------------------------------------------------------------------
    def _start(self, time_s: float) -> None:
        """Begin anew, as after power-up."""
        self.memory.forget()
        self._began_s = self._awake_s = self._fed_s = time_s
        self._torque, self._strained_s, self._registered = False, inf, None
        self._forget_turns(time_s)
        if "Startup Configuration" in self.memory and self.memory["Startup Configuration"] & 1:
            self.memory["Torque Enable"] = 1
            self._after("Torque Enable", 1, time_s)

    def _forget_turns(self, time_s: float) -> None:
        self._turns_rad = whole_turns(self.shaft.encoder_at(time_s))

    @property
    def _watched(self) -> bool:
        return "Bus Watchdog" in self.memory and self._torque and 1 <= self.memory["Bus Watchdog"] <= 127

    def _trip(self, time_s: float) -> None:
        """The watchdog stops it abruptly, and its profile is zero from now on (bus_watchdog.md, steps 4, 5)."""
        self.shaft.halt(time_s)
        self.memory["Bus Watchdog"] = TRIPPED
        self.memory["Profile Velocity"] = self.memory["Profile Acceleration"] = 0

    def _torque_off(self, time_s: float) -> None:
        """Let the shaft go: it stands by its gear, or falls for half a turn at most."""
        self._torque = False
        self.memory["Torque Enable"] = 0
        fall = radians(self.truth.fall_deg_s)
        start = self.shaft.start_at(time_s)
        falls = [] if isclose(fall, 0.0) else [Piece(time_s, time_s + pi / abs(fall), start.angle_rad, fall)]
        self.shaft.follow(time_s, falls)

    def _fail(self, bit: int, time_s: float) -> None:
        """Report an error, and shut down if that is what it is set to do (shutdown.md)."""
        self.memory["Hardware Error Status"] |= bit
        if bit & self.memory["Shutdown"] and self._torque:
            self._torque_off(time_s)


def _numbers(data: bytes) -> tuple[int, int]:
    """Address and length, as they begin the parameters."""
    return int.from_bytes(data[:2], "little"), int.from_bytes(data[2:4], "little")
