"""The simulated servo on its bus: its response to instructions.

Source: ROBOTIS e-Manual: the models' pages, and the included files that are named with each rule. Not simulated:
factory reset, bulk instructions, backup.
"""

from collections.abc import Callable

from rig.world.servo.control_tables import MODELS, ServoMemory, Write, build_control_table, find_write_error
from rig.world.servo.drive import Drive, ServoFaults
from rig.world.servo.shaft import Shaft
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
    ServoPacket,
    encode_status,
)

BAUDS = (9600, 57600, 115200, 1_000_000, 2_000_000, 3_000_000, 4_000_000, 4_500_000)
CLEAR_TURNS = b"\x01\x44\x58\x4c\x22"


class SimulatedServo:
    """One servo, switched on at the virtual time `time_s`. Times are the world's, s."""

    def __init__(self, truth: ServoTruth, time_s: float) -> None:
        self.truth = truth
        self._model = MODELS[truth.model]
        self.memory = ServoMemory(build_control_table(self._model, truth.firmware), truth.settings)
        self.drive = Drive(truth, self._model, self.memory, time_s)
        self._powered = True
        self._registered: list[Write] | None = None
        self._start(time_s)

    # -- true values, for the world only -------------------------------------------------------------------------
    def angle_at(self, time_s: float) -> float:
        """Return the shaft's true angle, rad, ccw positive."""
        return self.shaft.angle_at(time_s)

    def rate_at(self, time_s: float) -> float:
        """Return the shaft's true rate, rad/s."""
        return self.shaft.rate_at(time_s)

    @property
    def shaft(self) -> Shaft:
        """The shaft of the servo's drive."""
        return self.drive.shaft

    @property
    def faults(self) -> ServoFaults:
        """The drive's faults."""
        return self.drive.faults

    @property
    def baud_rate(self) -> float | None:
        """The baud rate of both directions; None without power."""
        return float(BAUDS[self.memory["Baud Rate"]]) if self._powered else None

    def answers_to(self, servo_id: int) -> bool:
        """Return whether the servo executes instructions for the ID `servo_id`."""
        return servo_id in (self.memory["ID"], BROADCAST) or servo_id == self.memory["Secondary ID"] < 253

    # -- life ----------------------------------------------------------------------------------------------------
    def switch_supply(self, on: bool, time_s: float) -> None:
        """Switch the supply on or off."""
        if self._powered and not on:
            self.drive.torque_off(time_s)
        elif on and not self._powered:
            self._start(time_s)
        self._powered = on

    def advance(self, time_s: float) -> None:
        """Simulate until `time_s`, without a new instruction."""
        if self._powered:
            self.drive.advance(time_s)

    def extend_watchdog(self, duration_s: float) -> None:
        """Extend the watchdog's time by `duration_s`, in which this process was suspended and heard no client."""
        self.drive.fed_s += duration_s

    def is_moving(self, time_s: float) -> bool:
        """Return whether a profile is in progress."""
        return self.drive.is_moving(time_s)

    def obey(self, packet: ServoPacket, time_s: float) -> bytes | None:
        """Execute a packet and return the answer; None if the packet is for another servo or needs no answer."""
        if not self._powered or time_s < self._awake_s:
            return None
        if packet.is_valid:
            self.drive.fed_s = time_s  # any instruction feeds the watchdog (bus_watchdog.md)
        if packet.instruction in (SYNC_READ, SYNC_WRITE) and packet.is_valid:
            return self._sync(packet, time_s)
        if not self.answers_to(packet.servo_id) or self.faults.dumb:
            return None
        error, data = self._answer(packet, time_s) if packet.is_valid else (CRC_ERROR, b"")
        level = self.memory["Status Return Level"]
        has_answer = packet.instruction == PING or level == 2 or (level == 1 and packet.instruction == READ)
        if not has_answer or (packet.servo_id == BROADCAST and packet.instruction != PING):
            return None
        return self._status(error, data)

    def return_delay_s(self) -> float:
        """Return the time from an instruction's end to its answer's start, s."""
        return 2e-6 * self.memory["Return Delay Time"]

    # -- instructions --------------------------------------------------------------------------------------------
    def _answer(self, packet: ServoPacket, time_s: float) -> tuple[int, bytes]:
        """Return the error number and the data of the answer."""
        answers: dict[int, Callable[[bytes, float], tuple[int, bytes]]] = {
            PING: self._ping,
            READ: self._read,
            WRITE: self._write,
            REG_WRITE: self._register,
            ACTION: self._act,
            REBOOT: self._reboot,
            CLEAR: self._clear,
        }
        if self.faults.denies and packet.instruction == WRITE:
            return RESULT_FAIL, b""
        if packet.instruction not in answers or (packet.instruction == CLEAR and self.truth.firmware < 42):
            return INSTRUCTION_ERROR, b""
        return answers[packet.instruction](packet.parameters, time_s)

    def _ping(self, data: bytes, time_s: float) -> tuple[int, bytes]:
        return 0, self._model.number.to_bytes(2, "little") + bytes([self.truth.firmware])

    def _read(self, data: bytes, time_s: float) -> tuple[int, bytes]:
        if len(data) != 4:
            return LENGTH_ERROR, b""
        self.drive.measure(time_s)
        data_or_error = self.memory.read(*_parse_address_and_length(data))
        return (data_or_error, b"") if isinstance(data_or_error, int) else (0, data_or_error)

    def _write(self, data: bytes, time_s: float) -> tuple[int, bytes]:
        writes = self.memory.parse(_parse_address_and_length(data)[0], data[2:], self.drive.torque)
        return writes if isinstance(writes, int) else self._apply(writes, time_s), b""

    def _register(self, data: bytes, time_s: float) -> tuple[int, bytes]:
        writes = self.memory.parse(_parse_address_and_length(data)[0], data[2:], self.drive.torque)
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
        self.drive.torque_off(time_s)
        self._start(time_s)
        self._awake_s = time_s + self.truth.boot_s
        return 0, b""

    def _clear(self, data: bytes, time_s: float) -> tuple[int, bytes]:
        if data != CLEAR_TURNS or self.is_moving(time_s):
            return RESULT_FAIL, b""
        self.drive.forget_turns(time_s)
        return 0, b""

    def _sync(self, packet: ServoPacket, time_s: float) -> bytes | None:
        """Return the servo's answer to a sync read, or carry out its part of a sync write."""
        head, rest = packet.parameters[:4], packet.parameters[4:]
        if packet.servo_id != BROADCAST or not rest:
            return None
        servo_id, length = self.memory["ID"], _parse_address_and_length(head)[1]
        if packet.instruction == SYNC_READ:
            if servo_id not in rest or self.memory["Status Return Level"] == 0 or self.faults.dumb:
                return None
            return self._status(*self._read(head, time_s))
        for offset in range(0, len(rest) - length, length + 1):
            if rest[offset] == servo_id:
                self._write(head[:2] + rest[offset + 1 : offset + 1 + length], time_s)
        return None

    def _status(self, error: int, data: bytes) -> bytes:
        alert = ALERT if self.memory["Hardware Error Status"] else 0
        return encode_status(self.memory["ID"], error | alert, data)

    def _apply(self, writes: list[Write], time_s: float) -> int:
        for write in writes:
            if error := find_write_error(self.memory, write, self._model.senses_current, self.truth.firmware):
                return error
        for write in writes:
            self.memory[write.register.name] = write.value
            self._apply_side_effects(write.register.name, write.value, time_s)
        return 0

    def _apply_side_effects(self, name: str, value: int, time_s: float) -> None:
        """Apply the side effects of a write."""
        memory = self.memory
        if name == "Operating Mode":  # operating_mode_xl.md
            memory["Profile Velocity"] = memory["Profile Acceleration"] = 0
            memory["Goal PWM"] = memory["PWM Limit"]
        elif name == "Torque Enable" and value and not self.drive.torque:
            self.drive.torque_on(time_s)
        elif name == "Torque Enable" and not value and self.drive.torque:
            self.drive.torque_off(time_s)
        elif name == "Goal Position":
            self.drive.go(value, time_s)

    # -- states --------------------------------------------------------------------------------------------------
    def _start(self, time_s: float) -> None:
        """Reset the servo to its state after power-up."""
        self.memory.forget()
        self._awake_s, self._registered = time_s, None
        self.drive.start(time_s)
        if "Startup Configuration" in self.memory and self.memory["Startup Configuration"] & 1:
            self.memory["Torque Enable"] = 1
            self._apply_side_effects("Torque Enable", 1, time_s)


def _parse_address_and_length(data: bytes) -> tuple[int, int]:
    """Return the address and the length at the beginning of the parameters."""
    return int.from_bytes(data[:2], "little"), int.from_bytes(data[2:4], "little")
