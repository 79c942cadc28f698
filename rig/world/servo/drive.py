"""The simulated servo's motor and shaft: their response to time, goals and faults.

Source: ROBOTIS e-Manual: the models' pages, and the included files that are named with each rule. Not simulated:
velocity, PWM and current modes (their goals are stored, nothing turns), loads on the shaft other than a fall or a
blocked shaft.
"""

from dataclasses import dataclass
from math import floor, inf, isclose, pi, radians

import numpy as np

from rig.world.servo.control_tables import EXTENDED, POSITION, REVERSE, TIME_BASED, WATCHDOG_TRIPPED, Model, ServoMemory
from rig.world.servo.profile import ProfileSegment, plan_limited, plan_timed
from rig.world.servo.shaft import Shaft, whole_turns
from rig.world.servo.truth import ServoTruth

PULSE_RAD = 2 * pi / 4096
SPEED_RAD_S = 0.229 * 2 * pi / 60  # unit of velocity registers
ACCELERATION_RAD_S2 = 214.577 * 2 * pi / 3600  # unit of Profile Acceleration: 214.577 rev/min²
MAX_RAD_S2 = 200.0  # an "infinite" acceleration
WATCHDOG_S = 0.020
TICKS = 32768
VOLTAGE_ERROR, OVERHEATING_ERROR, OVERLOAD_ERROR = 0x01, 0x04, 0x20  # bits of Hardware Error Status and of Shutdown


@dataclass(slots=True)
class ServoFaults:
    """Faults that a test can set: the supply's voltage, the temperature, and three conditions.

    `held_fast`: the shaft is blocked. `dumb`: the servo never answers. `denies`: it refuses every write.
    """

    voltage_v: float
    temperature_c: float
    held_fast: bool = False
    dumb: bool = False
    denies: bool = False


