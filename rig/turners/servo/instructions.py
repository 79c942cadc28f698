"""The instructions to the servo, each a few writes: prepare, move, brake, disarm."""

from rig.errors import Problem, Refused
from rig.turners.servo.goal_profiles import ProfileMove
from rig.turners.servo.packet_handler import Bus
from rig.turners.servo.servo_registers import (
    DRIVE_MODE,
    EXTENDED_POSITION,
    GOAL,
    OPERATING_MODE,
    POSITION,
    PROFILE,
    TIME_BASED,
    TORQUE,
    WATCHDOG,
    Register,
)

BRAKE_MS, BRAKE_RAMP_MS = 200, 100  # the profile of a stop


def make_ready(bus: Bus, watchdog: int) -> None:
    """Hold the shaft in place and arm the watchdog. Raise Refused if the servo does not keep a setting, and BusError.

    `watchdog` is in the register's units. Operating mode and drive mode are in the EEPROM and written only if their
    values differ from the wanted ones. Writing the mode sets the profile to zero, the fastest motion, so the order is
    mode, profile, goal, torque.
    """
    for register, wanted in ((DRIVE_MODE, TIME_BASED), (OPERATING_MODE, EXTENDED_POSITION)):
        if bus.look_up(register) != (wanted,):
            bus.write(register, wanted)
            _read_back(bus, register, wanted)
    bus.write(WATCHDOG, 0)  # also clears an earlier stop, in which goals are refused
    _hold_position(bus)
    bus.write(TORQUE, 1)
    bus.write(WATCHDOG, watchdog)
    if (readback := bus.look_up(WATCHDOG)) != (watchdog,):
        raise Refused.from_problem(
            Problem(
                "servo_watchdog_not_armed",
                f"the servo's watchdog was set to {watchdog} and reads {readback[0]}",
                "Switch the servo off and on; update its firmware if it stays",
            )
        )


def go(bus: Bus, move: ProfileMove) -> None:
    """Begin a move. Raise Refused `servo_setting_not_kept`, BusError.

    The profile is written and read back before every goal, because a stop by the watchdog sets it to zero, and a goal
    would then cause a jump. The goal is absolute, so that repeating it after a lost reply has no effect.
    """
    bus.write(PROFILE, move.ramp_ms, move.total_ms)
    _read_back(bus, PROFILE, move.ramp_ms, move.total_ms)
    bus.write(GOAL, move.goal)


def brake(bus: Bus) -> None:
    """Stop the shaft with a short ramp, and hold its position. Raise BusError."""
    _hold_position(bus)


def disarm(bus: Bus) -> None:
    """Let the servo hold its shaft without supervision by its watchdog. Raise BusError."""
    bus.write(WATCHDOG, 0)


def _hold_position(bus: Bus) -> None:
    bus.write(PROFILE, BRAKE_RAMP_MS, BRAKE_MS)
    bus.write(GOAL, *bus.look_up(POSITION))


def _read_back(bus: Bus, register: Register, *wanted: int) -> None:
    """Raise Refused `servo_setting_not_kept` unless the register holds the wanted values."""
    readback = bus.look_up(register)
    if readback != wanted:
        raise Refused.from_problem(
            Problem(
                "servo_setting_not_kept",
                f"{register.name} of the servo was set to {_join(wanted)} and reads {_join(readback)}",
                "End other programs that use the servo; switch it off and on, then start again",
            )
        )


def _join(values: tuple[int, ...]) -> str:
    return ", ".join(map(str, values))
