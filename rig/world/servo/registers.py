"""The control tables of three Dynamixel X servos, and the memory behind them.

Source: ROBOTIS e-Manual, pages of XL430-W250, XM430-W350 and XM430-W210, "Control Table of EEPROM/RAM Area": addresses,
sizes, initial values, ranges. Where the manual gives no range, all values of the size are let through. The XM430-W350's
Velocity Limit is 200 in the manual of the firmware that the rig drives; 350 stood there in that of before 38, which had
an Acceleration Limit too.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

from rig.world.servo.wire_format import ACCESS_ERROR, LENGTH_ERROR, LIMIT_ERROR, RANGE_ERROR

RAM = 64  # registers before it are in the EEPROM
SIZE = 662
MOST_TURNS = 1_048_575  # pulses in extended position mode, ±256 turns


class Register(NamedTuple):
    """One row of a control table. A register of firmware older than `since` is not there."""

    address: int
    size: int
    name: str
    writable: bool = False
    initial: int = 0
    least: int = 0
    greatest: int = 0
    since: int = 0


class Model(NamedTuple):
    """What differs from model to model. Speeds and currents in register units."""

    number: int
    velocity_limit: int
    temperature_limit: int
    voltage_limits: tuple[int, int]
    gains: tuple[int, int, int, int]  # velocity I, velocity P, position D, position P
    senses_current: bool
    no_load_rpm: float  # at 12 V


MODELS: Mapping[str, Model] = {
    "XL430-W250": Model(1060, 265, 72, (60, 140), (1000, 100, 4000, 640), False, 61.0),
    "XM430-W350": Model(1020, 200, 80, (95, 160), (1920, 100, 0, 800), True, 46.0),
    "XM430-W210": Model(1030, 330, 80, (95, 160), (1920, 100, 0, 800), True, 77.0),
}
POSITION, EXTENDED = 3, 4  # of Operating Mode
TIME_BASED, REVERSE = 0x04, 0x01  # bits of Drive Mode
TRIPPED = 255  # Bus Watchdog: −1 in its one byte
MODES = {True: (0, 1, 3, 4, 5, 16), False: (1, 3, 4, 16)}  # with and without a current sensor


def control_table(model: Model, firmware: int) -> tuple[Register, ...]:
    """The rows of a model, in the order of their addresses."""
    low, high = model.voltage_limits
    velocity_i, velocity_p, position_d, position_p = model.gains
    rows = [
        Register(0, 2, "Model Number", initial=model.number),
        Register(2, 4, "Model Information"),
        Register(6, 1, "Firmware Version", initial=firmware),
        Register(7, 1, "ID", True, 1, 0, 252),
        Register(8, 1, "Baud Rate", True, 1, 0, 7),
        Register(9, 1, "Return Delay Time", True, 250, 0, 254),
        Register(10, 1, "Drive Mode", True, 0, 0, 13),
        Register(11, 1, "Operating Mode", True, 3, 0, 16),
        Register(12, 1, "Secondary ID", True, 255, 0, 255),
        Register(13, 1, "Protocol Type", True, 2, 1, 2),
        Register(20, 4, "Homing Offset", True, 0, -1_044_479, 1_044_479),
        Register(24, 4, "Moving Threshold", True, 10, 0, 1023),
        Register(31, 1, "Temperature Limit", True, model.temperature_limit, 0, 100),
        Register(32, 2, "Max Voltage Limit", True, high, low, high),
        Register(34, 2, "Min Voltage Limit", True, low, low, high),
        Register(36, 2, "PWM Limit", True, 885, 0, 885),
        Register(44, 4, "Velocity Limit", True, model.velocity_limit, 0, 1023),
        Register(48, 4, "Max Position Limit", True, 4095, 0, 4095),
        Register(52, 4, "Min Position Limit", True, 0, 0, 4095),
        Register(60, 1, "Startup Configuration", True, 0, 0, 3, since=45),
        Register(63, 1, "Shutdown", True, 52, 0, 255),
        Register(64, 1, "Torque Enable", True, 0, 0, 1),
        Register(65, 1, "LED", True, 0, 0, 1),
        Register(68, 1, "Status Return Level", True, 2, 0, 2),
        Register(69, 1, "Registered Instruction"),
        Register(70, 1, "Hardware Error Status"),
        Register(76, 2, "Velocity I Gain", True, velocity_i, 0, 16383),
        Register(78, 2, "Velocity P Gain", True, velocity_p, 0, 16383),
        Register(80, 2, "Position D Gain", True, position_d, 0, 16383),
        Register(82, 2, "Position I Gain", True, 0, 0, 16383),
        Register(84, 2, "Position P Gain", True, position_p, 0, 16383),
        Register(88, 2, "Feedforward 2nd Gain", True, 0, 0, 16383),
        Register(90, 2, "Feedforward 1st Gain", True, 0, 0, 16383),
        Register(98, 1, "Bus Watchdog", True, 0, 0, 127, since=38),
        Register(100, 2, "Goal PWM", True, 885, -885, 885),
        Register(104, 4, "Goal Velocity", True, 0, -1023, 1023),
        Register(108, 4, "Profile Acceleration", True, 0, 0, 32767),
        Register(112, 4, "Profile Velocity", True, 0, 0, 32767),
        Register(116, 4, "Goal Position", True, 0, -MOST_TURNS, MOST_TURNS),
        Register(120, 2, "Realtime Tick"),
        Register(122, 1, "Moving"),
        Register(123, 1, "Moving Status"),
        Register(124, 2, "Present PWM"),
        Register(126, 2, "Present Current" if model.senses_current else "Present Load"),
        Register(128, 4, "Present Velocity"),
        Register(132, 4, "Present Position"),
        Register(136, 4, "Velocity Trajectory"),
        Register(140, 4, "Position Trajectory"),
        Register(144, 2, "Present Input Voltage"),
        Register(146, 1, "Present Temperature"),
        Register(147, 1, "Backup Ready", since=45),
    ]
    if model.senses_current:
        rows += [
            Register(38, 2, "Current Limit", True, 1193, 0, 1193),
            Register(102, 2, "Goal Current", True, 1193, -1193, 1193),
        ]
    for first, address_at, data_at in ((1, 168, 224), (29, 578, 634)):
        for i in range(28):
            rows.append(Register(address_at + 2 * i, 2, f"Indirect Address {first + i}", True, data_at + i, 64, 661))
            rows.append(Register(data_at + i, 1, f"Indirect Data {first + i}", True, 0, 0, 255))
    return tuple(sorted(row for row in rows if row.since <= firmware))


@dataclass(frozen=True, slots=True)
class Write:
    """A register and what is to be written into it."""

    register: Register
    value: int


class Memory:
    """The bytes of one servo. `left`: EEPROM settings other than the factory's, as its last user left them.

    Indirect data are plain bytes here: they stand for no other register.
    """

    def __init__(self, table: tuple[Register, ...], left: Mapping[str, int]) -> None:
        self._by_name = {register.name: register for register in table}
        self._at = {register.address: register for register in table}
        self._defined = {a for register in table for a in range(register.address, register.address + register.size)}
        self._bytes = bytearray(SIZE)
        for register in table:
            self[register.name] = register.initial
        for name, value in left.items():
            self[name] = value

    def __contains__(self, name: str) -> bool:
        return name in self._by_name

    def __getitem__(self, name: str) -> int:
        register = self._by_name[name]
        data = self._bytes[register.address : register.address + register.size]
        return int.from_bytes(data, "little", signed=register.least < 0)

    def __setitem__(self, name: str, value: int) -> None:
        register = self._by_name[name]
        data = (value % (1 << 8 * register.size)).to_bytes(register.size, "little")
        self._bytes[register.address : register.address + register.size] = data

    def forget(self) -> None:
        """Bring the RAM back to what it is after power-up."""
        for register in self._by_name.values():
            if register.address >= RAM:
                self[register.name] = register.initial

    def read(self, address: int, length: int) -> bytes | int:
        """The bytes, or an error number where a register that is not there is among them."""
        if length == 0 or any(a not in self._defined for a in range(address, address + length)):
            return ACCESS_ERROR
        return bytes(self._bytes[address : address + length])

    def parse(self, address: int, data: bytes, locked: bool) -> list[Write] | int:
        """What a write means, or its error number; `locked`: the EEPROM is, because torque is on."""
        writes = []
        if not data:
            return LENGTH_ERROR
        while data:
            register = self._at.get(address)
            if register is None or not register.writable or (locked and address < RAM):
                return ACCESS_ERROR
            if len(data) < register.size:
                return LENGTH_ERROR
            value = int.from_bytes(data[: register.size], "little", signed=register.least < 0)
            if not register.least <= value <= register.greatest:
                return RANGE_ERROR
            writes.append(Write(register, value))
            address, data = address + register.size, data[register.size :]
        return writes


def refusal(memory: Memory, write: Write, senses_current: bool, firmware: int) -> int:
    """The error of a value that its register could hold, as the servo is set at present; 0: none.

    A goal while the watchdog's error is active is out of range (bus_watchdog.md, step 6); after a shutdown torque comes
    back by a reboot alone (shutdown.md; with which error it is refused, the manual does not say).
    """
    name, value = write.register.name, write.value
    goal = name in ("Goal PWM", "Goal Current", "Goal Velocity", "Goal Position")
    out_of_range = (
        (goal and "Bus Watchdog" in memory and memory["Bus Watchdog"] == TRIPPED)
        or (name == "Operating Mode" and value not in MODES[senses_current])
        or (name == "Drive Mode" and value & TIME_BASED and firmware < 42)
    )
    beyond_limit = (
        (name == "Goal Velocity" and abs(value) > memory["Velocity Limit"])
        or (name == "Goal PWM" and abs(value) > memory["PWM Limit"])
        or (
            name == "Goal Position"
            and memory["Operating Mode"] == POSITION
            and not memory["Min Position Limit"] <= value <= memory["Max Position Limit"]
        )
    )
    shut_down = name == "Torque Enable" and value and memory["Hardware Error Status"] & memory["Shutdown"]
    return RANGE_ERROR if out_of_range else LIMIT_ERROR if beyond_limit else ACCESS_ERROR if shut_down else 0
