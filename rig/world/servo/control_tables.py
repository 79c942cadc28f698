"""The control tables of three Dynamixel X servos, and the memory behind them.

Source: ROBOTIS e-Manual, pages of XL430-W250, XM430-W350 and XM430-W210, "Control Table of EEPROM/RAM Area": addresses,
sizes, initial values, ranges. Where the manual gives no range, all values of the size are accepted. The XM430-W350's
Velocity Limit is 200 in the manual of the firmware that the rig drives; manuals of firmware before 38 have 350, and an
Acceleration Limit too.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import NamedTuple

from rig.world.servo.wire_format import ACCESS_ERROR, LENGTH_ERROR, LIMIT_ERROR, RANGE_ERROR

RAM_START = 64  # first address of the RAM_START; registers below are in the EEPROM
TABLE_SIZE = 662
MAX_PULSES = 1_048_575  # in extended position mode, ±256 turns


class RegisterRow(NamedTuple):
    """A row of a control table. Firmware older than `since` does not have the register."""

    address: int
    size: int
    name: str
    writable: bool = False
    initial: int = 0
    least: int = 0
    greatest: int = 0
    since: int = 0


class Model(NamedTuple):
    """The properties of a servo model. Speeds and currents are in register units."""

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
POSITION, EXTENDED = 3, 4  # values of Operating Mode
TIME_BASED, REVERSE = 0x04, 0x01  # bits of Drive Mode
WATCHDOG_TRIPPED = 255  # Bus Watchdog: −1 in its one byte
MODES = {True: (0, 1, 3, 4, 5, 16), False: (1, 3, 4, 16)}  # values of Operating Mode with and without a current sensor


def build_control_table(model: Model, firmware: int) -> tuple[RegisterRow, ...]:
    """Return a model's rows in the order of their addresses."""
    low, high = model.voltage_limits
    velocity_i, velocity_p, position_d, position_p = model.gains
    rows = [
        RegisterRow(0, 2, "Model Number", initial=model.number),
        RegisterRow(2, 4, "Model Information"),
        RegisterRow(6, 1, "Firmware Version", initial=firmware),
        RegisterRow(7, 1, "ID", True, 1, 0, 252),
        RegisterRow(8, 1, "Baud Rate", True, 1, 0, 7),
        RegisterRow(9, 1, "Return Delay Time", True, 250, 0, 254),
        RegisterRow(10, 1, "Drive Mode", True, 0, 0, 13),
        RegisterRow(11, 1, "Operating Mode", True, 3, 0, 16),
        RegisterRow(12, 1, "Secondary ID", True, 255, 0, 255),
        RegisterRow(13, 1, "Protocol Type", True, 2, 1, 2),
        RegisterRow(20, 4, "Homing Offset", True, 0, -1_044_479, 1_044_479),
        RegisterRow(24, 4, "Moving Threshold", True, 10, 0, 1023),
        RegisterRow(31, 1, "Temperature Limit", True, model.temperature_limit, 0, 100),
        RegisterRow(32, 2, "Max Voltage Limit", True, high, low, high),
        RegisterRow(34, 2, "Min Voltage Limit", True, low, low, high),
        RegisterRow(36, 2, "PWM Limit", True, 885, 0, 885),
        RegisterRow(44, 4, "Velocity Limit", True, model.velocity_limit, 0, 1023),
        RegisterRow(48, 4, "Max Position Limit", True, 4095, 0, 4095),
        RegisterRow(52, 4, "Min Position Limit", True, 0, 0, 4095),
        RegisterRow(60, 1, "Startup Configuration", True, 0, 0, 3, since=45),
        RegisterRow(63, 1, "Shutdown", True, 52, 0, 255),
        RegisterRow(64, 1, "Torque Enable", True, 0, 0, 1),
        RegisterRow(65, 1, "LED", True, 0, 0, 1),
        RegisterRow(68, 1, "Status Return Level", True, 2, 0, 2),
        RegisterRow(69, 1, "Registered Instruction"),
        RegisterRow(70, 1, "Hardware Error Status"),
        RegisterRow(76, 2, "Velocity I Gain", True, velocity_i, 0, 16383),
        RegisterRow(78, 2, "Velocity P Gain", True, velocity_p, 0, 16383),
        RegisterRow(80, 2, "Position D Gain", True, position_d, 0, 16383),
        RegisterRow(82, 2, "Position I Gain", True, 0, 0, 16383),
        RegisterRow(84, 2, "Position P Gain", True, position_p, 0, 16383),
        RegisterRow(88, 2, "Feedforward 2nd Gain", True, 0, 0, 16383),
        RegisterRow(90, 2, "Feedforward 1st Gain", True, 0, 0, 16383),
        RegisterRow(98, 1, "Bus Watchdog", True, 0, 0, 127, since=38),
        RegisterRow(100, 2, "Goal PWM", True, 885, -885, 885),
        RegisterRow(104, 4, "Goal Velocity", True, 0, -1023, 1023),
        RegisterRow(108, 4, "Profile Acceleration", True, 0, 0, 32767),
        RegisterRow(112, 4, "Profile Velocity", True, 0, 0, 32767),
        RegisterRow(116, 4, "Goal Position", True, 0, -MAX_PULSES, MAX_PULSES),
        RegisterRow(120, 2, "Realtime Tick"),
        RegisterRow(122, 1, "Moving"),
        RegisterRow(123, 1, "Moving Status"),
        RegisterRow(124, 2, "Present PWM"),
        RegisterRow(126, 2, "Present Current" if model.senses_current else "Present Load"),
        RegisterRow(128, 4, "Present Velocity"),
        RegisterRow(132, 4, "Present Position"),
        RegisterRow(136, 4, "Velocity Trajectory"),
        RegisterRow(140, 4, "Position Trajectory"),
        RegisterRow(144, 2, "Present Input Voltage"),
        RegisterRow(146, 1, "Present Temperature"),
        RegisterRow(147, 1, "Backup Ready", since=45),
    ]
    if model.senses_current:
        rows += [
            RegisterRow(38, 2, "Current Limit", True, 1193, 0, 1193),
            RegisterRow(102, 2, "Goal Current", True, 1193, -1193, 1193),
        ]
    for first, address_at, data_at in ((1, 168, 224), (29, 578, 634)):
        for i in range(28):
            rows.append(RegisterRow(address_at + 2 * i, 2, f"Indirect Address {first + i}", True, data_at + i, 64, 661))
            rows.append(RegisterRow(data_at + i, 1, f"Indirect Data {first + i}", True, 0, 0, 255))
    return tuple(sorted(row for row in rows if row.since <= firmware))


