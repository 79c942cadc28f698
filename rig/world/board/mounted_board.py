"""The emulated board as the simulation mounts it: the firmware image, and sensors that move with the flange."""

from collections.abc import Callable, Collection
from functools import cache, partial
from importlib import resources
from typing import Any

import numpy as np

from firmware_host.emulator.chip.flash_memory import FlashMemory
from firmware_host.emulator.chip.spi_device import SpiDevice
from firmware_host.emulator.machine import EmulatedBoard
from firmware_host.parts import GYROSCOPES, MAGNETOMETERS
from rig.config.models import RigConfig
from rig.config.sensors.sensor_sections import SensorSection
from rig.config.world.laboratory import WorldSection
from rig.world.board.heat import HeatedBody
from rig.world.board.magnetometer_truth import MountedMagnetometer
from rig.world.board.sensing_element import MotionAt
from rig.world.board.sensor_truth import SensorTruth


@cache
def read_firmware(suffix: str) -> bytes:
    """Return the firmware's image: as it is flashed (`bin`), or with its symbols (`elf`)."""
    return (resources.files("firmware_host") / "firmware" / "image" / f"rig_l432.{suffix}").read_bytes()


def mount_sensors(
    config: RigConfig,
    world: WorldSection,
    motion_of: Callable[[str, SensorTruth], MotionAt],
    time_s: float,
    body: HeatedBody | None = None,
) -> dict[str, SpiDevice]:
    """Return the board's sensors of the `world:` section by name, powered at the virtual time `time_s`.

    `motion_of` returns a sensor's motion as a function of time, with 3 components (rates) or 6 (specific forces too).
    The temperatures are those of the `body`, if one is given.
    """
    return {
        name: _build_sensor(
            config.sensors[name],
            SensorTruth(config.sensors[name], simulated, time_s, None if body is None else body.part(name)),
            partial(motion_of, name),
            np.random.SeedSequence([world.seed, index]),
            time_s + world.board.boot_time_s,
        )
        for index, (name, simulated) in enumerate(sorted(world.sensors.items()))
        if config.sensors[name].on_board
    }


def mount_magnetometers(
    config: RigConfig, world: WorldSection, field_of: Callable[[MountedMagnetometer], MotionAt]
) -> dict[str, SpiDevice]:
    """Return the magnetometers of the `world:` section by name. `field_of` returns the flux density over time, T."""
    mounted = {
        name: MountedMagnetometer(
            config.magnetometers[name].mounting,
            simulated,
            simulated.mounting_error_deg,
            _extension_mm(config) if simulated.offset_mm is None else simulated.offset_mm,
        )
        for name, simulated in sorted(world.magnetometers.items())
    }
    return {
        name: MAGNETOMETERS[config.magnetometers[name].part].register_model(
            field_of(sensor), sensor.truth, seed=np.random.SeedSequence([world.seed, len(world.sensors) + index])
        )
        for index, (name, sensor) in enumerate(mounted.items())
    }


def _extension_mm(config: RigConfig) -> tuple[float, float, float]:
    """Return the end of the turner's extension, on which the item sits, in the flange's frame, mm."""
    x, y, z = (1000 * length for length in config.turner.extension_m)
    return x, y, z


def power_up(world: WorldSection, flash: FlashMemory, sensors: Collection[SpiDevice], time_s: float) -> EmulatedBoard:
    """Return a board that is powered at the virtual time `time_s` and starts `boot_time_s` later."""
    return EmulatedBoard(
        flash=flash,
        elf=read_firmware("elf"),
        devices=list(sensors),
        unique_id=bytes.fromhex(world.board.unique_id),
        crystal_ppm=world.board.crystal_ppm,
        boot_time_s=time_s + world.board.boot_time_s,
        has_crystal=world.board.crystal,
    )


def _build_sensor(
    sensor: SensorSection,
    truth: SensorTruth,
    motion_of: Callable[[SensorTruth], MotionAt],
    seed: np.random.SeedSequence,
    ready_s: float,
) -> SpiDevice:
    part = GYROSCOPES[sensor.part]
    options: dict[str, Any] = {"range_deg_s": int(sensor.range_deg_s), "ready_s": ready_s}
    return part.register_model(
        motion_of(truth),
        truth.gyro,
        temperature_c=truth.temperature_c,
        seed=seed,
        acceleration=truth.accelerometer,
        oscillator_ppm=truth.data_rate_ppm,
        **{name: options[name] for name in part.model_options},
    )
