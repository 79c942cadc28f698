"""Problems of a servo that its report shows before anything moves. Pure."""

import math

from rig.errors import Problem
from rig.motion.carried import FlangeLoad
from rig.turners.servo.servo_models import LOAD_FRACTION
from rig.turners.servo.servo_registers import (
    EXTENDED_POSITION,
    NO_SECONDARY_ID,
    OVERHEATING_ERROR,
    OVERLOAD_ERROR,
    TIME_BASED,
    TIMED_FIRMWARE,
    WATCHDOG_FIRMWARE,
    error_words,
)
from rig.turners.servo.servo_state import ServoReport

GRAVITY_M_S2 = 9.81
HEADROOM_C = 10.0  # margin below the temperature limit: a servo that holds and turns for minutes warms up


def servo_problems(report: ServoReport, wanted_model: str, carried: FlangeLoad, period_s: float) -> list[Problem]:
    """Return all reasons not to drive this servo in its present state; `period_s` is the period of its states."""
    problems = [*_identity(report, wanted_model), *_settings(report), *_condition(report), *_load(report, carried)]
    if report.round_trip_s > period_s:
        problems.append(
            Problem(
                "servo_line_slow",
                f"a state of the servo takes {1e3 * report.round_trip_s:.1f} ms, but one is needed every "
                f"{1e3 * period_s:.1f} ms",
                "Set Baud Rate (8) to 3, which is 1 Mbit/s, and Return Delay Time (9) to 0, and turner.baud to match; "
                "an FTDI adapter needs a latency timer of 1 ms",
            )
        )
    return problems


def _identity(report: ServoReport, wanted_model: str) -> list[Problem]:
    """Return a problem if the servo is not of the configured model, and one if its firmware is too old."""
    problems = []
    if report.servo.name != wanted_model:
        problems.append(
            Problem(
                "other_servo",
                f"the servo at {report.port} is an {report.servo.name}, but the configuration names {wanted_model}",
                "Correct turner.model, or connect the servo that is meant",
            )
        )
    if report.firmware < TIMED_FIRMWARE:
        lacks = "Bus Watchdog" if report.firmware < WATCHDOG_FIRMWARE else "time-based profile"
        problems.append(
            Problem(
                "servo_firmware_old",
                f"the servo's firmware {report.firmware} has no {lacks}; the rig needs {TIMED_FIRMWARE} or later",
                "Update it with the maker's Dynamixel Wizard 2.0",
            )
        )
    return problems


def _settings(report: ServoReport) -> list[Problem]:
    """Return the problems of settings that could move the shaft, or leave it unprotected."""
    problems = []
    if report.startup:
        problems.append(
            Problem(
                "servo_starts_by_itself",
                f"the servo's Startup Configuration is {report.startup}: it switches its torque on, or restores goals, "
                "at every power-up",
                "Set Startup Configuration (60) to 0",
            )
        )
    if report.homing_offset:
        problems.append(
            Problem(
                "servo_homing_offset",
                f"the servo's Homing Offset is {report.homing_offset} pulses",
                "Set Homing Offset (20) to 0",
            )
        )
    if report.secondary_id < NO_SECONDARY_ID:
        problems.append(
            Problem(
                "servo_secondary_id",
                f"the servo also responds to the ID {report.secondary_id}, which may be meant for another",
                "Set Secondary ID (12) to 255",
            )
        )
    if report.shutdown & (OVERHEATING_ERROR | OVERLOAD_ERROR) != OVERHEATING_ERROR | OVERLOAD_ERROR:
        problems.append(
            Problem(
                "servo_unprotected",
                f"the servo's Shutdown is 0x{report.shutdown:02x}: it does not switch off on overload and overheating",
                "Set Shutdown (63) to 52 (0x34)",
            )
        )
    if report.torque_on and (report.operating_mode, report.drive_mode) != (EXTENDED_POSITION, TIME_BASED):
        problems.append(
            Problem(
                "servo_torque_on",
                f"the servo holds its shaft in operating mode {report.operating_mode}, drive mode {report.drive_mode}; "
                "they can only be changed with the torque off, and then the load may fall",
                "Hold the board, and switch the servo off and on",
            )
        )
    return problems


def _condition(report: ServoReport) -> list[Problem]:
    """Return the problems of the servo's state: errors, supply voltage, temperature."""
    state = report.state
    problems = []
    if state.hardware_error:
        problems.append(hardware_problem(state.hardware_error))
    low, high = report.voltage_limits_v
    if not low <= state.voltage_v <= high:
        problems.append(
            Problem(
                "servo_voltage",
                f"the servo has {state.voltage_v:.1f} V; its limits are {low:.1f} V to {high:.1f} V",
                "Give it 12 V",
            )
        )
    if state.temperature_c > report.temperature_limit_c - HEADROOM_C:
        problems.append(
            Problem(
                "servo_hot",
                f"the servo has {state.temperature_c:.0f} °C and switches itself off above "
                f"{report.temperature_limit_c} °C",
                "Let it cool, with its supply off",
            )
        )
    return problems


def _load(report: ServoReport, carried: FlangeLoad) -> list[Problem]:
    """Return a problem if a payload's torque would be too high on a horizontal shaft, the worst possible direction."""
    lever_m = math.hypot(*carried.centre_m[:2])
    torque_nm = carried.payload_kg * GRAVITY_M_S2 * lever_m
    most_nm = LOAD_FRACTION * report.servo.stall_torque_nm
    if torque_nm <= most_nm:
        return []
    return [
        Problem(
            "servo_load",
            f"the load of the servo pulls with {torque_nm:.2f} N·m, but an {report.servo.name} turns smoothly with "
            f"{most_nm:.2f} N·m at most",
            "Balance the board about the shaft, or take a stronger servo",
        )
    ]


def hardware_problem(bits: int) -> Problem:
    """Return the problem that the most serious bit of a hardware error shows."""
    what = f"the servo reports {error_words(bits)}"
    if bits & OVERLOAD_ERROR:
        remedy = "Find what blocked the shaft; hold the board, and switch the servo off and on"
        return Problem("servo_overload", what, remedy)
    if bits & OVERHEATING_ERROR:
        return Problem("servo_overheated", what, "Let it cool; hold the board, and switch the servo off and on")
    return Problem("servo_hardware_error", what, "Check its supply; hold the board, and switch the servo off and on")