class Drive:
    """The motor, controlled by its registers `memory`. Times are the world's, s.

    `torque`: whether the motor holds the shaft; `fed_s`: the time at which the watchdog was last reset.
    """

    def __init__(self, truth: ServoTruth, model: Model, memory: ServoMemory, time_s: float) -> None:
        self._truth, self._model, self._memory = truth, model, memory
        self.shaft = Shaft(truth, time_s)
        self.faults = ServoFaults(truth.voltage_v, truth.temperature_c)
        self._random = np.random.default_rng(truth.seed)
        self._strained_s = inf  # time since which the shaft is blocked
        self.torque = False
        self._began_s = self.fed_s = time_s
        self._turns_rad = 0.0

    def start(self, time_s: float) -> None:
        """Reset the drive to its state after power-up."""
        self._began_s = self.fed_s = time_s
        self.torque, self._strained_s = False, inf
        self.forget_turns(time_s)

    def forget_turns(self, time_s: float) -> None:
        """Reset the count of revolutions to zero."""
        self._turns_rad = whole_turns(self.shaft.encoder_at(time_s))

    def is_moving(self, time_s: float) -> bool:
        """Return whether a profile is in progress."""
        return time_s < self.shaft.ends_s()

    # -- time --------------------------------------------------------------------------------------------------------
    def advance(self, time_s: float) -> None:
        """Simulate until `time_s`: watchdog, overload, temperature and voltage."""
        memory = self._memory
        if self._is_watchdog_on and time_s > self.fed_s + memory["Bus Watchdog"] * WATCHDOG_S:
            self.trip(self.fed_s + memory["Bus Watchdog"] * WATCHDOG_S)
        if self.torque and self.faults.held_fast and self.is_moving(time_s):
            self._strained_s = min(self._strained_s, time_s)
            self.shaft.halt(time_s)
        if self.torque and time_s > self._strained_s + self._truth.overload_after_s:
            self._fail(OVERLOAD_ERROR, time_s)
        if self.faults.temperature_c > memory["Temperature Limit"]:
            self._fail(OVERHEATING_ERROR, time_s)
        low, high = memory["Min Voltage Limit"], memory["Max Voltage Limit"]
        if not low <= 10 * self.faults.voltage_v <= high:
            self._fail(VOLTAGE_ERROR, time_s)

    @property
    def _is_watchdog_on(self) -> bool:
        return "Bus Watchdog" in self._memory and self.torque and 1 <= self._memory["Bus Watchdog"] <= 127

    def trip(self, time_s: float) -> None:
        """Let the watchdog stop the shaft abruptly and set the profile to zero (bus_watchdog.md, steps 4, 5)."""
        self.shaft.halt(time_s)
        self._memory["Bus Watchdog"] = WATCHDOG_TRIPPED
        self._memory["Profile Velocity"] = self._memory["Profile Acceleration"] = 0

    def _fail(self, bit: int, time_s: float) -> None:
        """Report an error, and shut down if this is configured (shutdown.md)."""
        self._memory["Hardware Error Status"] |= bit
        if bit & self._memory["Shutdown"] and self.torque:
            self.torque_off(time_s)

    # -- effects of the registers ------------------------------------------------------------------------------------
    def torque_on(self, time_s: float) -> None:
        """Hold the shaft at its angle; in position mode, reset the count of revolutions."""
        if self._memory["Operating Mode"] == POSITION:
            self.forget_turns(time_s)
        self.torque, self.fed_s, self._strained_s = True, time_s, inf
        self.shaft.halt(time_s)
        self._memory["Goal Position"] = self._pulses(time_s, noisy=False)

    def torque_off(self, time_s: float) -> None:
        """Switch the motor off. The gear then holds the shaft, or the shaft falls by at most half a revolution."""
        self.torque = False
        self._memory["Torque Enable"] = 0
        fall = radians(self._truth.fall_deg_s)
        start = self.shaft.start_at(time_s)
        falls = [] if isclose(fall, 0.0) else [ProfileSegment(time_s, time_s + pi / abs(fall), start.angle_rad, fall)]
        self.shaft.follow(time_s, falls)

    def go(self, goal: int, time_s: float) -> None:
        """Begin a move to `goal` (register units) in an operating mode with goals. The shaft follows with its lag."""
        memory = self._memory
        if not self.torque or memory["Operating Mode"] not in (POSITION, EXTENDED):
            return
        start = self.shaft.start_at(time_s + self._truth.lag_s)
        goal_rad = (self._sign * (goal - memory["Homing Offset"]) + 0.5) * PULSE_RAD + self._turns_rad
        most = min(memory["Velocity Limit"] * SPEED_RAD_S, self._model.no_load_rpm * 2 * pi / 60)
        velocity, acceleration = memory["Profile Velocity"], memory["Profile Acceleration"]
        segments: list[ProfileSegment]
        if memory["Drive Mode"] & TIME_BASED and velocity:
            segments = plan_timed(start, goal_rad, 1e-3 * velocity, 1e-3 * acceleration, most)
        elif memory["Drive Mode"] & TIME_BASED:
            segments = plan_limited(start, goal_rad, most, MAX_RAD_S2)
        else:
            speed = min(velocity * SPEED_RAD_S, most) if velocity else most
            ramp = min(acceleration * ACCELERATION_RAD_S2, MAX_RAD_S2) if acceleration else MAX_RAD_S2
            segments = plan_limited(start, goal_rad, speed, ramp)
        self.shaft.follow(start.time_s, segments)

    # -- measured values in the registers ----------------------------------------------------------------------------
    def measure(self, time_s: float) -> None:
        """Update the registers of measured values."""
        memory, shaft = self._memory, self.shaft
        planned = shaft.start_at(time_s + self._truth.lag_s)
        encoder_s = 0.005  # the rate is the difference of two readings
        rate = (shaft.encoder_at(time_s) - shaft.encoder_at(time_s - encoder_s)) / encoder_s
        moving = self.is_moving(time_s)
        elapsed_s = (time_s - self._began_s) * (1 + 1e-6 * self._truth.tick_ppm)
        memory["Realtime Tick"] = floor(1e3 * elapsed_s) % TICKS
        memory["Present Position"] = self._pulses(time_s, noisy=True)
        memory["Present Velocity"] = round(self._sign * rate / SPEED_RAD_S)
        memory["Moving"] = int(moving or abs(rate) > memory["Moving Threshold"] * SPEED_RAD_S)
        arrived = not moving and self.torque
        memory["Moving Status"] = (0x32 if moving else 0) | int(arrived)  # trapezoid, in progress; arrived
        memory["Velocity Trajectory"] = round(self._sign * planned.rate_rad_s / SPEED_RAD_S)
        memory["Position Trajectory"] = self._count_pulses(planned.angle_rad)
        effort = 1000 if self._strained_s < inf else 40 * moving
        memory["Present Current" if self._model.senses_current else "Present Load"] = effort * self.torque
        memory["Present Input Voltage"] = round(10 * self.faults.voltage_v)
        memory["Present Temperature"] = round(self.faults.temperature_c)

    def _pulses(self, time_s: float, noisy: bool) -> int:
        noise = self._random.normal(0.0, radians(self._truth.encoder_noise_deg)) if noisy else 0.0
        return self._count_pulses(self.shaft.encoder_at(time_s) + noise)

    def _count_pulses(self, encoder_rad: float) -> int:
        return self._sign * floor((encoder_rad - self._turns_rad) / PULSE_RAD) + self._memory["Homing Offset"]

    @property
    def _sign(self) -> int:
        return -1 if self._memory["Drive Mode"] & REVERSE else 1
