"""The emulated board as the laboratory mounts it: the firmware image, and sensors that feel the flange turn."""

from collections.abc import Callable, Collection, Sequence
from functools import cache
from importlib import resources
from math import radians

import numpy as np

from firmware_host.emulator.adis16465 import Adis16465
from firmware_host.emulator.flash_memory import FlashMemory
from firmware_host.emulator.gyroscope import GyroTruth
from firmware_host.emulator.lsm9ds1 import Lsm9ds1
from firmware_host.emulator.machine import EmulatedBoard
from firmware_host.emulator.mpu9250 import Mpu9250
from firmware_host.emulator.spi_device import SpiDevice
from rig.config.models import RigConfig, SensorSection, mounting_matrix
from rig.config.world_models import SimulatedSensorSection, WorldSection
from rig.world.ur10e.forward_kinematics import Vector, rotation_from_vector

RateAt = Callable[[float], Vector]


@cache
def firmware(suffix: str) -> bytes:
    """The image that is flashed (`bin`) or the same with its symbols (`elf`)."""
    return (resources.files("firmware_host") / "firmware" / "image" / f"rig_l432.{suffix}").read_bytes()


def mount_sensors(
    config: RigConfig, world: WorldSection, flange_rate_at: RateAt, time_s: float
) -> dict[str, SpiDevice]:
    """The sensors of the `world:` section, by name, given power at the virtual time `time_s`."""
    return {
        name: _sensor(
            config.sensors[name],
            truth,
            flange_rate_at,
            np.random.SeedSequence([world.seed, index]),
            time_s + world.board.boot_time_s,
        )
        for index, (name, truth) in enumerate(sorted(world.sensors.items()))
    }


def power_up(world: WorldSection, flash: FlashMemory, sensors: Collection[SpiDevice], time_s: float) -> EmulatedBoard:
    """A board that gets power at the virtual time `time_s` and starts `boot_time_s` later."""
    return EmulatedBoard(
        flash=flash,
        elf=firmware("elf"),
        devices=list(sensors),
        unique_id=bytes.fromhex(world.board.unique_id),
        crystal_ppm=world.board.crystal_ppm,
        boot_time_s=time_s + world.board.boot_time_s,
    )


def _sensor(
    sensor: SensorSection,
    simulated: SimulatedSensorSection,
    flange_rate_at: RateAt,
    seed: np.random.SeedSequence,
    ready_s: float,
) -> SpiDevice:
    rate_at = sensor_rate(sensor, simulated.mounting_error_deg, flange_rate_at)
    truth = GyroTruth(
        simulated.scale,
        simulated.bias_rad_s,
        simulated.noise_rad_s,
        [radians(angle) for angle in simulated.non_orthogonality_deg],
    )
    temperature_c = simulated.temperature_c
    match sensor.part:
        case "lsm9ds1":
            return Lsm9ds1(rate_at, truth, temperature_c=temperature_c, seed=seed)
        case "mpu9250":
            return Mpu9250(rate_at, truth, temperature_c=temperature_c, seed=seed)
        case "adis16465":  # it comes in three variants, one for each range
            return Adis16465(
                rate_at,
                truth,
                temperature_c=temperature_c,
                seed=seed,
                range_deg_s=int(sensor.range_deg_s),
                ready_s=ready_s,
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
