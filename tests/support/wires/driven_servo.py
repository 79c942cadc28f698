"""The driver on a simulated servo, for tests; and as a process of its own to be killed."""

import math
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

from rig.motion.carried import FlangeLoad
from rig.motion.steps import Transfer, trapezoid_duration
from rig.turners.servo.servo_driver import Servo
from support.processes.yoked_clock import YokedClock
from support.wires.servo_on_a_wire import ServoOnAWire

MODEL = "xm430_w350"
BOARD = FlangeLoad(0.05)
PATIENT_S = 2.0  # a watchdog for tests that are not about it
STANDS_RAD_S = 1e-9


def turn(from_rad: float, by_deg: float, speed_deg_s: float = 120.0, ramp_s: float = 0.1) -> Transfer:
    """Return a turn by `by_deg` from an angle, at a speed between ramps."""
    by_rad, speed_rad_s = math.radians(by_deg), math.radians(speed_deg_s)
    acceleration = speed_rad_s / ramp_s
    duration_s = trapezoid_duration(abs(by_rad), speed_rad_s, acceleration)
    return Transfer("test turn", (from_rad,), (from_rad + by_rad,), speed_rad_s, acceleration, duration_s)


@contextmanager
def control_servo(wire: ServoOnAWire, watchdog_s: float = PATIENT_S, **how: Any) -> Iterator[Servo]:
    """Yield the servo under control."""
    with Servo(wire.port, MODEL, watchdog_s=watchdog_s, clock=wire.clock, **how) as servo:
        servo.take_control(BOARD)
        yield servo


def act_at_speed(wire: ServoOnAWire, act: Callable[[], object]) -> Callable[[], None]:
    """Return a watch that calls `act` once, when the shaft turns."""
    done: list[bool] = []

    def watch() -> None:
        if not done and abs(wire.rate_rad_s) > 1.0:
            done.append(True)
            act()

    return watch


def turn_on_and_on(port: str, watchdog_s: float, clock: YokedClock) -> None:
    """Turn a servo to and fro until the process is killed."""
    with Servo(port, MODEL, watchdog_s=watchdog_s, clock=clock) as servo:
        servo.take_control(BOARD)
        by_deg = 200.0
        while True:
            servo.move(turn(servo.latest.q_rad[0], by_deg))
            by_deg = -by_deg
