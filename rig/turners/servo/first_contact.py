"""The first contact with a servo: identity and settings. Nothing moves, and changes last only until power-off."""

import time

from firmware_host.computer_load import load_factor
from rig.errors import Refused
from rig.turners.servo.packet_handler import Bus, BusError, ReplyLost
from rig.turners.servo.servo_models import SPEED_RAD_S, model_of
from rig.turners.servo.servo_registers import (
    DRIVE_MODE,
    FIRMWARE,
    HARDWARE_ERROR,
    HOMING_OFFSET,
    MODEL_NUMBER,
    OPERATING_MODE,
    RETURN_LEVEL,
    SECONDARY_ID,
    SHUTDOWN,
    STARTUP,
    STARTUP_FIRMWARE,
    STATE,
    TEMPERATURE_LIMIT,
    TORQUE,
    VELOCITY_LIMIT,
    VOLTAGE_LIMITS,
)
from rig.turners.servo.servo_state import ServoReport, decode

PINGS = 4
LISTEN_S = 0.012  # time after each ping in which another servo may answer
ROUND_TRIPS = 15
ANSWER_ALL = 2  # value of Status Return Level: every write is acknowledged


def look_at(bus: Bus, port: str, servo_id: int) -> ServoReport:
    """Return the servo's report. Raise Refused `no_servo`, `servo_not_alone`, `other_servo`, `servo_garbled`."""
    try:
        _ping(bus, port, servo_id)
        _request_acknowledgements(bus)
        return _report(bus, port, servo_id)
    except BusError as error:
        raise Refused(
            "servo_garbled",
            f"the servo with ID {servo_id} at {port} answers, but not as it should ({error})",
            "Look for a second servo with its ID, and at the cable and the adapter's ground",
        ) from error


def _ping(bus: Bus, port: str, servo_id: int) -> None:
    """Raise Refused `no_servo` or `servo_not_alone` unless exactly one servo answers pings.

    One wrong answer in four is accepted, because it may be late.
    """
    answers = odd = 0
    for _ in range(PINGS):
        try:
            bus.ping()
            answers += 1
            odd += bus.more_came(LISTEN_S)
        except ReplyLost as lost:
            odd += lost.damaged
            bus.settle()
    if odd > 1:
        raise Refused(
            "servo_not_alone",
            f"a ping of ID {servo_id} at {port} has more than one answer",
            "Give every servo on the line an ID of its own, or unplug the others",
        )
    if answers == 0:
        raise Refused(
            "no_servo",
            f"no servo with ID {servo_id} answers at {port}",
            "Check its supply and cable, and turner.id and turner.baud (57600 as delivered; protocol 2.0)",
        )


def _request_acknowledgements(bus: Bus) -> None:
    """Make the servo acknowledge writes (a setting in RAM), so that the arrival of a goal is confirmed."""
    try:
        (level,) = bus.read(RETURN_LEVEL)
    except ReplyLost:
        bus.settle()
        level = 0
    if level != ANSWER_ALL:
        bus.write_unheard(RETURN_LEVEL, ANSWER_ALL)
        bus.settle()  # it may acknowledge already


def _report(bus: Bus, port: str, servo_id: int) -> ServoReport:
    """Return the report of identity, settings and several states. Raise Refused `other_servo`, ReplyLost."""
    (number,) = bus.look_up(MODEL_NUMBER)
    model = model_of(number)
    if model is None:
        raise Refused(
            "other_servo",
            f"the servo at {port} has the model number {number}, which the rig does not support",
            "Use an XL430-W250, XM430-W350 or XM430-W210",
        )
    (firmware,) = bus.look_up(FIRMWARE)
    high, low = bus.look_up(VOLTAGE_LIMITS)
    (hardware_error,) = bus.look_up(HARDWARE_ERROR)
    round_trips = []
    states = []
    for _ in range(round(ROUND_TRIPS * load_factor())):  # a busy computer delays most of them
        began_s = bus.clock.reference_s()
        try:
            data = bus.read_bytes(STATE)
            states.append(decode(data, model, (began_s, bus.clock.reference_s()), time.monotonic(), hardware_error))
        except ReplyLost:
            bus.settle()
        round_trips.append(bus.clock.reference_s() - began_s)
    if not states:
        raise ReplyLost(damaged=True)
    return ServoReport(
        port=port,
        servo_id=servo_id,
        servo=model,
        firmware=firmware,
        drive_mode=bus.look_up(DRIVE_MODE)[0],
        operating_mode=bus.look_up(OPERATING_MODE)[0],
        secondary_id=bus.look_up(SECONDARY_ID)[0],
        homing_offset=bus.look_up(HOMING_OFFSET)[0],
        temperature_limit_c=bus.look_up(TEMPERATURE_LIMIT)[0],
        voltage_limits_v=(low / 10, high / 10),
        velocity_limit_rad_s=bus.look_up(VELOCITY_LIMIT)[0] * SPEED_RAD_S,
        startup=bus.look_up(STARTUP)[0] if firmware >= STARTUP_FIRMWARE else None,
        shutdown=bus.look_up(SHUTDOWN)[0],
        torque_on=bool(bus.look_up(TORQUE)[0]),
        round_trip_s=sorted(round_trips)[1],  # the second shortest: the others include delays of this computer
        state=states[-1],
    )
