"""The registers in use (ROBOTIS e-Manual, "Control Table"), and the meaning of their values."""

import struct
from typing import NamedTuple


class Register(NamedTuple):
    """A register: its address, the little-endian `struct` format of its values, and its name."""

    address: int
    form: str
    name: str

    @property
    def size(self) -> int:
        """The size in bytes."""
        return struct.calcsize(self.form)

    def pack(self, *values: int) -> bytes:
        """Return values as bytes."""
        return struct.pack(self.form, *values)

    def unpack(self, data: bytes) -> tuple[int, ...]:
        """Return the values in a register's bytes."""
        return struct.unpack(self.form, data)


MODEL_NUMBER = Register(0, "<H", "Model Number")
FIRMWARE = Register(6, "<B", "Firmware Version")
DRIVE_MODE = Register(10, "<B", "Drive Mode")
OPERATING_MODE = Register(11, "<B", "Operating Mode")
SECONDARY_ID = Register(12, "<B", "Secondary ID")
HOMING_OFFSET = Register(20, "<i", "Homing Offset")
TEMPERATURE_LIMIT = Register(31, "<B", "Temperature Limit")
VOLTAGE_LIMITS = Register(32, "<HH", "Max Voltage Limit, Min Voltage Limit")
VELOCITY_LIMIT = Register(44, "<I", "Velocity Limit")
STARTUP = Register(60, "<B", "Startup Configuration")
SHUTDOWN = Register(63, "<B", "Shutdown")
TORQUE = Register(64, "<B", "Torque Enable")
RETURN_LEVEL = Register(68, "<B", "Status Return Level")
HARDWARE_ERROR = Register(70, "<B", "Hardware Error Status")
WATCHDOG = Register(98, "<B", "Bus Watchdog")
PROFILE = Register(108, "<II", "Profile Acceleration, Profile Velocity")
GOAL = Register(116, "<i", "Goal Position")
POSITION = Register(132, "<i", "Present Position")
# Realtime Tick, Moving, Moving Status, Present PWM, Present Current or Load, Present Velocity, Present Position,
# Velocity Trajectory, Position Trajectory, Present Input Voltage, Present Temperature: one block, one packet.
STATE = Register(120, "<HBBhhiiiiHB", "Realtime Tick … Present Temperature")

# first firmware with Bus Watchdog, with the time-based profile, with Startup Configuration
WATCHDOG_FIRMWARE, TIMED_FIRMWARE, STARTUP_FIRMWARE = 38, 42, 45
EXTENDED_POSITION = 4  # Operating Mode: ±256 revolutions
TIME_BASED = 4  # Drive Mode: bit 2 alone; ccw counts up, and only Torque Enable switches torque on
NO_SECONDARY_ID = 253  # IDs from this one on mean "none"
WATCHDOG_S, WATCHDOG_MAX, WATCHDOG_TRIPPED = 0.020, 127, 255
# bits of Shutdown and Hardware Error Status
VOLTAGE_ERROR, OVERHEATING_ERROR, ENCODER_ERROR, SHOCK_ERROR, OVERLOAD_ERROR = 0x01, 0x04, 0x08, 0x10, 0x20
ERROR_WORDS = {
    VOLTAGE_ERROR: "input voltage",
    OVERHEATING_ERROR: "overheating",
    ENCODER_ERROR: "encoder",
    SHOCK_ERROR: "electrical shock",
    OVERLOAD_ERROR: "overload",
}


def error_words(bits: int) -> str:
    """Return Hardware Error Status in words, with its number because the manual's pages disagree on one of the bits."""
    words = [word for bit, word in ERROR_WORDS.items() if bits & bit] or ["unknown"]
    return f"{', '.join(words)} (0x{bits:02x})"
