"""The emulated board as the laboratory mounts it: the firmware image, and sensors that feel the flange turn."""

from collections.abc import Callable, Sequence
from functools import cache
from importlib import resources
from math import radians

import numpy as np

from firmware_host.emulator.lsm9ds1 import GyroTruth, Lsm9ds1
from firmware_host.emulator.machine import EmulatedBoard
from rig.config.models import RigConfig, SensorSection, mounting_matrix
from rig.config.world_models import SimulatedSensorSection, WorldSection
from rig.world.kinematics import Vector, rotation_from_vector

RateAt = Callable[[float], Vector]


@cache
def firmware(suffix: str) -> bytes:
    """The image that is flashed (`bin`) or the same with its symbols (`elf`)."""
    return (resources.files("firmware_host") / "firmware" / "image" / f"rig_l432.{suffix}").read_bytes()


def power_up(config: RigConfig, world: WorldSection, flange_rate_at: RateAt, time_s: float) -> EmulatedBoard:
    """A board that gets power at the virtual time `time_s` and starts `boot_time_s` later."""
    devices = [
        _gyroscope(config.sensors[name], truth, flange_rate_at, np.random.SeedSequence([world.seed, index]))
        for index, (name, truth) in enumerate(sorted(world.sensors.items()))
    ]
    return EmulatedBoard(
        image=firmware("bin"),
        elf=firmware("elf"),
        devices=devices,
        unique_id=bytes.fromhex(world.board.unique_id),
        crystal_ppm=world.board.crystal_ppm,
        boot_time_s=time_s + world.board.boot_time_s,
    )


def _gyroscope(
    sensor: SensorSection, truth: SimulatedSensorSection, flange_rate_at: RateAt, seed: np.random.SeedSequence
) -> Lsm9ds1:
    return Lsm9ds1(
        sensor_rate(sensor, truth.mounting_error_deg, flange_rate_at),
        GyroTruth(
            truth.scale,
            truth.bias_rad_s,
            truth.noise_rad_s,
            [radians(angle) for angle in truth.non_orthogonality_deg],
        ),
        temperature_c=truth.temperature_c,
        seed=seed,
    )


def sensor_rate(sensor: SensorSection, mounting_error_deg: Sequence[float], flange_rate_at: RateAt) -> RateAt:
    """The flange's rate as the sensor's axes see it.

    The sensor sits as `sensor.mounting` says, then turned by the rotation vector `mounting_error_deg` (degrees, in its
    own nominal axes): a vector's components change by the inverse of that rotation.
    """
    x, y, z = (radians(angle) for angle in mounting_error_deg)
    error = np.array(rotation_from_vector((x, y, z)))
    rows = (error.T @ mounting_matrix(sensor.mounting)).tolist()
    (a, b, c), (d, e, f), (g, h, i) = rows

    def rate_at(time_s: float) -> Vector:
        u, v, w = flange_rate_at(time_s)
        return a * u + b * v + c * w, d * u + e * v + f * w, g * u + h * v + i * w

    return rate_at
