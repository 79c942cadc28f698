"""What a servo says about itself: one state per reply, and the report a look at it gives."""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, fields
from operator import attrgetter

import numpy as np

from rig.turners.servo.models import PULSE_RAD, SPEED_RAD_S, ServoModel
from rig.turners.servo.registers import STATE

SERVO_STATE_DTYPE = np.dtype(
    [
        ("time_s", "f8"),
        ("host_time_s", "f8"),
        ("q_rad", "f8", (1,)),
        ("qd_rad_s", "f8", (1,)),
        ("took_s", "f8"),
        ("tick", "u2"),
        ("moving", "u1"),
        ("moving_status", "u1"),
        ("hardware_error", "u1"),
        ("load", "f8"),
        ("voltage_v", "f8"),
        ("temperature_c", "f8"),
    ]
)
STILL_S, STILL_STATES = 0.15, 5  # so long, and in so many states, a shaft must stand to stand still
STILL_RAD = 6.5 * PULSE_RAD  # … within this: a shaft at rest is seen to dither by ±3 pulses (forum.robotis.com 7582)

Value = float | int | tuple[float, ...]


def now_s() -> float:
    """The reference clock of a servo's states: the host's, which nobody slews or sets where the system has such a one.

    The servo's own (Realtime Tick) is none: it counts milliseconds, by an oscillator that may be a per cent out.
    """
    raw = getattr(time, "CLOCK_MONOTONIC_RAW", None)
    return time.monotonic() if raw is None else time.clock_gettime(raw)


@dataclass(frozen=True, slots=True)
class ServoState:
    """One reply of the servo.

    `time_s` is `now_s` at half the transaction (the reference clock), `host_time_s` is `time.monotonic()` when the
    reply was read, `took_s` how long the transaction took: the position was measured within it. `q_rad` (1,) is the
    shaft's angle as the encoder reads it, turns counted, ccw positive, `qd_rad_s` (1,) the servo's own and coarse rate,
    in steps of 1.4° a second. `load` is a current in A, or a share of full load (`ServoModel.load_unit`).
    `hardware_error` is Hardware Error Status. The field names are those of `SERVO_STATE_DTYPE`.
    """

    time_s: float
    host_time_s: float
    q_rad: tuple[float, ...]
    qd_rad_s: tuple[float, ...]
    took_s: float
    tick: int
    moving: int
    moving_status: int
    hardware_error: int
    load: float
    voltage_v: float
    temperature_c: float

    def to_record(self) -> tuple[Value, ...]:
        """The values in the order of `SERVO_STATE_DTYPE`."""
        return _IN_ORDER(self)


_IN_ORDER: Callable[[ServoState], tuple[Value, ...]] = attrgetter(*(each.name for each in fields(ServoState)))


def decode(
    data: bytes, model: ServoModel, transaction_s: tuple[float, float], host_time_s: float, hardware_error: int
) -> ServoState:
    """The state in a reply's 27 bytes; `transaction_s` are the times before and after."""
    began_s, ended_s = transaction_s
    tick, moving, status, _, load, velocity, position, _, _, voltage, temperature = STATE.unpack(data)
    return ServoState(
        time_s=(began_s + ended_s) / 2,
        host_time_s=host_time_s,
        q_rad=(position * PULSE_RAD,),
        qd_rad_s=(velocity * SPEED_RAD_S,),
        took_s=ended_s - began_s,
        tick=tick,
        moving=moving,
        moving_status=status,
        hardware_error=hardware_error,
        load=load * model.load_unit,
        voltage_v=voltage / 10,
        temperature_c=float(temperature),
    )


def stands(states: Sequence[ServoState]) -> bool:
    """Whether the shaft stands still in the newest of `states`, which are in order; where they come rarely, in more."""
    if len(states) < STILL_STATES:
        return False
    newest = states[-1]
    lately = sum(newest.time_s - state.time_s <= STILL_S for state in states)
    recent = states[-max(lately, STILL_STATES) :]
    covered = newest.time_s - states[0].time_s >= STILL_S
    angles = [state.q_rad[0] for state in recent]
    return covered and not any(state.moving for state in recent) and max(angles) - min(angles) <= STILL_RAD


@dataclass(frozen=True, slots=True)
class ServoReport:
    """What a look at the servo shows, for pre-flight; None where its firmware has no such register.

    `round_trip_s` is how long a state takes on the line.
    """

    port: str
    servo_id: int
    model: ServoModel
    firmware: int
    drive_mode: int
    operating_mode: int
    secondary_id: int
    homing_offset: int
    temperature_limit_c: int
    voltage_limits_v: tuple[float, float]
    velocity_limit_rad_s: float
    startup: int | None
    shutdown: int
    torque_on: bool
    watchdog: int | None
    round_trip_s: float
    state: ServoState
