"""One IMU of a simulated autopilot: the readings of its part, and the firmware's processing before they are sent."""

from collections.abc import Callable, Sequence
from math import cos, pi, tan

import numpy as np
from numpy.typing import NDArray

from firmware_host.emulator.parts.accelerometer import Accelerometer
from firmware_host.emulator.parts.gyroscope import Gyroscope
from rig.config.world.faulty import SimulatedFaultySection
from rig.world.autopilot.parameters import Parameters
from rig.world.board.sensor_truth import SensorTruth
from rig.world.faulty_gyroscope import FrozenGyroscope, Repeats
from rig.world.ur10e.motion.forward_kinematics import rotation_from_vector

RATE_HZ = 400.0  # sampling rate: that of a fast main loop
MEAN_READINGS = 2  # in a mean of PX4's VehicleIMU: IMU_INTEG_RATE is 200 Hz
ORIENTATIONS = {0: (), 2: ((2, 90),), 4: ((2, 180),), 6: ((2, 270),), 8: ((0, 180),), 12: ((1, 180),), 24: ((1, 90),)}
NO_FAULTS = SimulatedFaultySection()
Vector = NDArray[np.float64]


class LowPass:
    """ArduPilot's LowPassFilter2p: a second-order Butterworth filter; no filter if its cut-off is zero."""

    def __init__(self) -> None:
        self._cutoff_hz = -1.0
        self._before: list[Vector] = []

    def apply(self, value: Vector, cutoff_hz: float) -> Vector:
        """Return the filter's output for the next reading, (3,)."""
        if cutoff_hz <= 0:
            return value
        if cutoff_hz != self._cutoff_hz:
            self._cutoff_hz = cutoff_hz
            self._before = []
            ohm = tan(pi * cutoff_hz / RATE_HZ)
            whole = 1 + 2 * cos(pi / 4) * ohm + ohm**2
            self._b0 = ohm**2 / whole
            self._a1, self._a2 = 2 * (ohm**2 - 1) / whole, (1 - 2 * cos(pi / 4) * ohm + ohm**2) / whole
        if not self._before:
            settled = value / (1 + self._a1 + self._a2)  # steady state
            self._before = [settled, settled]
        first, second = self._before
        state = value - self._a1 * first - self._a2 * second
        self._before = [state, first]
        filtered: Vector = self._b0 * (state + 2 * first + second)
        return filtered


class SimulatedImu:
    """An IMU, number `index` of its autopilot; `step` reads it, `rate` and `force` are the values that result."""

    def __init__(
        self,
        index: int,
        truth: SensorTruth,
        motion_at: Callable[[float], Sequence[float]],
        parameters: Parameters,
        *,
        px4: bool,
        seed: np.random.SeedSequence,
        faulty: SimulatedFaultySection = NO_FAULTS,
    ) -> None:
        """Build the part's gyroscope and accelerometer, and name the parameters of their corrections.

        `motion_at` returns rate, rad/s, and specific force, g, at a virtual time, s.
        """
        self._index, self._parameters, self._px4 = index, parameters, px4
        gyroscope = Gyroscope(motion_at, truth.gyro, seed, truth.temperature_c)
        self._gyroscope, self._repeats = FrozenGyroscope(gyroscope, faulty), Repeats(faulty, seed)
        assert truth.accelerometer is not None, "an autopilot's IMU always has one"
        self._accelerometer = Accelerometer(motion_at, truth.accelerometer, seed, truth.temperature_c)
        self._low_passes = (LowPass(), LowPass())
        self._sum, self._summed = np.zeros((2, 3)), 0
        self.rate, self.force = np.zeros(3), np.zeros(3)
        self.temperature_c = 25.0
        self.time_us = 0  # time of the reading, by the autopilot's clock
        nth = str(index + 1) if index else ""
        if px4:
            stems = (f"CAL_GYRO{index}_{{}}OFF", f"CAL_ACC{index}_{{}}OFF", f"CAL_ACC{index}_{{}}SCALE")
        else:
            gyro = f"INS_GYR{nth}OFFS" if index else "INS_GYROFFS"
            stems = (f"{gyro}_{{}}", f"INS_ACC{nth}OFFS_{{}}", f"INS_ACC{nth}SCAL_{{}}")
        self._names = [[stem.format(axis) for axis in "XYZ"] for stem in stems]

    def rate_to_send(self) -> list[float]:
        """Return the rate (3,), rad/s, of the next message."""
        return list(self._repeats.next_rates(self.rate.tolist()))

    def step(self, at_s: float, time_us: int) -> None:
        """Read the IMU once at the virtual time `at_s`, which is `time_us` on the autopilot's clock."""
        offset, force_offset, force_scale = (
            np.array([self._parameters[name] for name in names]) for names in self._names
        )
        self.temperature_c = self._gyroscope.temperature_c(at_s)
        rotation = orientation_rotation(self._parameters["SENS_BOARD_ROT" if self._px4 else "AHRS_ORIENTATION"])
        rate = rotation @ (np.array(self._gyroscope.read(at_s)) - offset)
        force = rotation @ ((np.array(self._accelerometer.read(at_s)) - force_offset) * force_scale)
        if self._px4:
            self._sum += (rate, force)
            self._summed += 1
            if self._summed == MEAN_READINGS:
                self.rate, self.force = self._sum / MEAN_READINGS
                self._sum, self._summed, self.time_us = np.zeros((2, 3)), 0, time_us
            return
        self.rate = self._low_passes[0].apply(rate, self._parameters["INS_GYRO_FILTER"])
        self.force = self._low_passes[1].apply(force, self._parameters["INS_ACCEL_FILTER"])
        self.time_us = time_us


def orientation_rotation(number: float) -> Vector:
    """Return the rotation (3, 3) of the board orientation `number`. Raise ValueError if it is not simulated."""
    if int(number) not in ORIENTATIONS:
        raise ValueError(f"the simulated autopilot has no orientation {number:g}")
    rotation = np.eye(3)
    for axis, degrees in ORIENTATIONS[int(number)]:
        vector = [0.0, 0.0, 0.0]
        vector[axis] = np.radians(degrees)
        rotation = np.array(rotation_from_vector((vector[0], vector[1], vector[2]))) @ rotation
    return rotation
