"""The parts that the board has drivers for: one table for Python and, through `parts_header.py`, for C.

A new part is one entry here, of at most eight: the messages name sensors by a mask of as many bits. What its data sheet
says of its errors stands in the rig's catalogue (`rig/config/sensors/sensor_catalogue.py`), how it behaves at its
registers in the model that the entry names.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from importlib import import_module
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from firmware_host.emulator.chip.spi_device import SpiDevice


@dataclass(frozen=True, slots=True)
class BoardPart:
    """A part and how it is wired.

    `name`: as the board's message `identity` spells it; `driver`: its `struct sensor_driver` in `firmware/core`.
    `who_am_i`: what its identity register reads; `in_its_place`: what other parts read there, and what they are.
    `select`, `data_ready`: the chip's pins. `model`: module and class of its register model in `emulator/`, and `told`:
    which arguments that model takes beside those that all models take, of `range_deg_s` and `ready_s`.
    """

    name: str
    driver: str
    who_am_i: int
    select: str
    data_ready: str
    model: str
    in_its_place: Mapping[int, str] = field(default_factory=dict)
    told: tuple[str, ...] = ()

    @property
    def register_model(self) -> "Callable[..., SpiDevice]":
        """The class that simulates the part at its registers."""
        module, name = self.model.split(":")
        found: Callable[..., Any] = getattr(import_module(f"firmware_host.emulator.parts.{module}"), name)
        return found

    def another(self, who_am_i: int) -> str:
        """What answers in the part's place, by its identity register."""
        known = self.in_its_place.get(who_am_i, "an unknown part")
        return f"{known}, identity 0x{who_am_i:02x} instead of 0x{self.who_am_i:02x}"


# Sources of what answers in another part's place: the identities in Linux' drivers st_gyro_core.c and st_lsm6dsx_core.c
# (0x0F), inv_mpu_iio.h and inv_icm42600.h (0x75) and adis16475.c, whose parts hold their own number (0x72).
GYROSCOPES: Mapping[str, BoardPart] = MappingProxyType(
    {
        "lsm9ds1": BoardPart(
            name="LSM9DS1",
            driver="lsm9ds1_gyro",
            who_am_i=0x68,
            select="PA11",
            data_ready="PA8",
            model="lsm9ds1:Lsm9ds1",
            in_its_place={
                0x69: "an LSM6DS3",
                0x6A: "an LSM6DSL or its like",
                0x6C: "an LSM6DSO or its like",
                0xD4: "an L3GD20 or LSM9DS0",
                0xD7: "an L3GD20H",
            },
        ),
        "mpu9250": BoardPart(
            name="MPU-9250",
            driver="mpu9250_gyro",
            who_am_i=0x71,
            select="PB0",
            data_ready="PA12",
            model="mpu9250:Mpu9250",
            in_its_place={
                0x68: "an MPU-6050, MPU-6000 or MPU-9150",
                0x70: "an MPU-6500",
                0x73: "an MPU-9255",
                0x74: "an MPU-6515",
                0xAF: "an ICM-20608",
            },
        ),
        "adis16465": BoardPart(
            name="ADIS16465",
            driver="adis16465_gyro",
            who_am_i=0x4051,  # 16465
            select="PA4",
            data_ready="PA1",
            model="adis16465:Adis16465",
            in_its_place={number: f"an ADIS{number}" for number in range(16001, 17000) if number != 16465},
            told=("range_deg_s", "ready_s"),  # it comes in three variants, one for each range, and is slow to start
        ),
        "icm42688p": BoardPart(
            name="ICM-42688-P",
            driver="icm42688p_gyro",
            who_am_i=0x47,
            select="PA10",
            data_ready="PA9",
            model="icm42688p:Icm42688P",
            in_its_place={
                0x12: "an ICM-20602",
                0x3B: "an ICM-40609-D",
                0x40: "an ICM-42600",
                0x41: "an ICM-42602",
                0x42: "an ICM-42605",
                0x46: "an ICM-42622",
                0x5C: "an ICM-42631",
                0x70: "an MPU-6500",
                0x71: "an MPU-9250",
            },
        ),
        "lsm6dsv16x": BoardPart(
            name="LSM6DSV16X",
            driver="lsm6dsv16x_gyro",
            who_am_i=0x70,
            select="PA7",
            data_ready="PB7",
            model="lsm6dsv16x:Lsm6dsv16x",
            in_its_place={
                0x68: "an LSM9DS1",
                0x69: "an LSM6DS3",
                0x6A: "an LSM6DSL or its like",
                0x6B: "an LSM6DSR or its like",
                0x6C: "an LSM6DSO or its like",
                0x71: "an LSM6DSV16B",
            },
        ),
    }
)

MAGNETOMETERS: Mapping[str, BoardPart] = MappingProxyType(
    {
        "lsm9ds1_magnetometer": BoardPart(
            name="LSM9DS1-M",
            driver="lsm9ds1_magnetometer",
            who_am_i=0x3D,
            select="PB1",
            data_ready="PA3",
            model="lsm9ds1_magnetometer:Lsm9ds1Magnetometer",
        ),
    }
)

BOARD_PARTS: Mapping[str, BoardPart] = MappingProxyType({**GYROSCOPES, **MAGNETOMETERS})  # in the order of the board
