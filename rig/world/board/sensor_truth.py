"""A simulated sensor: its mounting on the flange, and its readings of the flange's motion, with or without a board.

An emulated sensor on a board has the errors and the mounting of a `SensorTruth`. Studies and tests use `SensorTruth`
without a board; its method `readings` takes arrays.
"""

from collections.abc import Sequence
from dataclasses import replace
from math import radians

import numpy as np

from firmware_host.emulator.parts.accelerometer import STANDARD_GRAVITY_M_S2, AccelerometerTruth
from firmware_host.emulator.parts.gyroscope import GyroTruth, Temperature, Warming, readings
from rig.config.sensors.sensor_sections import MountingSection, SensorSection, mounting_matrix
from rig.config.world.laboratory import SimulatedAccelerometerSection, SimulatedSensorSection
from rig.world.board.heat import HeatedPart
from rig.world.ur10e.motion.flange_motion import BodyMotion, Components, transfer_force
from rig.world.ur10e.motion.forward_kinematics import rotation_from_vector


class SensorTruth:
    """A sensor with its true errors, `gyro` and `accelerometer`; `accelerometer` is None if no accelerometer is read.

    `powered_s`: the time at which the sensor gets power and begins to warm up, unless it has the temperature of a
    heated `part`. `data_rate_ppm`: the error of the sensor's own oscillator, positive if it is fast.
    """

    def __init__(
        self,
        sensor: SensorSection,
        simulated: SimulatedSensorSection,
        powered_s: float = 0.0,
        part: HeatedPart | None = None,
        *,
        accelerometer: bool = False,
    ) -> None:
        """Build the errors from the simulated section; the item's frame is the flange's until `remount`."""
        self.gyro = replace(_build_gyro_truth(simulated), die=part)
        self.accelerometer = (
            None
            if sensor.acceleration is None and not accelerometer
            else replace(_build_accelerometer_truth(simulated.accelerometer, simulated.temperature_c), die=part)
        )
        self.data_rate_ppm = simulated.data_rate_ppm
        self.temperature_c: float | Temperature = simulated.temperature_c
        if part is not None:
            self.temperature_c = part.thermometer_c
        elif simulated.start_temperature_c is not None:
            self.temperature_c = Warming(
                simulated.start_temperature_c, simulated.temperature_c, simulated.warm_up_s, powered_s
            )
        self._item_rotation = np.array(build_sensor_rotation(sensor.mounting, simulated.mounting_error_deg))
        self._item_position_m = 1e-3 * np.array(simulated.offset_mm)
        self.remount(np.eye(3))

    def remount(self, mount: np.ndarray) -> None:
        """Mount the item with the sensor: `mount` (3, 3) transforms the flange's frame to the item's."""
        self._rows: list[list[float]] = (self._item_rotation @ mount).tolist()
        self._offset_m: list[float] = (mount.T @ self._item_position_m).tolist()

    @property
    def rows(self) -> list[list[float]]:
        """The rotation, row by row, from the flange's axes to the sensor's; each remounting makes a new list object."""
        return self._rows

    @property
    def senses_force(self) -> bool:
        """Whether any reading depends on the specific force."""
        return self.accelerometer is not None or bool(self.gyro.g_sensitivity_rad_s_per_g)

    def rotate_rate(self, flange_rate: Components) -> Components:
        """Return the flange's angular rate in the axes of the sensor."""
        (a, b, c), (d, e, f), (g, h, i) = self._rows
        u, v, w = flange_rate
        return a * u + b * v + c * w, d * u + e * v + f * w, g * u + h * v + i * w

    def sense(self, flange: BodyMotion) -> Sequence[float]:
        """Return the rate, rad/s, at the sensor for a motion of the flange and, if it senses force, the force, g."""
        rate = self.rotate_rate(flange.rate_rad_s)
        if not self.senses_force:
            return rate
        force = transfer_force(flange.rate_rad_s, flange.change_rad_s2, flange.force_m_s2, self._offset_m)
        return (*rate, *(component / STANDARD_GRAVITY_M_S2 for component in self.rotate_rate(force)))

    def readings(self, time_s: np.ndarray, flange: BodyMotion, seed: int | np.random.SeedSequence) -> np.ndarray:
        """Return the readings (n, 3), rad/s, at times (n,), unrounded. `flange`: the flange's motion as arrays (n,)."""
        columns = [np.broadcast_to(component, time_s.shape) for component in self.sense(flange)]
        return readings(self.gyro, time_s, np.column_stack(columns), seed, self.temperature_c)