@dataclass(frozen=True, slots=True)
class Write:
    """A register and the value to write into it."""

    register: RegisterRow
    value: int


class ServoMemory:
    """The bytes of one servo. `settings`: EEPROM values other than the factory's, as its last user stored them.

    Indirect data are plain bytes here: they do not map to other registers.
    """

    def __init__(self, table: tuple[RegisterRow, ...], settings: Mapping[str, int]) -> None:
        self._by_name = {register.name: register for register in table}
        self._by_address = {register.address: register for register in table}
        self._defined = {a for register in table for a in range(register.address, register.address + register.size)}
        self._bytes = bytearray(TABLE_SIZE)
        for register in table:
            self[register.name] = register.initial
        for name, value in settings.items():
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
        """Reset the RAM to its state after power-up."""
        for register in self._by_name.values():
            if register.address >= RAM_START:
                self[register.name] = register.initial

    def read(self, address: int, length: int) -> bytes | int:
        """Return the bytes, or an error number if a byte belongs to no register."""
        if length == 0 or any(a not in self._defined for a in range(address, address + length)):
            return ACCESS_ERROR
        return bytes(self._bytes[address : address + length])

    def parse(self, address: int, data: bytes, locked: bool) -> list[Write] | int:
        """Return the register writes in `data`, or an error number. With torque on, the EEPROM is `locked`."""
        writes = []
        if not data:
            return LENGTH_ERROR
        while data:
            register = self._by_address.get(address)
            if register is None or not register.writable or (locked and address < RAM_START):
                return ACCESS_ERROR
            if len(data) < register.size:
                return LENGTH_ERROR
            value = int.from_bytes(data[: register.size], "little", signed=register.least < 0)
            if not register.least <= value <= register.greatest:
                return RANGE_ERROR
            writes.append(Write(register, value))
            address, data = address + register.size, data[register.size :]
        return writes


def find_write_error(memory: ServoMemory, write: Write, senses_current: bool, firmware: int) -> int:
    """Return the error number of a value that the servo's present state does not permit; 0 for a permitted value.

    A goal is out of range while the watchdog's error is active (bus_watchdog.md, step 6). After a shutdown only a
    reboot brings torque back (shutdown.md; the manual does not state the error number).
    """
    name, value = write.register.name, write.value
    is_goal = name in ("Goal PWM", "Goal Current", "Goal Velocity", "Goal Position")
    out_of_range = (
        (is_goal and "Bus Watchdog" in memory and memory["Bus Watchdog"] == WATCHDOG_TRIPPED)
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