def build_sensor_rotation(mounting: MountingSection, mounting_error_deg: Sequence[float]) -> list[list[float]]:
    """Return the rows of the matrix that takes a vector's components from the flange's axes to the sensor's.

    The sensor is mounted as `mounting` states, then rotated by the rotation vector `mounting_error_deg` (degrees, in
    its own nominal axes). If the axes are rotated, the components of a fixed vector change by the inverse rotation.
    """
    x, y, z = (radians(angle) for angle in mounting_error_deg)
    error = np.array(rotation_from_vector((x, y, z)))
    rows: list[list[float]] = (error.T @ mounting_matrix(mounting)).tolist()
    return rows


def _build_gyro_truth(simulated: SimulatedSensorSection) -> GyroTruth:
    g_sensitivity = simulated.g_sensitivity_rad_s_per_g
    return GyroTruth(
        scale=simulated.scale,
        bias_rad_s=simulated.bias_rad_s,
        noise_rad_s=simulated.noise_rad_s,
        non_orthogonality_rad=[radians(angle) for angle in simulated.non_orthogonality_deg],
        scale_per_k=simulated.scale_per_k,
        bias_rad_s_per_k=simulated.bias_rad_s_per_k,
        holds_at_c=simulated.temperature_c,
        g_sensitivity_rad_s_per_g=g_sensitivity if any(map(any, g_sensitivity)) else (),
        nonlinearity_even_per_rad_s=simulated.nonlinearity_even_per_rad_s,
        nonlinearity_odd_per_rad_s=simulated.nonlinearity_odd_per_rad_s,
        bandwidth_hz=simulated.bandwidth_hz,
        delay_s=1e-3 * simulated.delay_ms,
        instability_rad_s=simulated.bias_instability_rad_s,
        instability_time_s=simulated.bias_instability_time_s,
        random_walk_rad_s_per_sqrt_s=simulated.bias_random_walk_rad_s_per_sqrt_s,
        scale_per_k2=simulated.scale_per_k2,
        bias_rad_s_per_k2=simulated.bias_rad_s_per_k2,
        hysteresis_rad_s=simulated.bias_hysteresis_rad_s,
    )


def _build_accelerometer_truth(simulated: SimulatedAccelerometerSection, holds_at_c: float) -> AccelerometerTruth:
    """Return the emulated accelerometer's errors.

    The configured bias is to be added to a reading in order to correct it. `AccelerometerTruth` has the bias that the
    reading contains, which has the opposite sign.
    """
    return AccelerometerTruth(
        scale=simulated.scale,
        bias_m_s2=[-bias for bias in simulated.bias_m_s2],
        noise_m_s2=simulated.noise_m_s2,
        non_orthogonality_rad=[radians(angle) for angle in simulated.non_orthogonality_deg],
        second_order_s2_m=simulated.second_order_s2_m,
        scale_per_k=simulated.scale_per_k,
        bias_m_s2_per_k=[-bias for bias in simulated.bias_m_s2_per_k],
        holds_at_c=holds_at_c,
        bandwidth_hz=simulated.bandwidth_hz,
        delay_s=1e-3 * simulated.delay_ms,
        instability_m_s2=simulated.bias_instability_m_s2,
        scale_per_k2=simulated.scale_per_k2,
        bias_m_s2_per_k2=[-bias for bias in simulated.bias_m_s2_per_k2],
        hysteresis_m_s2=[-bias for bias in simulated.bias_hysteresis_m_s2],
    )
